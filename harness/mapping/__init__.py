"""Mapping: from scans to obstacle edges, free space and moving obstacles. Knows no true world."""
