"""Worlds from files: what other people's maps say, and what of it is an obstacle at one altitude."""
