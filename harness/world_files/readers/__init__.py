"""Readers of world files, one module a format."""
