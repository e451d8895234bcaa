"""Looks on while a flight is flown: paced by the wall clock, in the rerun viewer, in a MAVLink ground station."""
