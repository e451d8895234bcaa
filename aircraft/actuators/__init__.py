"""Servos: what they do to a command, and how they get into a model."""
