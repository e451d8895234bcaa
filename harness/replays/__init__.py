"""Flown flights beside the same missions simulated."""
