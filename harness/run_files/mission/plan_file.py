"""Missions in .plan files of QGroundControl, with their fences, and in the JSON that Mission Planner writes.

The format: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

from harness.files.fence_commands import inside_all
from harness.files.input_file import InputError
from harness.run_files.fences import Fence, Fences
from harness.run_files.mission import commands
from harness.run_files.mission.fence_items import rally_note
from harness.run_files.mission.items import MISSION, Item, MissionAsRead, filled, waiting_notes
from harness.run_files.read_values import finite, parsed_json, shown, whole

LANDING_PATTERNS: Final = {"fwLandingPattern": commands.LAND, "vtolLandingPattern": commands.VTOL_LAND}
"""Complex items that are written as a place to descend at and a place to land."""

RELATIVE, ABSOLUTE = 3, 0
"""MAV_FRAME of altitudes above home and above the sea."""


def read_plan(text: str, source: str) -> MissionAsRead:
    """The mission of a .plan, with its fences.

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is none.
    """
    plan = parsed_json(text, source)
    mission = plan.get("mission") if isinstance(plan, dict) else None
    kind = plan.get("fileType") if isinstance(plan, dict) else ""
    if kind != "Plan" and not (kind is None and isinstance(mission, dict)):  # Mission Planner leaves it open
        raise InputError(f'{source}: is not a plan of QGroundControl; must have "fileType": "Plan"')
    if not isinstance(mission, dict):
        raise InputError(f"{source}: mission.items: is missing; it is required")
    read = read_mission(mission, source, "mission.")
    fences = _fences(plan.get("geoFence"), source, inside_all(mission.get("firmwareType")))
    return replace(read, fences=fences, notes=(*read.notes, *_passed_over(plan)))


def read_mission(mission: dict[str, Any], source: str, key: str) -> MissionAsRead:
    """The mission of a plan, without its fences.

    Args:
        mission: the mapping.
        source: name of the file, for faults.
        key: what the keys of the mapping begin with, for faults.

    Raises:
        InputError: it is none.
    """
    listed = mission.get("items")
    if not isinstance(listed, list):
        raise InputError(f"{source}: {key}items: is missing; it is required")
    items: list[Item] = []
    notes: list[str] = []
    home, home_altitude_m = _home(mission, source, key, notes)
    for number, each in enumerate(listed):
        items += _items(each, f"{key}items[{number}]", source, len(items) + 1, notes)
    if len({item.number for item in items}) < len(items):
        items = [replace(item, number=number) for number, item in enumerate(items, start=1)]
        notes.append("a doJumpId is there twice: items are counted from 1 instead")
    notes += waiting_notes([item.number for item in items if item.waits])
    return MissionAsRead(source, tuple(items), home, home_altitude_m, Fences(), tuple(notes))


def _home(
    mission: dict[str, Any], source: str, key: str, notes: list[str]
) -> tuple[tuple[float, float] | None, float]:
    """Place and altitude of home; QGroundControl writes null for what it does not know."""
    home = mission.get("plannedHomePosition")
    if home is None or home == [None, None, None]:
        return None, 0.0
    if not isinstance(home, list) or len(home) != 3:
        raise InputError(f"{source}: {key}plannedHomePosition: must be [latitude, longitude, altitude]")
    if home[2] is None:
        notes.append("its home has no altitude: altitudes above home are counted from the sea")
        home = [*home[:2], 0.0]
    latitude, longitude, altitude = (
        finite(value, f"{source}: {key}plannedHomePosition[{i}]") for i, value in enumerate(home)
    )
    return (latitude, longitude), altitude


def _items(item: Any, key: str, source: str, number: int, notes: list[str]) -> Iterator[Item]:
    """The simple items that an item of a plan stands for; what it is without any goes into the notes."""
    if not isinstance(item, dict):
        raise InputError(f"{source}: {key}: must be a mission item")
    if item.get("type") == "SimpleItem" or (item.get("type") is None and item.get("command") is not None):
        yield _simple(item, key, source, number)
        return
    kind = shown(str(item.get("complexItemType") or item.get("type") or "without a type"))
    if kind in LANDING_PATTERNS:
        yield from _landing(item, key, source, number, LANDING_PATTERNS[kind])
        return
    inner = item.get("TransectStyleComplexItem", item)
    listed = inner.get("Items") if isinstance(inner, dict) else None
    if not isinstance(listed, list) or not listed:
        notes.append(f"item {number}, complex ({kind}): not flown, it has no items of its own")
        return
    where = f"{key}.TransectStyleComplexItem" if inner is not item else key
    for place, each in enumerate(listed):
        if not isinstance(each, dict):
            raise InputError(f"{source}: {where}.Items[{place}]: must be a mission item")
        yield _simple(each, f"{where}.Items[{place}]", source, number + place)


def _simple(item: dict[str, Any], key: str, source: str, number: int) -> Item:
    params = item.get("params")
    place = item.get("coordinate")
    if isinstance(params, list) and isinstance(place, list):
        params = _with_place(params, place)
    if not isinstance(params, list) or len(params) != 7:
        raise InputError(f"{source}: {key}.params: must be a list of 7")
    # QGroundControl writes null where something is left to the autopilot.
    given = [
        None if value is None else finite(value, f"{source}: {key}.params[{i}]")
        for i, value in enumerate(params)
    ]
    command, frame = (whole(item.get(name), f"{source}: {key}.{name}") for name in ("command", "frame"))
    values = filled(given, command, frame, lambda i: f"{source}: {key}.params[{i}]: is null")
    jump_id = item.get("doJumpId")
    numbered = jump_id if isinstance(jump_id, int) and not isinstance(jump_id, bool) else number
    return Item(f"{source}: {key}", numbered, command, frame, values, item.get("autoContinue") is False)


def _with_place(params: list[Any], place: list[Any]) -> list[Any]:
    """Parameters with the place that stands beside them.

    Before version 4.0 of QGroundControl it stood apart; some scripts write both, and zeros among the parameters.
    """
    apart = len(params) == 4 or (len(params) == 7 and not any(params[4:]))
    return [*params[:4], *place] if apart and len(place) == 3 else params


def _landing(item: dict[str, Any], key: str, source: str, number: int, land: int) -> Iterator[Item]:
    """A landing pattern: where it descends in a turn or on the way, and where it lands.

    Its earlier versions have `loiterCoordinate` for the approach, and each altitude says what it is above.
    """
    approach_name = "landingApproachCoordinate"
    if approach_name not in item and "loiterCoordinate" in item:
        approach_name = "loiterCoordinate"
    frames = []
    for name in ("loiterAltitudeRelative", "landAltitudeRelative"):
        name = name if name in item and "altitudesAreRelative" not in item else "altitudesAreRelative"
        relative = item.get(name, True)
        if not isinstance(relative, bool):
            raise InputError(f"{source}: {key}.{name}: must be true or false")
        frames.append(RELATIVE if relative else ABSOLUTE)
    places = []
    for name in (approach_name, "landCoordinate"):
        place = item.get(name)
        if not isinstance(place, list) or len(place) != 3:
            raise InputError(f"{source}: {key}.{name}: must be [latitude, longitude, altitude]")
        places.append([finite(value, f"{source}: {key}.{name}[{i}]") for i, value in enumerate(place)])
    approach, landing = places
    radius = finite(item.get("loiterRadius", 0.0), f"{source}: {key}.loiterRadius")
    side = 1.0 if item.get("loiterClockwise", True) else -1.0
    turning = item.get("useLoiterToAlt", True) is not False
    first = (1.0, side * abs(radius), 0.0, 1.0) if turning else (0.0, 0.0, 0.0, 0.0)
    command = commands.LOITER_TO_ALTITUDE if turning else commands.WAYPOINT
    place = f"{source}: {key}"
    yield Item(place, number, commands.LAND_START, MISSION, (0.0,) * 7)
    yield Item(place, number + 1, command, frames[0], (*first, *approach))
    yield Item(place, number + 2, land, frames[1], (0.0, 0.0, 0.0, 0.0, *landing))


def _fences(geofence: Any, source: str, every: bool) -> Fences:
    """The geoFence of a plan: polygons and circles, in degrees."""
    if geofence is None:
        return Fences()
    if not isinstance(geofence, dict):
        raise InputError(f"{source}: geoFence: must be a mapping")
    found = []
    old = geofence.get("polygon", [])
    if not isinstance(old, list):
        raise InputError(f"{source}: geoFence.polygon: must be a list of [latitude, longitude]")
    if old:  # before version 2: one, to stay inside of
        found.append(_polygon({"polygon": old, "inclusion": True}, source, "geoFence"))
    for kind in ("polygons", "circles"):
        listed = geofence.get(kind, [])
        if not isinstance(listed, list):
            raise InputError(f"{source}: geoFence.{kind}: must be a list")
        for number, each in enumerate(listed):
            key = f"geoFence.{kind}[{number}]"
            if not isinstance(each, dict) or not isinstance(each.get("inclusion"), bool):
                raise InputError(f"{source}: {key}.inclusion: must be true or false")
            found.append(_polygon(each, source, key) if kind == "polygons" else _circle(each, source, key))
    return Fences(tuple(found), inside_all=every)


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
        notes += rally_note(len(points))
    return tuple(notes)
