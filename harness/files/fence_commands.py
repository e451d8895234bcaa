"""Commands of MAVLink's items of fences and rally points, by which missions and worlds alike are read.

Numbers: https://mavlink.io/en/messages/common.html#MAV_CMD_NAV_FENCE_RETURN_POINT, and ardupilotmega.xml for 5005.
"""

from __future__ import annotations

from typing import Any, Final

RETURN_POINT: Final = 5000
CORNERS: Final = {5001: True, 5002: False}
"""Corner of an area to stay inside of, and of one to stay out of; the first parameter counts the corners."""
HOME_CIRCLE: Final = 5005
CIRCLES: Final = {5003: True, 5004: False, HOME_CIRCLE: True}
"""A circle to stay inside of, and one to stay out of, and one about home; the first parameter is the radius."""
RALLY_POINT: Final = 5100
APART: Final = frozenset((RETURN_POINT, *CORNERS, *CIRCLES, RALLY_POINT))
"""Commands of items that are no part of a mission."""

PX4: Final = 12
"""MAV_AUTOPILOT of PX4, `firmwareType` of a plan."""


def inside_all(firmware: Any) -> bool:
    """Whether an aircraft has to be inside of all inclusion fences of a plan, as ArduPilot has it, or of one, as PX4.

    Args:
        firmware: `firmwareType` of the plan; where it is neither, all count.
    """
    return bool(firmware != PX4)
