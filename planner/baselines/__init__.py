"""Planners to compare with: the BUG family, VFH+, a tree of Dubins curves."""
