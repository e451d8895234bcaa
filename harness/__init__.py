"""The closed loop: scenario, true world, sensing, flight, record, metrics, recording."""
