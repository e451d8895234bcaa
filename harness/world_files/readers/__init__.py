"""Readers of world files, one module a format; a file that cannot be used is an InputError."""
