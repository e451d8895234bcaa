"""Recordings for the rerun viewer: an observer of the loop. All that imports rerun."""
