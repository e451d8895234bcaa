"""From files alone to an area with start and goal: what `wayproof world` writes.

Frame: local ENU plane about the origin that is chosen, metres; a file without a place on earth keeps its own metres,
moved so that the south-western corner of the area is (0, 0).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from harness.world_files.area import (
    FAR_M,
    Covered,
    Ends,
    area_about,
    areas_of,
    center_of,
    common,
    middle_of,
    moved,
    whole_metres,
)
from harness.world_files.expansion import Expanded, FileFault, FileSpec, expanded, loaded_file
from harness.world_files.free_room import (
    CORRIDORS,
    LEAST_WAY,
    TURNS,
    FreeRoom,
    ends,
    free_room,
    scale_that_fits,
)
from harness.world_files.parts import Contents, WorldFileError
from harness.world_files.plane import Mapping, Place
from harness.world_files.slicing import Box, sliced_cells

ANY_PLACE: Final = Place(47.0, 8.0)
"""Where the plane lies of a file that has no place on earth."""
SCALABLE: Final = ("ros_map", "moving_ai", "ascii_grid")


@dataclass(frozen=True)
class Craft:
    """What the area must have room for.

    Attributes:
        name: of the aircraft.
        turn_radius_m: that its plans may ask for.
        clearance_m: wanted distance from obstacles.
    """

    name: str
    turn_radius_m: float
    clearance_m: float


@dataclass(frozen=True, eq=False)
class Site:
    """An area with a mission.

    Attributes:
        specs: the files, placed.
        place: origin of the plane; None where no file has a place on earth.
        bounds_m: of the area.
        start_m: east, north.
        goal_m: east, north.
        expanded: obstacles and ground there.
        notes: what was chosen.
    """

    specs: tuple[FileSpec, ...]
    place: Place | None
    bounds_m: Box
    start_m: tuple[float, float]
    goal_m: tuple[float, float]
    expanded: Expanded
    notes: tuple[str, ...]


def site(
    specs: Sequence[FileSpec],
    altitude_m: float,
    craft: Craft,
    given: Ends | None = None,
    tell: Callable[[str], None] | None = None,
) -> Site:
    """Chooses an area with start and goal in what some files hold.

    Of files larger than an area, other parts are tried where the first has no room for start and goal.

    Args:
        specs: the files.
        altitude_m: of the flight, above mean sea level.
        craft: what must have room.
        given: start and goal, each latitude and longitude where the files have a place on earth, else x and y.
        tell: told what is being done.

    Raises:
        FileFault: a file cannot be used.
        WorldFileError: there is no room; the message has the numbers and what would do.
    """
    contents = _read(specs, tell)
    place = None if contents[0].crs is None else middle_of(contents, given)
    ends = _placed_ends(given, place)
    mappings = _mappings(contents, specs, place)
    covered = Covered.by(contents, mappings)
    notes: tuple[str, ...] = ()
    if ends is not None:
        areas = [area_about(ends, covered, craft.turn_radius_m)]
    else:
        areas, notes = areas_of(covered, contents, mappings, altitude_m, craft.turn_radius_m)
    first: WorldFileError | None = None
    for area in areas:
        try:
            found = _in_area(area, specs, contents, place, ends, altitude_m, craft, tell)
            return replace(found, notes=(*notes, *found.notes))
        except FileFault:
            raise
        except WorldFileError as error:
            first = first or error
    assert first is not None
    raise first


def _read(specs: Sequence[FileSpec], tell: Callable[[str], None] | None) -> list[Contents]:
    """What the files hold; either all have a place on earth or none."""
    contents: list[Contents] = []
    for index, spec in enumerate(specs):
        if tell is not None:
            tell(f"reading {spec.path.name}")
        try:
            contents.append(loaded_file(spec.path, spec.kind, spec.reading))
        except WorldFileError as error:
            raise FileFault(index, str(error)) from error
    local = [each.crs is None for each in contents]
    if any(local) and not all(local):
        raise FileFault(
            local.index(True), "names no place on earth, but another file does; give crs, as EPSG:28992"
        )
    return contents


def _mappings(contents: Sequence[Contents], specs: Sequence[FileSpec], place: Place | None) -> list[Mapping]:
    return [
        Mapping(each.crs, place or ANY_PLACE, spec.shift_m)
        for each, spec in zip(contents, specs, strict=True)
    ]


def _in_area(
    bounds: Box,
    specs: Sequence[FileSpec],
    contents: Sequence[Contents],
    place: Place | None,
    chosen: Ends | None,
    altitude_m: float,
    craft: Craft,
    tell: Callable[[str], None] | None,
) -> Site:
    """A mission in an area, or a sentence with the numbers that say why there is none."""
    middle = center_of(bounds)
    if place is not None and chosen is None and math.hypot(*middle) > FAR_M:
        place = moved(
            place, middle
        )  # the area of the same size about it, no larger than rasters and fences there
        half = (bounds[2] - bounds[0]) / 2, (bounds[3] - bounds[1]) / 2
        own: Box = (-half[0], -half[1], half[0], half[1])
        covered = Covered.by(contents, _mappings(contents, specs, place))
        bounds = common([own, *covered.inside]) or own
    if place is None:
        east, north = -bounds[0], -bounds[1]
        specs = [replace(s, shift_m=(s.shift_m[0] + east, s.shift_m[1] + north)) for s in specs]
        bounds = (0.0, 0.0, bounds[2] + east, bounds[3] + north)
        if chosen is not None:
            (x0, y0), (x1, y1) = chosen
            chosen = (x0 + east, y0 + north), (x1 + east, y1 + north)
    bounds = whole_metres(bounds)
    room_m = craft.turn_radius_m + craft.clearance_m
    found = expanded(specs, place or ANY_PLACE, bounds, altitude_m, room_m, tell)
    notes: tuple[str, ...] = ()
    if chosen is None:
        chosen, notes = _ends(found, contents, specs, place, bounds, craft)
    start, goal = ((round(x, 1), round(y, 1)) for x, y in chosen)
    return Site(tuple(specs), place, bounds, start, goal, found, notes)


def _placed_ends(given: Ends | None, place: Place | None) -> Ends | None:
    if given is None or place is None:
        return given
    mapping = Mapping("EPSG:4326", place)
    east, north = mapping.to_plane(np.array([given[0][1], given[1][1]]), np.array([given[0][0], given[1][0]]))
    return (float(east[0]), float(north[0])), (float(east[1]), float(north[1]))


def _ends(
    found: Expanded,
    contents: Sequence[Contents],
    specs: Sequence[FileSpec],
    place: Place | None,
    bounds: Box,
    craft: Craft,
) -> tuple[Ends, tuple[str, ...]]:
    """Start and goal in free room, and what is to be said of the way; or the numbers that say why there are none."""
    solid = [each for source in found.sources for each in source.polygons]
    forbidden: list[Any] = []
    for each, spec in zip(contents, specs, strict=True):
        if each.occupied is not None and np.isnan(each.occupied.values).any():
            mapping = Mapping(each.crs, place or ANY_PLACE, spec.shift_m)
            forbidden += sliced_cells(each.occupied, np.isnan(each.occupied.values), mapping, bounds)[0]
    room = free_room(solid, bounds, forbidden)
    cell_m = None
    for turns in CORRIDORS:
        chosen = ends(room, craft.turn_radius_m, craft.clearance_m, turns)
        if chosen is None:
            cell_m = cell_m or _cell_that_fits(room, contents, specs, craft)
            continue
        if turns == CORRIDORS[0]:
            return chosen, ()
        wide_m = 2.0 * (craft.clearance_m + CORRIDORS[0] * craft.turn_radius_m)
        more = "" if cell_m is None else f"; with --metres-per-cell {cell_m:g} it can"
        return chosen, (
            f"every way from start to goal is somewhere narrower than {wide_m:,.0f} m, where {craft.name} cannot turn "
            f"round: the goal may be proved unreachable{more}",
        )
    width, height = bounds[2] - bounds[0], bounds[3] - bounds[1]
    needs = craft.clearance_m + TURNS[-1] * craft.turn_radius_m
    text = (
        f"{width:,.0f} x {height:,.0f} m, {room.free_share:.0%} free, are too small for {craft.name}: its start and "
        f"goal need {needs:,.0f} m of free room around and {LEAST_WAY * craft.turn_radius_m:,.0f} m between them, the "
        f"widest free disc has {room.widest_m:,.0f} m"
    )
    if cell_m is not None:
        raise WorldFileError(f"{text}; --metres-per-cell {cell_m:g} would do")
    raise WorldFileError(
        f"{text}; another altitude, a smaller clearance or aircraft, or a larger file would do"
    )


def _cell_that_fits(
    room: FreeRoom, contents: Sequence[Contents], specs: Sequence[FileSpec], craft: Craft
) -> float | None:
    """Side of a cell, in metres, with which the aircraft has room; None of files whose scale is given."""
    if not any(each.crs is None and each.kind in SCALABLE for each in contents):
        return None
    scale = scale_that_fits(room, craft.turn_radius_m, craft.clearance_m)
    return None if scale is None else _rounded_up(_cell_m(contents) * scale)


def _cell_m(contents: Sequence[Contents]) -> float:
    rasters = (each.occupied or each.terrain for each in contents)
    return next((math.hypot(each.affine[0], each.affine[3]) for each in rasters if each is not None), 1.0)


def _rounded_up(value: float) -> float:
    """To two digits."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / step - 1e-9) * step
