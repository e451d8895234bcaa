"""Shows a flight in the rerun viewer while it is flown, no faster than a given speed."""
