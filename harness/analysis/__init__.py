"""Figures of a flight: pure functions of record and world."""
