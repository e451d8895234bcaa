"""Guidance laws, one file each: pure functions from a state, a path and a memory to a lateral acceleration."""
