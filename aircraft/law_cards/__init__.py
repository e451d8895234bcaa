"""How well each guidance law tracks with each aircraft, which planning then allows for."""
