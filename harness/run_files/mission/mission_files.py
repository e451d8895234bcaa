"""Missions with their fences: .plan files of QGroundControl (developer guide, Plan file format), and "QGC WPL"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

from harness.files.input_file import InputError, finite, listed, numbers, parsed_json, shown, whole
from harness.files.mavlink import commands
from harness.files.mavlink import items as mavlink
from harness.files.wording import counted
from harness.run_files.drawn_lines import SPEED_NOT_FLOWN
from harness.run_files.fences import Fences
from harness.run_files.mission.program import Program, program

LANDING_PATTERNS: Final = {"fwLandingPattern": commands.LAND, "vtolLandingPattern": commands.VTOL_LAND}
"""Command to land at for complex items that are written as a place to descend at and a place to land."""
TRANSECTS: Final = "TransectStyleComplexItem"  # key of the mapping in which a survey has its items
HOLDS_NONE: Final = "not flown, it has no items of its own"  # ending of the note on a complex item
RELATIVE, ABSOLUTE = 3, 0  # MAV_FRAME of altitudes above home and above the sea
PLAN: Final = re.compile(r'"fileType"\s*:\s*"Plan"')  # key of every plan of QGroundControl, whatever its name
PLACE_FORM: Final = "[latitude, longitude, altitude]"
PLAN_SPEEDS: Final = ("cruiseSpeed", "hoverSpeed")  # keys of speeds (m/s), where no item says another
Home = tuple[tuple[float, float] | None, float]  # latitude and longitude, None if not said; altitude


def _mission(
    source: str, every: Sequence[mavlink.Item], home: Home, fences: Fences, rally: int, notes: list[str]
) -> Program:
    """Returns a mission, with notes on items that wait and on rally points; fences among its items are fences."""
    items = [item for item in every if item.command not in commands.NO_MISSION_COMMANDS]
    rally += sum(item.command == commands.RALLY_POINT for item in every)
    back = [item.number for item in every if item.command == commands.RETURN_POINT]
    notes += [f"item {each}, a return point, passed over: it is for after a breach" for each in back]
    if not items and every:
        held = f"{counted(len(every) - rally, 'fence item')} and {counted(rally, 'rally point')}"
        remedy = "`wayproof world` takes fences, and `check` takes them beside a mission"
        raise InputError(f"{source}: has no items to fly to, but {held}; {remedy}")
    fences = replace(fences, every=(*fences.every, *mavlink.item_fences(every, home[0])))
    if waiting := [each.number for each in items if each.autocontinue_off and each.command in commands.FLOWN]:
        told = f"{'item' if len(waiting) == 1 else 'items'} {', '.join(map(str, waiting))}"
        does = "PX4 waits there to be told to go on; flown on, as ArduPilot does"
        notes.append(f"{told}: autocontinue is off: {does}")
    if rally:
        told = f"{counted(rally, 'rally point')} passed over: a return to launch is flown to home"
        notes.append(f"{told}, not to the nearest of them")
    lost = "".join(f"; {note}" for note in notes if note.endswith(HOLDS_NONE))
    return replace(program(source, items, *home, lost), fences=fences, notes=tuple(notes))


def read_waypoints(text: str, source: str) -> Program:
    """Reads the mission of a plain-text file; its first item is home if it is a waypoint.

    A waypoint above home that has another number than 0 is no home.
    """
    notes: list[str] = []
    items = _number(mavlink.wpl_items(text, source), notes)
    return _mission(source, items, _home_item(items, notes), Fences(inside_all=True), 0, notes)


def _home_item(items: list[mavlink.Item], notes: list[str]) -> Home:
    """Takes the first item out of the items if it is home, and returns home; else no place, and altitude 0."""
    if not items or items[0].command != commands.WAYPOINT:
        return None, 0.0
    first, is_at_sea = items[0], mavlink.FRAMES.get(items[0].frame, mavlink.SEA) == mavlink.SEA
    if first.number != 0 and not is_at_sea:
        return None, 0.0
    del items[0]
    if not is_at_sea and first.params[6]:
        note = f"its altitude, {first.params[6]:g} m, is taken as above the sea"
        notes.append(f"its first item is home, though of frame {first.frame}: {note}")
    return first.position, first.params[6]


def _number(items: list[mavlink.Item], notes: list[str]) -> list[mavlink.Item]:
    """Returns items by their numbers; where one comes twice, or some are left out and there is a jump, by lines."""
    numbers = [item.number for item in items]
    twice = len(set(numbers)) < len(numbers)
    gaps = bool(numbers) and numbers != list(range(numbers[0], numbers[0] + len(numbers)))
    if not twice and not (gaps and any(item.command == commands.JUMP for item in items)):
        return items
    found = "come twice" if twice else "are left out"
    notes.append(f"some numbers of its items {found}: counted by lines from 0, as autopilots do")
    return [replace(item, number=number) for number, item in enumerate(items)]


def read_plan(text: str, source: str) -> Program:
    """Reads the mission of a .plan, with its fences."""
    plan = parsed_json(text, source)
    if not isinstance(plan, dict) or plan.get("fileType") != "Plan":
        wanted = '"fileType": "Plan" (of Mission Planner, save the mission as .waypoints)'
        raise InputError(f"{source}: is not a plan of QGroundControl; must have {wanted}")
    fences, inside_all, rally = mavlink.plan_fences(plan, f"{source}: ")
    mission = plan.get("mission")
    if not isinstance(mission, dict) or not isinstance(mission.get("items"), list):
        raise InputError(f"{source}: mission.items: is missing; it is required")
    notes: list[str] = []
    home = _home(mission.get("plannedHomePosition"), f"{source}: mission.plannedHomePosition", notes)
    items = _every_item(mission["items"], f"{source}: mission.items", notes)
    if (plan.get("geoFence") or {}).get("breachReturn") is not None:
        notes.append("geoFence.breachReturn passed over: it is flown to only after a breach")
    if speeds := [f"{key} {shown(str(mission[key]))}" for key in PLAN_SPEEDS if mission.get(key) is not None]:
        notes.append(f"{', '.join(speeds)} {SPEED_NOT_FLOWN}")
    return _mission(source, items, home, Fences(fences, inside_all), rally, notes)


def _home(home: Any, where: str, notes: list[str]) -> Home:
    """Returns place and altitude of home; QGroundControl writes null for what it does not know."""
    if home is None or home == [None, None, None]:
        return None, 0.0
    if isinstance(home, list) and len(home) == 3 and home[2] is None:
        notes.append("its home has no altitude: altitudes above home are counted from the sea")
        home = [*home[:2], 0.0]
    latitude, longitude, altitude = numbers(home, where, PLACE_FORM, (3,))
    return (latitude, longitude), altitude


def _every_item(given: Sequence[Any], where: str, notes: list[str]) -> list[mavlink.Item]:
    """Returns the items of a plan, numbered as there unless a number comes twice."""
    items: list[mavlink.Item] = []
    for number, each in enumerate(given):
        items += _items(each, f"{where}[{number}]", len(items) + 1, notes)
    if len({item.number for item in items}) < len(items):
        items = [replace(item, number=number) for number, item in enumerate(items, start=1)]
        notes.append("a doJumpId is there twice: items are counted from 1 instead")
    return items


def _items(item: Any, where: str, number: int, notes: list[str]) -> list[mavlink.Item]:
    """Returns the simple items that an item of a plan stands for, or none, with a note."""
    keys = item if isinstance(item, dict) else {}
    named, kind = keys.get("type"), shown(str(keys.get("complexItemType") or keys.get("type")))
    if not keys.get("complexItemType"):
        if named in ("SimpleItem", None):
            return [_simple(item, where, number)]
        if named not in ("ComplexItem", *LANDING_PATTERNS):
            raise InputError(f"{where}.type: is {kind!r}; must be 'SimpleItem' or 'ComplexItem'")
    if kind in LANDING_PATTERNS:
        return _landing(item, where, number, LANDING_PATTERNS[kind])
    inner, where = (item[TRANSECTS], f"{where}.{TRANSECTS}") if TRANSECTS in item else (item, where)
    held = inner.get("Items") if isinstance(inner, dict) else None
    if not isinstance(held, list) or not held:
        notes.append(f"item {number}, complex ({kind}): {HOLDS_NONE}")
        return []
    return [_simple(each, f"{where}.Items[{place}]", number + place) for place, each in enumerate(held)]


def _simple(item: Any, where: str, number: int) -> mavlink.Item:
    """Returns a simple item, whose place is in `params`, or apart: before version 4.0 of QGroundControl, by scripts."""
    if not isinstance(item, dict):
        raise InputError(f"{where}: must be a mission item")
    params, place = listed(item.get("params"), f"{where}.params", " of 7"), item.get("coordinate")
    if isinstance(place, list) and len(place) == 3 and not any(params[4:]):
        params = [*params[:4], *place]
    if len(params) != 7:
        raise InputError(f"{where}.params: must be a list of 7")
    # QGroundControl writes null where something is left to the autopilot.
    given = [None if each is None else finite(each, f"{where}.params[{k}]") for k, each in enumerate(params)]
    command, frame = (whole(item.get(name), f"{where}.{name}") for name in ("command", "frame"))
    values = mavlink.filled(given, command, frame, lambda index: f"{where}.params[{index}]: is null")
    if item.get("doJumpId") is not None:
        number = whole(item["doJumpId"], f"{where}.doJumpId")
    if (goes_on := item.get("autoContinue", True)) not in (True, False):
        raise InputError(f"{where}.autoContinue: is {shown(str(goes_on))!r}; must be true or false")
    return mavlink.Item(where, number, command, frame, values, not goes_on)


def _landing(item: dict[str, Any], where: str, number: int, land: int) -> list[mavlink.Item]:
    """Returns a landing pattern: where it descends in a turn or on the way, and where it lands.

    Before version 4.1 of QGroundControl it was always a turn; in the first, each place said what it is above.
    """
    is_old = "loiterCoordinate" in item and "landingApproachCoordinate" not in item
    ends = ("loiterCoordinate" if is_old else "landingApproachCoordinate", "landCoordinate")
    approach, landing = (numbers(item.get(each), f"{where}.{each}", PLACE_FORM, (3,)) for each in ends)
    frames = []
    for each in ("loiterAltitudeRelative", "landAltitudeRelative"):
        key = each if each in item else "altitudesAreRelative"
        if not isinstance(relative := item.get(key, True), bool):
            raise InputError(f"{where}.{key}: must be true or false")
        frames.append(RELATIVE if relative else ABSOLUTE)
    radius = abs(finite(item.get("loiterRadius", 0.0), f"{where}.loiterRadius"))
    turning = item.get("useLoiterToAlt", True) is not False
    side = radius if item.get("loiterClockwise", True) else -radius
    first = (1.0, side, 0.0, 1.0) if turning else (0.0, 0.0, 0.0, 0.0)
    command = commands.LOITER_TO_ALTITUDE if turning else commands.WAYPOINT
    return [
        mavlink.Item(where, number, commands.LAND_START, mavlink.MISSION, (0.0,) * 7),
        mavlink.Item(where, number + 1, command, frames[0], (*first, *approach)),
        mavlink.Item(where, number + 2, land, frames[1], (0.0, 0.0, 0.0, 0.0, *landing)),
    ]
