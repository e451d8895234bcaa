"""The scenario file: format, checks, generators, shipped files."""
