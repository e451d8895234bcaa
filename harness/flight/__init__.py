"""The closed loop, how a flight ends, and the record of it."""
