"""The breaking point of a scenario: the mildest condition under which a run fails."""
