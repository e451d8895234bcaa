"""Fences of autopilots: the geoFence of a QGroundControl plan, ArduPilot's fence files old and new."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import shapely

from harness.files.input_file import InputError, finite
from harness.files.mavlink import commands
from harness.files.mavlink.items import WPL, Fence, item_fences, plan_fences, wpl_items
from harness.files.wording import counted
from harness.world_files.bounded import MAX_TREE_BYTES, json_of, read_bytes, text_of
from harness.world_files.parts import WGS84, Contents, FileSpec, Part
from harness.world_files.readers.footprints import circle, on_earth


def read_plan(spec: FileSpec) -> Contents:
    """Reads the geoFence of a QGroundControl plan."""
    content = json_of(spec.path)
    if not isinstance(content, dict) or not isinstance(content.get("geoFence"), dict):
        raise InputError("has no geoFence; must be a QGroundControl plan with one")
    return _contents(*plan_fences(content, ""))


def read_ardupilot(spec: FileSpec) -> Contents:
    """Reads an ArduPilot fence: lines of latitude and longitude, the return point first; or a waypoint file."""
    if (text := text_of(read_bytes(spec.path, MAX_TREE_BYTES))).startswith(WPL):
        items = wpl_items(text, "")
        home = next((item.position for item in items[:1] if item.command == commands.WAYPOINT), None)
        return _contents(item_fences(items, home), True, [item.command for item in items].count(commands.RALLY_POINT))
    if len(places := _places(text)) < 4:
        raise InputError("has fewer than four lines; must be a return point and at least three corners")
    # Mission Planner saves polygons as fences, without a return point.
    bare = spec.path.suffix.lower() == ".poly" or (places[0] == places[-1] != places[1])
    notes = ("has no return point: its first place is a corner",) if bare else ()
    return _contents((Fence("fence", True, (tuple(places if bare else places[1:]),)),), True, 0, notes)


def _places(text: str) -> list[tuple[float, float]]:
    rows = [(f"line {n}", line.partition("#")[0].split()) for n, line in enumerate(text.splitlines(), 1)]
    if wrong := next((at for at, row in rows if len(row) not in (0, 2)), None):
        raise InputError(f"{wrong}: is not latitude and longitude; must be a fence")
    return [(finite(row[0], at, text=True), finite(row[1], at, text=True)) for at, row in rows if row]


def _fence_shape(fence: Fence) -> Any:
    places = [on_earth(east, north) for north, east in fence.places]
    if fence.center is not None:
        return circle(places[0], fence.radius_m)
    if len(set(places)) < 3:
        raise InputError(f"{fence.name}: has fewer than three corners; must enclose an area")
    return shapely.Polygon(places)


def _contents(fences: Sequence[Fence], inside_all: bool, rally: int, more: tuple[str, ...] = ()) -> Contents:
    """Returns fences as parts; unless `inside_all`, as with PX4, the union of all inclusion fences is one part."""
    points = counted(rally, "rally point")
    if not fences:
        held = f", but {points}, which are no obstacles" if rally else ""
        wanted = "at least one polygon or circle (a mission is flown by `wayproof check`)"
        raise InputError(f"has an empty fence{held}; must have {wanted}")
    inside = [_fence_shape(each) for each in fences if each.inclusion]
    inside = inside if inside_all or not inside else [shapely.union_all(inside)]
    parts = [Part(shape, name="inclusion fence", keep_in=True) for shape in inside]
    parts += [Part(_fence_shape(each), name="exclusion fence") for each in fences if not each.inclusion]
    passed = [f"{points} passed over: places to return to, no obstacles"] if rally else []
    notes = ("a fence has no heights: taken as solid at every altitude", *more, *passed)
    return Contents(WGS84, tuple(parts), notes=notes)
