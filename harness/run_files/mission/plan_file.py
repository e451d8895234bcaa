"""Missions in .plan files of QGroundControl, with their fences, and in the JSON that Mission Planner writes.

The format: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from harness.files.fence_commands import inside_all
from harness.files.input_file import InputError
from harness.run_files.fences import Fence, Fences
from harness.run_files.mission import commands
from harness.run_files.mission.fence_items import rally_note
from harness.run_files.mission.items import MISSION, Item, MissionAsRead, filled, waiting_notes
from harness.run_files.path_as_read import finite, parsed_json, shown, whole

LANDING_PATTERNS: Final = {"fwLandingPattern": commands.LAND, "vtolLandingPattern": commands.VTOL_LAND}
"""Complex items that are written as a place to descend at and a place to land."""
TRANSECTS: Final = "TransectStyleComplexItem"
"""The mapping in which a survey has its items."""
RELATIVE, ABSOLUTE = 3, 0
"""MAV_FRAME of altitudes above home and above the sea."""
Keys = dict[str, Any]


def read_plan(text: str, source: str) -> MissionAsRead:
    """The mission of a .plan, with its fences.

    Raises:
        InputError: it is none.
    """
    plan = parsed_json(text, source)
    mission = plan.get("mission") if isinstance(plan, dict) else None
    kind = plan.get("fileType") if isinstance(plan, dict) else ""
    if kind != "Plan" and not (kind is None and isinstance(mission, dict)):  # Mission Planner leaves it open
        raise InputError(f'{source}: is not a plan of QGroundControl; must have "fileType": "Plan"')
    listed = mission.get("items") if isinstance(mission, dict) else None
    if not isinstance(mission, dict) or not isinstance(listed, list):
        raise InputError(f"{source}: mission.items: is missing; it is required")
    items: list[Item] = []
    notes: list[str] = []
    home, home_altitude_m = _home(mission, f"{source}: mission.plannedHomePosition", notes)
    for number, each in enumerate(listed):
        items += _items(each, f"{source}: mission.items[{number}]", len(items) + 1, notes)
    if len({item.number for item in items}) < len(items):
        items = [replace(item, number=number) for number, item in enumerate(items, start=1)]
        notes.append("a doJumpId is there twice: items are counted from 1 instead")
    notes += waiting_notes(items)
    fences = Fences(tuple(_fences(plan.get("geoFence"), source)), inside_all(mission.get("firmwareType")))
    notes += _passed_over(plan)
    return MissionAsRead(source, tuple(items), home, home_altitude_m, fences, tuple(notes))


def _passed_over(plan: Keys) -> list[str]:
    """What else is in a plan that does not change the path."""
    geofence, rally = plan.get("geoFence"), plan.get("rallyPoints")
    notes = []
    if isinstance(geofence, dict) and geofence.get("breachReturn") is not None:
        notes.append("geoFence.breachReturn passed over: it is flown to only after a breach")
    points = rally.get("points") if isinstance(rally, dict) else None
    return [*notes, *rally_note(len(points) if isinstance(points, list) else 0)]


def _home(mission: Keys, where: str, notes: list[str]) -> tuple[tuple[float, float] | None, float]:
    """Place and altitude of home; QGroundControl writes null for what it does not know."""
    home = mission.get("plannedHomePosition")
    if home is None or home == [None, None, None]:
        return None, 0.0
    if isinstance(home, list) and len(home) == 3 and home[2] is None:
        notes.append("its home has no altitude: altitudes above home are counted from the sea")
        home = [*home[:2], 0.0]
    latitude, longitude, altitude = _numbers(home, where, "[latitude, longitude, altitude]", (3,))
    return (latitude, longitude), altitude


def _numbers(value: Any, where: str, form: str, lengths: tuple[int, ...]) -> list[float]:
    """A list of finite numbers."""
    if not isinstance(value, list) or len(value) not in lengths:
        raise InputError(f"{where}: must be {form}")
    return [finite(each, f"{where}[{number}]") for number, each in enumerate(value)]


def _items(item: Any, where: str, number: int, notes: list[str]) -> list[Item]:
    """The simple items that an item of a plan stands for; what it is without any goes into the notes."""
    if not isinstance(item, dict):
        raise InputError(f"{where}: must be a mission item")
    if item.get("type") == "SimpleItem" or (item.get("type") is None and item.get("command") is not None):
        return [_simple(item, where, number)]
    kind = shown(str(item.get("complexItemType") or item.get("type") or "without a type"))
    if kind in LANDING_PATTERNS:
        return _landing(item, where, number, LANDING_PATTERNS[kind])
    inner, where = (item[TRANSECTS], f"{where}.{TRANSECTS}") if TRANSECTS in item else (item, where)
    listed = inner.get("Items") if isinstance(inner, dict) else None
    if not isinstance(listed, list) or not listed:
        notes.append(f"item {number}, complex ({kind}): not flown, it has no items of its own")
        return []
    return [_simple(each, f"{where}.Items[{place}]", number + place) for place, each in enumerate(listed)]


def _simple(item: Any, where: str, number: int) -> Item:
    if not isinstance(item, dict):
        raise InputError(f"{where}: must be a mission item")
    params, place = item.get("params"), item.get("coordinate")
    if isinstance(params, list) and isinstance(place, list) and len(place) == 3:
        # Before version 4.0 of QGroundControl the place stood apart; some scripts write both, and zeros here.
        apart = len(params) == 4 or (len(params) == 7 and not any(params[4:]))
        params = [*params[:4], *place] if apart else params
    if not isinstance(params, list) or len(params) != 7:
        raise InputError(f"{where}.params: must be a list of 7")
    # QGroundControl writes null where something is left to the autopilot.
    given = [
        None if value is None else finite(value, f"{where}.params[{index}]")
        for index, value in enumerate(params)
    ]
    command, frame = (whole(item.get(name), f"{where}.{name}") for name in ("command", "frame"))
    values = filled(given, command, frame, lambda index: f"{where}.params[{index}]: is null")
    jump_id = item.get("doJumpId")
    number = jump_id if isinstance(jump_id, int) and not isinstance(jump_id, bool) else number
    return Item(where, number, command, frame, values, item.get("autoContinue") is False)


def _landing(item: Keys, where: str, number: int, land: int) -> list[Item]:
    """A landing pattern: where it descends in a turn or on the way, and where it lands.

    Its earlier versions have `loiterCoordinate` for the approach, and each altitude says what it is above.
    """
    approach_name = "landingApproachCoordinate"
    if approach_name not in item and "loiterCoordinate" in item:
        approach_name = "loiterCoordinate"
    approach, landing = (
        _numbers(item.get(name), f"{where}.{name}", "[latitude, longitude, altitude]", (3,))
        for name in (approach_name, "landCoordinate")
    )
    frames = [_frame(item, name, where) for name in ("loiterAltitudeRelative", "landAltitudeRelative")]
    radius = finite(item.get("loiterRadius", 0.0), f"{where}.loiterRadius")
    side = 1.0 if item.get("loiterClockwise", True) else -1.0
    turning = item.get("useLoiterToAlt", True) is not False
    first = (1.0, side * abs(radius), 0.0, 1.0) if turning else (0.0, 0.0, 0.0, 0.0)
    command = commands.LOITER_TO_ALTITUDE if turning else commands.WAYPOINT
    return [
        Item(where, number, commands.LAND_START, MISSION, (0.0,) * 7),
        Item(where, number + 1, command, frames[0], (*first, *approach)),
        Item(where, number + 2, land, frames[1], (0.0, 0.0, 0.0, 0.0, *landing)),
    ]


def _frame(item: Keys, name: str, where: str) -> int:
    """What an altitude of a landing pattern is above."""
    both = "altitudesAreRelative"
    name = both if both in item or name not in item else name
    relative = item.get(name, True)
    if not isinstance(relative, bool):
        raise InputError(f"{where}.{name}: must be true or false")
    return RELATIVE if relative else ABSOLUTE


def _fences(geofence: Any, source: str) -> list[Fence]:
    """The geoFence of a plan: polygons and circles, in degrees."""
    if geofence is None:
        return []
    if not isinstance(geofence, dict):
        raise InputError(f"{source}: geoFence: must be a mapping")
    found = []
    if old := geofence.get("polygon"):  # before version 2: one, to stay inside of
        found.append(_polygon({"polygon": old, "inclusion": True}, f"{source}: ", "geoFence"))
    for kind, read in (("polygons", _polygon), ("circles", _circle)):
        listed = geofence.get(kind, [])
        if not isinstance(listed, list):
            raise InputError(f"{source}: geoFence.{kind}: must be a list")
        for number, each in enumerate(listed):
            key = f"geoFence.{kind}[{number}]"
            if not isinstance(each, dict) or not isinstance(each.get("inclusion"), bool):
                raise InputError(f"{source}: {key}.inclusion: must be true or false")
            found.append(read(each, f"{source}: ", key))
    return found


def _polygon(each: Keys, source: str, key: str) -> Fence:
    corners = each.get("polygon")
    if not isinstance(corners, list):
        raise InputError(f"{source}{key}.polygon: must be a list of [latitude, longitude]")
    ring = tuple(_place(corner, f"{source}{key}.polygon[{number}]") for number, corner in enumerate(corners))
    return Fence(key, each["inclusion"], (ring,))


def _circle(each: Keys, source: str, key: str) -> Fence:
    circle = each.get("circle")
    if not isinstance(circle, dict):
        raise InputError(f"{source}{key}.circle: must have center and radius")
    radius = finite(circle.get("radius"), f"{source}{key}.circle.radius")
    if not radius > 0.0:
        raise InputError(f"{source}{key}.circle.radius: is {radius:g}; must be greater than 0")
    center = _place(circle.get("center"), f"{source}{key}.circle.center")
    return Fence(key, each["inclusion"], center=center, radius_m=radius)


def _place(value: Any, where: str) -> tuple[float, float]:
    latitude, longitude, *_ = _numbers(value, where, "[latitude, longitude]", (2, 3))
    return latitude, longitude
