"""Planar geometry of paths and edge points: curves, clearance, fans, arc lengths."""
