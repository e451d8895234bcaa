"""Planners side by side on the same scenarios."""
