"""Fences of autopilots: the geoFence of a QGroundControl plan, ArduPilot's fence files old and new.

What is not inside an inclusion fence is solid. PX4 asks to be inside one of several, ArduPilot inside all of them.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from harness.files.fence_commands import CIRCLES, CORNERS, HOME_CIRCLE, RALLY_POINT, inside_all
from harness.files.wording import counted
from harness.world_files.bounded import json_of, read_bytes, text_of
from harness.world_files.parts import WGS84, Contents, Part, Reading, WorldFileError
from harness.world_files.readers import rings

WAYPOINT: Final = 16
"""MAV_CMD of the first item of a waypoint file where that is home."""
POLYGON: Final = ".poly"
"""Ending of the polygons that Mission Planner saves: as a fence, without a return point."""
NOWHERE: Final = (0.0, 0.0)
"""Where an item has no place."""


def read_plan(path: Path, reading: Reading) -> Contents:
    """Reads the geoFence of a QGroundControl plan.

    Raises:
        WorldFileError: it has none, or it cannot be read.
    """
    content = json_of(path)
    fence = content.get("geoFence") if isinstance(content, dict) else None
    if not isinstance(fence, dict):
        raise WorldFileError("has no geoFence; must be a QGroundControl plan with one")
    found: list[tuple[Any, bool]] = []
    try:
        found += [
            (rings.ring([_turned(each) for each in polygon["polygon"]]), bool(polygon.get("inclusion")))
            for polygon in fence.get("polygons") or ()
        ]
        if isinstance(old := fence.get("polygon"), list) and old:  # before version 2: one, to stay inside of
            found.append((rings.ring([_turned(each) for each in old]), True))
        for one in fence.get("circles") or ():
            shape = rings.circle(_turned(one["circle"]["center"]), float(one["circle"]["radius"]))
            found.append((shape, bool(one.get("inclusion"))))
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        if isinstance(error, WorldFileError):
            raise
        raise WorldFileError("has a geoFence whose polygons or circles are not whole") from error
    mission = content.get("mission")
    any_of = isinstance(mission, dict) and not inside_all(mission.get("firmwareType"))
    rally = content.get("rallyPoints")
    points = rally.get("points") if isinstance(rally, dict) else None
    return _contents("plan_fence", found, any_of, len(points) if isinstance(points, list) else 0)


def _turned(place: Any) -> rings.Place:
    return rings.on_earth(float(place[1]), float(place[0]))


def read_ardupilot(path: Path, reading: Reading) -> Contents:
    """Reads an ArduPilot fence: lines of latitude and longitude, the return point first; or a waypoint file.

    Raises:
        WorldFileError: it cannot be read, or has no fence.
    """
    lines = [line.partition("#")[0].split() for line in text_of(read_bytes(path, 10_000_000)).splitlines()]
    rows = [line for line in lines if line]
    if rows and rows[0][0] == "QGC":
        found = _items(rows[1:])
        rally = sum(row[3] == str(RALLY_POINT) for row in rows[1:])
        return _contents("ardupilot_fence", found, any_of=False, rally=rally)
    try:
        places = [rings.on_earth(float(row[1]), float(row[0])) for row in rows if len(row) == 2]
    except ValueError as error:
        raise WorldFileError(
            "has a line that is not latitude and longitude; must be an ArduPilot fence"
        ) from error
    if len(places) != len(rows):
        raise WorldFileError("has a line that is not two numbers; must be an ArduPilot fence")
    if len(places) < 4:
        raise WorldFileError(f"has {len(places)} lines; must be a return point and at least three corners")
    if path.suffix.lower() == POLYGON or (places[0] == places[-1] != places[1]):
        closed = _contents("ardupilot_fence", [(rings.ring(places), True)], any_of=False)
        return replace(closed, notes=(*closed.notes, "has no return point: its first place is a corner"))
    return _contents("ardupilot_fence", [(rings.ring(places[1:]), True)], any_of=False)


def _items(rows: list[list[str]]) -> list[tuple[Any, bool]]:
    """Fences among the items of a waypoint file: four numbers, the fourth the command, four parameters, the place."""
    found: list[tuple[Any, bool]] = []
    pending: list[rings.Place] = []
    before, home = 0, None
    for number, row in enumerate(rows):
        try:
            command, first = int(row[3]), float(row[4])
            place = rings.on_earth(float(row[9]), float(row[8]))
        except (ValueError, IndexError) as error:
            raise WorldFileError("has a line that is no item of a waypoint file") from error
        if pending and command != before:
            raise WorldFileError(
                f"has a fence of {len(pending)} corners that should have more; it may be torn"
            )
        before = command
        if number == 0 and command == WAYPOINT and place != NOWHERE:
            home = place
        if command == HOME_CIRCLE:
            if home is None:
                raise WorldFileError(
                    "has a fence about home, whose place it does not say; give a circle with a place"
                )
            place = home
        if command in CIRCLES:
            found.append((rings.circle(place, first), CIRCLES[command]))
        elif command in CORNERS:
            pending.append(place)
            if len(pending) >= first:
                found.append((rings.ring(pending), CORNERS[command]))
                pending = []
    if pending:
        raise WorldFileError(f"has a fence of {len(pending)} corners that should have more; it may be torn")
    return found


def _contents(kind: str, fences: list[tuple[Any, bool]], any_of: bool, rally: int = 0) -> Contents:
    import shapely

    if any(shape is None for shape, _ in fences):
        raise WorldFileError("has a fence with fewer than three corners, or without an area")
    if not fences:
        held = f", but {counted(rally, 'rally point')}, which are no obstacles" if rally else ""
        raise WorldFileError(
            f"has an empty fence{held}; must have at least one polygon or circle (a mission is flown by `wayproof "
            "check`)"
        )
    inside = [shape for shape, inclusion in fences if inclusion]
    if any_of and len(inside) > 1:
        inside = [shapely.union_all(inside)]
    parts = [Part(shape, name="inclusion fence", keep_in=True) for shape in inside]
    parts += [Part(shape, name="exclusion fence") for shape, inclusion in fences if not inclusion]
    notes = ["a fence has no heights: taken as solid at every altitude"]
    if rally:
        notes.append(f"{counted(rally, 'rally point')} passed over: places to return to, no obstacles")
    return Contents(kind, WGS84, tuple(parts), notes=tuple(notes))
