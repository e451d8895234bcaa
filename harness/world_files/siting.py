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

from harness.world_files.cells import placed_cells
from harness.world_files.expansion import (
    Expanded,
    FileFault,
    FileSpec,
    blaming,
    corners_of,
    expanded,
    loaded_file,
)
from harness.world_files.free_room import (
    CORRIDORS,
    LEAST_WAY,
    TURNS,
    Ends,
    FreeRoom,
    ends,
    free_room,
    scale_that_fits,
)
from harness.world_files.parts import WGS84, Box, Contents, Datum, FloatArray, Part, WorldFileError
from harness.world_files.plane import TURN_DEG, Mapping, Place, geodetic, short_way

ANY_PLACE: Final = Place(47.0, 8.0)
"""Where the plane lies of a file that has no place on earth."""
SCALABLE: Final = ("ros_map", "moving_ai", "ascii_grid")
"""Kinds of files whose scale may be chosen, by metres_per_cell."""
LARGEST_TURNS, LARGEST_M = 400.0, 400_000.0
"""Longest side of an area, in turn radii and in metres: a part of a larger file is taken."""
PAD_TURNS: Final = 12.0
"""The area reaches this many turn radii beyond buildings and zones, which leaves room around them."""
TRIES: Final = 6
"""Parts of a large file that are tried before there is said to be no room."""


@dataclass(frozen=True)
class Craft:
    """What the area must have room for: the turn radius that plans may ask for, and the wanted clearance."""

    name: str
    turn_radius_m: float
    clearance_m: float


@dataclass(frozen=True, eq=False)
class Site:
    """An area with a mission: the files, placed, obstacles and ground there, and notes on what was chosen.

    The place is the origin of the plane; None where no file has a place on earth.
    """

    specs: tuple[FileSpec, ...]
    place: Place | None
    bounds_m: Box
    start_m: tuple[float, float]
    goal_m: tuple[float, float]
    expanded: Expanded
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Files:
    """What is sited: the files, what they hold, the aircraft and its altitude."""

    specs: tuple[FileSpec, ...]
    contents: tuple[Contents, ...]
    craft: Craft
    altitude_m: float
    tell: Callable[[str], None]

    def placed(self, place: Place | None) -> list[tuple[Contents, Mapping]]:
        """What each file holds, with the mapping of its coordinates to the plane of a place."""
        each = zip(self.specs, self.contents, strict=True)
        return [(held, Mapping(held.crs, place or ANY_PLACE, spec.shift_m)) for spec, held in each]


Area = tuple[Place | None, Box]
"""The origin of a plane, and the bounds of an area in it."""


def site(
    specs: Sequence[FileSpec],
    altitude_m: float,
    craft: Craft,
    given: Ends | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> Site:
    """Chooses an area with start and goal in what some files hold, at an altitude above mean sea level.

    Of files larger than an area, other parts are tried where the first has no room for start and goal. Those that are
    given are latitude and longitude where the files have a place on earth, else x and y.

    Raises:
        FileFault: a file cannot be used.
        WorldFileError: there is no room; the message has the numbers and what would do.
    """
    files = _Files(tuple(specs), _read(specs, tell), craft, altitude_m, tell)
    place = None if files.contents[0].crs is None else _origin(files.contents, given)
    if given is not None and place is not None:
        latitude, longitude = np.array(given).T
        start, goal = np.column_stack(Mapping(WGS84, place).to_plane(longitude, latitude)).tolist()
        given = (start[0], start[1]), (goal[0], goal[1])
    areas, notes = _areas(files, place, given)
    faults: list[WorldFileError] = []
    for area in areas:
        try:
            found = _in_area(files, area, given)
            return replace(found, notes=(*notes, *found.notes))
        except FileFault:
            raise
        except WorldFileError as error:
            faults.append(error)
    raise faults[0]


def _read(specs: Sequence[FileSpec], tell: Callable[[str], None]) -> tuple[Contents, ...]:
    """What the files hold; either all have a place on earth or none."""
    contents: list[Contents] = []
    for index, spec in enumerate(specs):
        tell(f"reading {spec.path.name}")
        with blaming(index):
            contents.append(loaded_file(spec.path, spec.kind, spec.reading))
    local = [each.crs is None for each in contents]
    if any(local) and not all(local):
        raise FileFault(
            local.index(True), "names no place on earth, but another file does; give crs, as EPSG:28992"
        )
    return tuple(contents)


def _origin(contents: Sequence[Contents], given: Ends | None) -> Place:
    """The origin: between start and goal, else in the middle of what the files hold."""
    if given is not None:
        latitude, longitude = np.array(given).T
        return _place(float(np.mean(latitude)), float(np.mean(short_way(longitude))))
    found = np.hstack([np.stack(geodetic(str(each.crs), *corners_of(each))) for each in contents])
    latitude, longitude = found[:, np.isfinite(found).all(axis=0)]
    if not len(latitude):
        raise WorldFileError("nothing of these files has a place on earth; their crs may be another")
    north, east = (0.5 * float(x.min() + x.max()) for x in (latitude, short_way(longitude)))
    return _place(min(max(north, -84.0), 84.0), east)


def _place(latitude_deg: float, longitude_deg: float) -> Place:
    return Place(round(latitude_deg, 5), round(math.remainder(longitude_deg, TURN_DEG), 5))


def _covered(files: _Files, place: Place | None) -> tuple[list[Box], list[Box]]:
    """Boxes of rasters and of fences to stay inside of, beyond which nothing is known or free; and of all others."""
    inside: list[Box] = []
    around: list[Box] = []
    for each, mapping in files.placed(place):
        raster = each.terrain or each.occupied
        east, north = mapping.to_plane(*corners_of(each if raster is None else replace(each, parts=())))
        known = np.isfinite(east) & np.isfinite(north)
        if known.any():
            # Of a raster the largest upright rectangle within its four corners, which may lie askew.
            first, last = (1, 2) if raster is not None else (0, -1)
            x, y = np.sort(east[known]).tolist(), np.sort(north[known]).tolist()
            bound = raster is not None or any(part.keep_in for part in each.parts)
            (inside if bound else around).append((x[first], y[first], x[last], y[last]))
    return inside, around


def _common(*boxes: Box) -> Box | None:
    """What lies in all of some boxes; None where nothing does."""
    (xmin, ymin), (xmax, ymax) = np.max(boxes, axis=0)[:2].tolist(), np.min(boxes, axis=0)[2:].tolist()
    return (xmin, ymin, xmax, ymax) if xmin < xmax and ymin < ymax else None


def _areas(files: _Files, place: Place | None, given: Ends | None) -> tuple[list[Area], tuple[str, ...]]:
    """Areas, the first the best, and what is to be said of them.

    There is one about a start and a goal that are given, and one where the files are small. Of large ones there are
    several parts, the most crowded first, the corners last.
    """
    inside, around = _covered(files, place)
    turn_m = files.craft.turn_radius_m
    pad = PAD_TURNS * turn_m
    if given is not None:
        reach = max(pad, 0.25 * math.dist(*given))
        box = (*(np.min(given, axis=0) - reach).tolist(), *(np.max(given, axis=0) + reach).tolist())
        return [(place, _common(*inside, box) or box)], ()
    low, high = np.min(around or inside, axis=0)[:2] - pad, np.max(around or inside, axis=0)[2:] + pad
    whole = _common(*inside, (*low.tolist(), *high.tolist()))
    if whole is None:
        raise WorldFileError("nothing of these files lies in one area; must overlap")
    sides, largest = (whole[2] - whole[0], whole[3] - whole[1]), min(LARGEST_TURNS * turn_m, LARGEST_M)
    if max(sides) <= largest:
        told = f"the area reaches {pad:,.0f} m beyond what the file holds, to leave room to turn"
        return [(place, whole)], () if inside else (told,)
    half = [min(side, largest) / 2 for side in sides]
    areas: list[Area] = []
    for x, y in _crowded(files, place, whole, half):
        if place is None:
            areas.append((None, (x - half[0], y - half[1], x + half[0], y + half[1])))
        else:  # with its origin in its middle, about which the plane is true to scale
            longitude, latitude = Mapping(WGS84, place).from_plane(np.array([x]), np.array([y]), 0.0)
            own = _place(float(latitude[0]), float(longitude[0]))
            box = (-half[0], -half[1], half[0], half[1])
            areas.append((own, _common(box, *_covered(files, own)[0]) or box))
    told = (
        f"the files reach over {sides[0] / 1e3:,.0f} x {sides[1] / 1e3:,.0f} km; the area is a part of that"
    )
    return areas, (told,)


def _crowded(
    files: _Files, place: Place | None, whole: Box, half: Sequence[float]
) -> list[tuple[float, float]]:
    """Middles of parts of a large area: those with most solids in them first, the outermost without any last."""
    import shapely

    middles: list[FloatArray] = [np.zeros((0, 2))]
    for each, mapping in files.placed(place):
        solid = [part.footprint for part in each.parts if _may_reach(part, files.altitude_m)]
        if solid:
            points = shapely.get_coordinates(shapely.centroid(np.array(solid, dtype=object)))
            middles.append(np.column_stack(mapping.to_plane(points[:, 0], points[:, 1])))
    places = np.concatenate(middles)
    axes, within = [], []
    for k in (0, 1):
        low, high, width = whole[k], whole[k + 2], half[k]
        axes.append(np.linspace(low + width, high - width, math.ceil((high - low) / width)))
        within.append((np.abs(places[:, k] - axes[k][:, None]) <= width).astype(np.float64))
    count = within[0] @ within[1].T
    x, y = np.meshgrid(*axes, indexing="ij")
    away = np.hypot(x - (whole[0] + whole[2]) / 2, y - (whole[1] + whole[3]) / 2)
    order = np.lexsort((away.ravel(), -count.ravel())).tolist()
    chosen = [*order[:TRIES], *order[TRIES:][-4:]]
    return list(zip(x.ravel()[chosen].tolist(), y.ravel()[chosen].tolist(), strict=True))


def _may_reach(part: Part, altitude_m: float) -> bool:
    """Whether a part may be solid at an altitude, as far as that is told without the ground."""
    begins = part.bottom.datum is Datum.GROUND or part.bottom.height_m <= altitude_m
    return begins and (part.top.datum is Datum.GROUND or part.top.height_m >= altitude_m)


def _in_area(files: _Files, area: Area, given: Ends | None) -> Site:
    """A mission in an area, or a sentence with the numbers that say why there is none."""
    place, bounds = area
    if place is None:
        east, north = -bounds[0], -bounds[1]
        moved = (replace(s, shift_m=(s.shift_m[0] + east, s.shift_m[1] + north)) for s in files.specs)
        files = replace(files, specs=tuple(moved))
        bounds = (0.0, 0.0, bounds[2] + east, bounds[3] + north)
        if given is not None:
            (x, y), (u, v) = given
            given = (x + east, y + north), (u + east, v + north)
    # Inwards to whole metres, or to a tenth of a small area.
    step = 1.0 if min(bounds[2] - bounds[0], bounds[3] - bounds[1]) > 100 else 0.1
    low = [round(math.ceil(side / step - 1e-9) * step, 1) for side in bounds[:2]]
    high = [round(math.floor(side / step + 1e-9) * step, 1) for side in bounds[2:]]
    bounds = (*low, *high)  # type: ignore[assignment]
    found = expanded(files.specs, place or ANY_PLACE, bounds, files.altitude_m, files.tell)
    notes: tuple[str, ...] = ()
    if given is None:
        given, notes = _ends(files, place, bounds, found)
    start, goal = ((round(x, 1), round(y, 1)) for x, y in given)
    return Site(files.specs, place, bounds, start, goal, found, notes)


def _ends(files: _Files, place: Place | None, bounds: Box, found: Expanded) -> tuple[Ends, tuple[str, ...]]:
    """Start and goal in free room, and what is to be said of the way; or the numbers that say why there are none."""
    craft, forbidden = files.craft, list[Any]()
    for each, mapping in files.placed(place):
        if each.occupied is not None:
            forbidden += placed_cells(each.occupied, np.isnan(each.occupied.values), mapping, bounds)[0]
    room = free_room([each for source in found.sources for each in source.polygons], bounds, forbidden)
    chosen = ends(room, craft.turn_radius_m, craft.clearance_m, CORRIDORS[0])
    if chosen is not None:
        return chosen, ()
    cell = f"--metres-per-cell {cell_m:g}" if (cell_m := _cell_that_fits(files, room)) else ""
    chosen = ends(room, craft.turn_radius_m, craft.clearance_m, CORRIDORS[1])
    if chosen is not None:
        wide_m = 2.0 * (craft.clearance_m + CORRIDORS[0] * craft.turn_radius_m)
        return chosen, (
            f"every way from start to goal is somewhere narrower than {wide_m:,.0f} m, where {craft.name} cannot turn "
            "round: the goal may be proved unreachable" + (f"; with {cell} it can" if cell else ""),
        )
    would = cell or "another altitude, a smaller clearance or aircraft, or a larger file"
    raise WorldFileError(
        f"{bounds[2] - bounds[0]:,.0f} x {bounds[3] - bounds[1]:,.0f} m, {room.free_share:.0%} free, are too small for "
        f"{craft.name}: its start and goal need {craft.clearance_m + TURNS[-1] * craft.turn_radius_m:,.0f} m of free "
        f"room around and {LEAST_WAY * craft.turn_radius_m:,.0f} m between them, the widest free disc has "
        f"{room.widest_m:,.0f} m; {would} would do"
    )


def _cell_that_fits(files: _Files, room: FreeRoom) -> float | None:
    """Side of a cell, in metres, with which the aircraft has room; None of files whose scale is given."""
    rasters = [
        each.occupied or each.terrain for each in files.contents if each.crs is None and each.kind in SCALABLE
    ]
    scale = scale_that_fits(room, files.craft.turn_radius_m, files.craft.clearance_m) if rasters else None
    if scale is None or rasters[0] is None:
        return None
    cell_m = math.hypot(rasters[0].affine[0], rasters[0].affine[3]) * scale
    step = 10.0 ** (math.floor(math.log10(cell_m)) - 1)
    return math.ceil(cell_m / step - 1e-9) * step
