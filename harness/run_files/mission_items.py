"""Mission items of MAVLink: what ground stations put into .plan and .waypoints files, as far as a path goes.

A path at one altitude is made of waypoints and nothing else; every other item is refused by name. Commands and
frames are those of MAVLink's common dialect, https://mavlink.io/en/messages/common.html#mav_commands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from harness.files.input_file import InputError
from harness.run_files.fences import Fences
from harness.run_files.path_as_read import PathAsRead

NO_FENCES: Final = Fences()

NAV_WAYPOINT: Final = 16

COMMAND_NAMES: Final = {
    17: "NAV_LOITER_UNLIM",
    18: "NAV_LOITER_TURNS",
    19: "NAV_LOITER_TIME",
    20: "NAV_RETURN_TO_LAUNCH",
    21: "NAV_LAND",
    22: "NAV_TAKEOFF",
    30: "NAV_CONTINUE_AND_CHANGE_ALT",
    31: "NAV_LOITER_TO_ALT",
    80: "NAV_ROI",
    82: "NAV_SPLINE_WAYPOINT",
    84: "NAV_VTOL_TAKEOFF",
    85: "NAV_VTOL_LAND",
    93: "NAV_DELAY",
    112: "CONDITION_DELAY",
    113: "CONDITION_CHANGE_ALT",
    114: "CONDITION_DISTANCE",
    115: "CONDITION_YAW",
    176: "DO_SET_MODE",
    177: "DO_JUMP",
    178: "DO_CHANGE_SPEED",
    179: "DO_SET_HOME",
    181: "DO_SET_RELAY",
    183: "DO_SET_SERVO",
    189: "DO_LAND_START",
    195: "DO_SET_ROI_LOCATION",
    197: "DO_SET_ROI_NONE",
    201: "DO_SET_ROI",
    203: "DO_DIGICAM_CONTROL",
    205: "DO_MOUNT_CONTROL",
    206: "DO_SET_CAM_TRIGG_DIST",
    207: "DO_FENCE_ENABLE",
    208: "DO_PARACHUTE",
    211: "DO_GRIPPER",
    530: "SET_CAMERA_MODE",
    1000: "DO_GIMBAL_MANAGER_PITCHYAW",
    2000: "IMAGE_START_CAPTURE",
    2001: "IMAGE_STOP_CAPTURE",
    2500: "VIDEO_START_CAPTURE",
    2501: "VIDEO_STOP_CAPTURE",
    3000: "DO_VTOL_TRANSITION",
}
"""Those a ground station is likely to write; others are named by their number."""

GLOBAL_FRAMES: Final = {0: "sea", 5: "sea", 3: "home", 6: "home"}
"""MAV_FRAME to what its altitude is above, for latitude and longitude."""

LOCAL_ENU, LOCAL_NED = 4, 1
FRAME_NAMES: Final = {
    2: "MISSION",
    7: "LOCAL_OFFSET_NED",
    10: "GLOBAL_TERRAIN_ALT",
    11: "GLOBAL_TERRAIN_ALT_INT",
}
LONGEST_HOLD_S = 1.0


@dataclass(frozen=True)
class Item:
    """One mission item.

    Attributes:
        place: where it stands, for faults: file, line or key.
        number: its number in the mission.
        command: MAV_CMD.
        frame: MAV_FRAME.
        params: the seven parameters; the last three are latitude or x, longitude or y, altitude or z.
    """

    place: str
    number: int
    command: int
    frame: int
    params: tuple[float, ...]


def waypoints(
    items: Sequence[Item], home_altitude_m: float, fences: Fences = NO_FENCES, notes: tuple[str, ...] = ()
) -> PathAsRead:
    """The waypoints that a mission is made of.

    Args:
        items: all items of the mission, home not among them.
        home_altitude_m: what relative altitudes count from, above mean sea level.
        fences: that come with the mission.
        notes: on what else does.

    Raises:
        InputError: an item is not a waypoint, or not one that can be flown through at a fixed altitude.
    """
    local = any(item.frame in (LOCAL_ENU, LOCAL_NED) for item in items)
    positions, altitudes, acceptance = [], [], []
    for item in items:
        _check(item, local)
        x, y, z = item.params[4:7]
        if item.frame == LOCAL_NED:
            x, y, z = y, x, -z
        positions.append((x, y))
        acceptance.append(max(item.params[1], 0.0))
        above_home = local or GLOBAL_FRAMES[item.frame] == "home"
        altitudes.append(z + home_altitude_m if above_home else z)
    return PathAsRead(local, tuple(positions), tuple(altitudes), False, tuple(acceptance), fences, notes)


def _check(item: Item, local: bool) -> None:
    if item.command != NAV_WAYPOINT:
        name = COMMAND_NAMES.get(item.command)
        known = f"MAV_CMD_{name} ({item.command})" if name else f"command {item.command}"
        raise InputError(
            f"{item.place}: item {item.number} is {known}; a path to be checked may only have "
            f"MAV_CMD_NAV_WAYPOINT ({NAV_WAYPOINT}): remove the item"
        )
    known_frames = (LOCAL_ENU, LOCAL_NED) if local else tuple(GLOBAL_FRAMES)
    if item.frame not in known_frames:
        name = FRAME_NAMES.get(item.frame, "")
        mixed = "; local and global waypoints cannot be mixed" if local else ""
        raise InputError(
            f"{item.place}: item {item.number} has the frame {item.frame} {name}".rstrip()
            + f", must be one of {', '.join(map(str, known_frames))}{mixed}"
        )
    if not item.params[0] < LONGEST_HOLD_S:
        raise InputError(
            f"{item.place}: item {item.number} holds for {item.params[0]:g} s; an aircraft that does not hover "
            "flies on: set its first parameter to 0"
        )
