"""Fixed-wing aircraft: flight models, guidance and the facts a planner needs about them."""
