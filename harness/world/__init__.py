"""The true world: obstacles, motion, the range sensor, the clairvoyant optimum."""
