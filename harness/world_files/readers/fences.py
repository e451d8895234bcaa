"""Fences of autopilots: the geoFence of a QGroundControl plan, ArduPilot's fence files old and new.

What is not inside an inclusion fence is solid. PX4 asks to be inside one of several, ArduPilot inside all of them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from harness.files.fence_commands import CIRCLES, CORNERS, HOME_CIRCLE, RALLY_POINT, inside_all
from harness.files.wording import counted
from harness.world_files.bounded import json_of, read_bytes, text_of
from harness.world_files.parts import WGS84, Contents, Part, Reading, WorldFileError
from harness.world_files.readers.footprints import Place, circle, on_earth

WAYPOINT: Final = 16
"""MAV_CMD of the first item of a waypoint file where that is home."""
TORN: Final = "has a fence of {} corners that should have more; it may be torn"
Fence = tuple[Any, bool]
"""A shape, and whether it is to be stayed inside of."""


def read_plan(path: Path, reading: Reading) -> Contents:
    """Reads the geoFence of a QGroundControl plan.

    Raises:
        WorldFileError: it has none, or it cannot be read.
    """
    content = json_of(path)
    fence = content.get("geoFence") if isinstance(content, dict) else None
    if not isinstance(fence, dict):
        raise WorldFileError("has no geoFence; must be a QGroundControl plan with one")
    polygons = list(fence.get("polygons") or ())
    if fence.get("polygon"):  # before version 2: one, to stay inside of
        polygons.append({"polygon": fence["polygon"], "inclusion": True})
    found: list[Fence] = []
    try:
        rings = [_ring([_turned(corner) for corner in each["polygon"]]) for each in polygons]
        found += [(ring, bool(each.get("inclusion"))) for ring, each in zip(rings, polygons, strict=True)]
        for each in fence.get("circles") or ():
            shape = circle(_turned(each["circle"]["center"]), float(each["circle"]["radius"]))
            found.append((shape, bool(each.get("inclusion"))))
        points = (content.get("rallyPoints") or {}).get("points") or ()
        firmware = (content.get("mission") or {"firmwareType": None}).get("firmwareType")
    except WorldFileError:
        raise
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise WorldFileError("has a geoFence whose polygons or circles are not whole") from error
    return _contents("plan_fence", found, not inside_all(firmware), len(points))


def _turned(place: Any) -> Place:
    return on_earth(float(place[1]), float(place[0]))


def _ring(places: list[Place]) -> Any:
    import shapely

    if len(set(places)) < 3:
        raise WorldFileError("has a fence with fewer than three corners; must enclose an area")
    return shapely.Polygon(places)


def read_ardupilot(path: Path, reading: Reading) -> Contents:
    """Reads an ArduPilot fence: lines of latitude and longitude, the return point first; or a waypoint file.

    Raises:
        WorldFileError: it cannot be read, or has no fence.
    """
    lines = [line.partition("#")[0].split() for line in text_of(read_bytes(path, 10_000_000)).splitlines()]
    rows = [line for line in lines if line]
    try:
        if rows and rows[0][0] == "QGC":
            rally = sum(row[3] == str(RALLY_POINT) for row in rows[1:])
            return _contents("ardupilot_fence", _items(rows[1:]), False, rally)
        places = [on_earth(float(east), float(north)) for north, east in rows]
    except WorldFileError:
        raise
    except (ValueError, IndexError) as error:
        raise WorldFileError(
            "has a line that is no item, nor latitude and longitude; must be a fence"
        ) from error
    if len(places) < 4:
        raise WorldFileError(f"has {len(places)} lines; must be a return point and at least three corners")
    # Mission Planner saves polygons as fences, without a return point.
    bare = path.suffix.lower() == ".poly" or (places[0] == places[-1] != places[1])
    told = ("has no return point: its first place is a corner",) if bare else ()
    return _contents("ardupilot_fence", [(_ring(places if bare else places[1:]), True)], False, 0, told)


def _items(rows: list[list[str]]) -> list[Fence]:
    """Fences among the items of a waypoint file: four numbers, the fourth the command, four parameters, the place."""
    found: list[Fence] = []
    pending: list[Place] = []
    home: Place | None = None
    before = 0
    for number, row in enumerate(rows):
        command, first, place = int(row[3]), float(row[4]), on_earth(float(row[9]), float(row[8]))
        if pending and command != before:
            raise WorldFileError(TORN.format(len(pending)))
        before = command
        if number == 0 and command == WAYPOINT and place != (0.0, 0.0):
            home = place
        if command == HOME_CIRCLE:
            if home is None:
                raise WorldFileError(
                    "has a fence about home, whose place it does not say; give a circle with a place"
                )
            place = home
        if command in CIRCLES:
            found.append((circle(place, first), CIRCLES[command]))
        elif command in CORNERS:
            pending.append(place)
            if len(pending) >= first:
                found.append((_ring(pending), CORNERS[command]))
                pending = []
    if pending:
        raise WorldFileError(TORN.format(len(pending)))
    return found


def _contents(
    kind: str, fences: list[Fence], any_of: bool, rally: int, told: tuple[str, ...] = ()
) -> Contents:
    """The fences as parts; where the aircraft has to be inside any of several, those are one."""
    import shapely

    points = counted(rally, "rally point")
    if not fences:
        held = f", but {points}, which are no obstacles" if rally else ""
        raise WorldFileError(
            f"has an empty fence{held}; must have at least one polygon or circle (a mission is flown by `wayproof "
            "check`)"
        )
    inside = [shape for shape, inclusion in fences if inclusion]
    inside = [shapely.union_all(inside)] if any_of and inside else inside
    parts = [Part(shape, name="inclusion fence", keep_in=True) for shape in inside]
    parts += [Part(shape, name="exclusion fence") for shape, inclusion in fences if not inclusion]
    notes = ["a fence has no heights: taken as solid at every altitude", *told]
    if rally:
        notes.append(f"{points} passed over: places to return to, no obstacles")
    return Contents(kind, WGS84, tuple(parts), notes=tuple(notes))
