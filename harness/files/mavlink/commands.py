"""Commands of MAVLink missions, fences and rally points, and how an aeroplane flies them.

Parameters: https://mavlink.io/en/messages/common.html#mav_commands; of ArduPilot alone: ardupilotmega.xml.
"""

from __future__ import annotations

from typing import Final

WAYPOINT, SPLINE_WAYPOINT = 16, 82
LOITER_UNLIMITED, LOITER_TURNS, LOITER_TIME, LOITER_TO_ALTITUDE = 17, 18, 19, 31
RETURN_TO_LAUNCH = 20
LAND, VTOL_LAND, LAND_START = 21, 85, 189
TAKEOFF, VTOL_TAKEOFF = 22, 84
JUMP, JUMP_TO_TAG, JUMP_TAG = 177, 601, 600
CHANGE_SPEED: Final = 178

LOITERS: Final = (LOITER_UNLIMITED, LOITER_TURNS, LOITER_TIME, LOITER_TO_ALTITUDE)  # commands to circle
TAKEOFFS: Final = {
    TAKEOFF: "the roll is not flown: the flight begins at the altitude of the takeoff",
    VTOL_TAKEOFF: "the vertical takeoff is not flown: the flight begins at its altitude",
}
LANDINGS: Final = (LAND, VTOL_LAND)
AT_AN_ALTITUDE: Final = (WAYPOINT, SPLINE_WAYPOINT, *TAKEOFFS)  # commands with an altitude of their own
FLOWN: Final = (*AT_AN_ALTITUDE, *LOITERS, RETURN_TO_LAUNCH, *LANDINGS)  # commands that are flown
NAMES: Final = {  # plain words for the commands of ordinary missions; any other is named by its number
    WAYPOINT: "waypoint", LOITER_UNLIMITED: "loiter without limit", LOITER_TURNS: "loiter turns",
    LOITER_TIME: "loiter time", RETURN_TO_LAUNCH: "return to launch", LAND: "land", TAKEOFF: "takeoff",
    30: "continue and change altitude", LOITER_TO_ALTITUDE: "loiter to altitude", SPLINE_WAYPOINT: "spline waypoint",
    VTOL_TAKEOFF: "VTOL takeoff", VTOL_LAND: "VTOL land", JUMP: "jump", CHANGE_SPEED: "change speed",
    LAND_START: "landing start", JUMP_TAG: "jump tag", JUMP_TO_TAG: "jump to tag", 36: "arc waypoint",
    112: "condition delay", 114: "condition distance", 116: "condition location", 42702: "script", 25: "follow",
    32: "follow", 93: "delay", 94: "place payload", 176: "set mode", 179: "set home", 180: "set parameter",
    183: "set servo", 192: "reposition", 223: "engine control", 201: "region of interest", 205: "control mount",
    206: "camera trigger distance", 207: "enable fence", 208: "parachute", 210: "inverted flight", 211: "gripper",
    214: "camera trigger interval", 2000: "take pictures", 2001: "stop taking pictures", 3000: "VTOL transition",
}  # fmt: skip
WITHOUT_EFFECT: Final = frozenset((  # commands without effect on an aeroplane's path: cameras, servos, marks
    80, 115, 181, 182, 183, 184, 187, 188, 190, 195, 196, 197, 198, 200, 201, 202, 203, 204, 205, 206, 207, 211, 212,
    214, 215, 216, 220, 223, 530, 531, 532, 534, 600, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 3000, 42600, LAND_START,
))  # fmt: skip
WHY_NOT: Final = {  # reasons why commands are not flown, where there is one to tell
    42702: "a script of the aircraft flies it",
    36: "an arc of a multicopter: ArduPlane goes on to the next item",
    **dict.fromkeys((112, 114, 116), "what follows it up to the next leg is not held back"),
}
WHY_NOT_AT: Final = {(3000, 3.0): "flown on as an aeroplane", (223, 0.0): "the engine runs on"}
"""The same by command and first parameter."""

RETURN_POINT: Final = 5000  # command for the return point of a fence
CORNERS: Final = {5001: True, 5002: False}
"""Commands for a corner of a fence: True to stay inside of, False outside; the first parameter counts the corners."""
HOME_CIRCLE: Final = 5005  # ArduPilot's fence about home
CIRCLES: Final = {5003: True, 5004: False, HOME_CIRCLE: True}
"""Commands for a circular fence: True to stay inside of, False outside; the first parameter is the radius."""
RALLY_POINT: Final = 5100  # command for a rally point, which is no item to fly to
NO_MISSION_COMMANDS: Final = frozenset((RETURN_POINT, *CORNERS, *CIRCLES, RALLY_POINT))
PX4: Final = 12  # `firmwareType` of a plan that keeps inside one inclusion fence; others keep inside all


def name_of(command: int) -> str:
    """Names a command in plain words, else by its number, to which pymavlink, where installed, adds MAVLink's name."""
    if command in NAMES:
        return NAMES[command]
    try:
        from pymavlink.dialects.v20.ardupilotmega import enums
    except ImportError:
        return f"command {command}"
    entry = enums["MAV_CMD"].get(command)
    return f"command {command}" + ("" if entry is None else f" ({entry.name.removeprefix('MAV_CMD_')})")
