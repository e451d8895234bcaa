"""Files of MAVLink's ground stations: mission items and fences."""
