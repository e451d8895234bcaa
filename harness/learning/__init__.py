"""Environments of gymnasium: a flight that is steered from outside, waypoint by waypoint or by roll commands."""
