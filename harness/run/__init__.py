"""From a scenario to a flight, and from a flight to a run folder."""
