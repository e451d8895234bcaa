"""Missions in files of ground stations: QGroundControl's .plan and MAVLink's .waypoints."""

from __future__ import annotations

from typing import Any, Final

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.run_files.fences import Fence, Fences
from harness.run_files.mission_items import Item, waypoints
from harness.run_files.path_as_read import PathAsRead
from harness.run_files.read_values import finite, parsed_json, shown, whole

WPL: Final = "QGC WPL"

ARDUPILOT: Final = 3
"""MAV_AUTOPILOT of ArduPilot, which wants an aircraft inside of all inclusion fences; PX4 wants it inside of one."""


def read_plan(text: str, source: str) -> PathAsRead:
    """The mission of a .plan, with its fences.

    The format: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is none, or holds an item that is not flown.
    """
    plan = parsed_json(text, source)
    if not isinstance(plan, dict) or plan.get("fileType") != "Plan":
        raise InputError(f'{source}: is not a plan of QGroundControl; must have "fileType": "Plan"')
    mission = plan.get("mission")
    listed = mission.get("items") if isinstance(mission, dict) else None
    if not isinstance(mission, dict) or not isinstance(listed, list):
        raise InputError(f"{source}: mission.items: is missing; it is required")
    home = mission.get("plannedHomePosition", [0.0, 0.0, 0.0])
    if not isinstance(home, list) or len(home) != 3:
        raise InputError(f"{source}: mission.plannedHomePosition: must be [latitude, longitude, altitude]")
    items = [_plan_item(item, number, source) for number, item in enumerate(listed)]
    fences = _fences(plan.get("geoFence"), source, mission.get("firmwareType") == ARDUPILOT)
    home_m = finite(home[2], f"{source}: mission.plannedHomePosition[2]")
    return waypoints(items, home_m, fences, _passed_over(plan))


def _plan_item(item: Any, number: int, source: str) -> Item:
    key = f"mission.items[{number}]"
    if not isinstance(item, dict):
        raise InputError(f"{source}: {key}: must be a mission item")
    if item.get("type") != "SimpleItem":
        kind = shown(str(item.get("complexItemType") or item.get("type") or "without a type"))
        raise InputError(
            f"{source}: {key}: item {number + 1} is a complex item, {kind}; a path to be checked may only have "
            "MAV_CMD_NAV_WAYPOINT (16): remove the item"
        )
    params = item.get("params")
    if not isinstance(params, list) or len(params) != 7:
        raise InputError(f"{source}: {key}.params: must be a list of 7")
    # QGroundControl writes null where one of the first four is left to the autopilot; the others are the place.
    values = [0.0 if value is None else value for value in params[:4]] + params[4:]
    values = [finite(value, f"{source}: {key}.params[{i}]") for i, value in enumerate(values)]
    command, frame = (whole(item.get(name), f"{source}: {key}.{name}") for name in ("command", "frame"))
    jump_id = item.get("doJumpId")
    numbered = jump_id if isinstance(jump_id, int) else number + 1
    return Item(f"{source}: {key}", numbered, command, frame, tuple(values))


def _fences(geofence: Any, source: str, inside_all: bool) -> Fences:
    """The geoFence of a plan: polygons and circles, in degrees."""
    if geofence is None:
        return Fences()
    if not isinstance(geofence, dict):
        raise InputError(f"{source}: geoFence: must be a mapping")
    found = []
    for kind in ("polygons", "circles"):
        listed = geofence.get(kind, [])
        if not isinstance(listed, list):
            raise InputError(f"{source}: geoFence.{kind}: must be a list")
        for number, each in enumerate(listed):
            key = f"geoFence.{kind}[{number}]"
            if not isinstance(each, dict) or not isinstance(each.get("inclusion"), bool):
                raise InputError(f"{source}: {key}.inclusion: must be true or false")
            found.append(_polygon(each, source, key) if kind == "polygons" else _circle(each, source, key))
    return Fences(tuple(found), inside_all)


def _polygon(each: dict[str, Any], source: str, key: str) -> Fence:
    corners = each.get("polygon")
    if not isinstance(corners, list):
        raise InputError(f"{source}: {key}.polygon: must be a list of [latitude, longitude]")
    ring = tuple(
        _place(corner, f"{source}: {key}.polygon[{number}]") for number, corner in enumerate(corners)
    )
    return Fence(key, each["inclusion"], (ring,))


def _circle(each: dict[str, Any], source: str, key: str) -> Fence:
    circle = each.get("circle")
    if not isinstance(circle, dict):
        raise InputError(f"{source}: {key}.circle: must have center and radius")
    radius = finite(circle.get("radius"), f"{source}: {key}.circle.radius")
    if not radius > 0.0:
        raise InputError(f"{source}: {key}.circle.radius: is {radius:g}; must be greater than 0")
    center = _place(circle.get("center"), f"{source}: {key}.circle.center")
    return Fence(key, each["inclusion"], center=center, radius_m=radius)


def _place(value: Any, where: str) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) not in (2, 3):
        raise InputError(f"{where}: must be [latitude, longitude]")
    return finite(value[0], where), finite(value[1], where)


def _passed_over(plan: dict[str, Any]) -> tuple[str, ...]:
    """What else is in a plan that does not change the path."""
    notes = []
    geofence, rally = plan.get("geoFence"), plan.get("rallyPoints")
    if isinstance(geofence, dict) and geofence.get("breachReturn") is not None:
        notes.append("geoFence.breachReturn passed over: it is flown to only after a breach")
    points = rally.get("points") if isinstance(rally, dict) else None
    if isinstance(points, list) and points:
        notes.append(f"{counted(len(points), 'rally point')} passed over: not flown to on the mission")
    return tuple(notes)


def read_waypoints(text: str, source: str) -> PathAsRead:
    """The mission of a .waypoints file; its first item is home.

    The format: https://mavlink.io/en/file_formats/#mission_plain_text_file

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is none, or holds an item that is not flown.
    """
    lines = text.splitlines()
    if not lines or not lines[0].startswith(WPL):
        raise InputError(f'{source}:1: must begin with "{WPL} 110"')
    items = []
    for number, line in enumerate(lines[1:], start=2):
        cells = line.split()
        if not cells:
            continue
        place = f"{source}:{number}"
        if len(cells) != 12:
            raise InputError(f"{place}: has {len(cells)} fields; a mission item has 12")
        index, frame, command = (whole(cells[i], place) for i in (0, 2, 3))
        items.append(Item(place, index, command, frame, tuple(finite(c, place) for c in cells[4:11])))
    if not items:
        raise InputError(f"{source}: has no items; the first is home, the others are the path")
    return waypoints(items[1:], items[0].params[6])
