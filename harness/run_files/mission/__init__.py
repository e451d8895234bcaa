"""Missions of ground stations: what their items are, and what of it an aeroplane flies."""
