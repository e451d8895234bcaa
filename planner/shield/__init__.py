"""A certified backup around any planner: its path is flown only as far as a safe turn from there has been seen."""
