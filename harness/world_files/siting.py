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

from harness.world_files.expansion import Expanded, FileFault, FileSpec, corners_of, expanded, loaded_file
from harness.world_files.free_room import LEAST_WAY, TURNS, ends, free_room, scale_that_fits
from harness.world_files.parts import Contents, Datum, FloatArray, Part, WorldFileError
from harness.world_files.plane import Mapping, Place, geodetic
from harness.world_files.slicing import Box, sliced_cells

LARGEST_TURNS, LARGEST_M = 400.0, 400_000.0
"""Longest side of an area, in turn radii and in metres: of larger files a part is taken."""
PAD_TURNS: Final = 12.0
"""The area reaches so many turn radii beyond buildings and zones: they leave room around them."""
ANY_PLACE: Final = Place(47.0, 8.0)
"""Where the plane lies of a file that has no place on earth."""
SCALABLE: Final = ("ros_map", "moving_ai", "gazebo_world", "ascii_grid")


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
    given: tuple[tuple[float, float], tuple[float, float]] | None = None,
    tell: Callable[[str], None] | None = None,
) -> Site:
    """Chooses an area with start and goal in what some files hold.

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
    contents = []
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
    place = None if all(local) else _middle(contents, given)
    mappings = [
        Mapping(each.crs, place or ANY_PLACE, spec.shift_m)
        for each, spec in zip(contents, specs, strict=True)
    ]
    chosen = _placed_ends(given, place)
    bounds, notes = _area(contents, mappings, specs, altitude_m, craft, chosen)
    if place is None:
        shift = (-bounds[0], -bounds[1])
        specs = [replace(s, shift_m=(s.shift_m[0] + shift[0], s.shift_m[1] + shift[1])) for s in specs]
        bounds = (0.0, 0.0, bounds[2] + shift[0], bounds[3] + shift[1])
        if chosen is not None:
            (x0, y0), (x1, y1) = chosen
            chosen = (x0 + shift[0], y0 + shift[1]), (x1 + shift[0], y1 + shift[1])
    bounds = _whole_metres(bounds)
    found = expanded(
        specs, place or ANY_PLACE, bounds, altitude_m, craft.turn_radius_m + craft.clearance_m, tell
    )
    if chosen is None:
        chosen = _ends(found, contents, specs, place, bounds, craft)
    start, goal = ((round(x, 1), round(y, 1)) for x, y in chosen)
    return Site(tuple(specs), place, bounds, start, goal, found, tuple(notes))


def _middle(
    contents: Sequence[Contents], given: tuple[tuple[float, float], tuple[float, float]] | None
) -> Place:
    """Origin: between start and goal, else in the middle of what the files hold."""
    if given is not None:
        (north, west), (south, east) = given
        return Place(round((north + south) / 2, 5), round((west + east) / 2, 5))
    latitudes, longitudes = [], []
    for each in contents:
        latitude, longitude = geodetic(str(each.crs), *corners_of(each))
        latitudes.append(latitude[np.isfinite(latitude)])
        longitudes.append(longitude[np.isfinite(latitude)])
    latitude, longitude = np.concatenate(latitudes), np.concatenate(longitudes)
    if not len(latitude):
        raise WorldFileError("nothing of these files has a place on earth; their crs may be another")
    middle = [0.5 * float(each.min() + each.max()) for each in (latitude, longitude)]
    if max(np.ptp(latitude), np.ptp(longitude)) > 5.0:  # a country: where most of it is
        middle = [float(np.median(each)) for each in (latitude, longitude)]
    return Place(round(min(max(middle[0], -84.0), 84.0), 5), round(middle[1], 5))


def _placed_ends(
    given: tuple[tuple[float, float], tuple[float, float]] | None, place: Place | None
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    if given is None or place is None:
        return given
    mapping = Mapping("EPSG:4326", place)
    east, north = mapping.to_plane(np.array([given[0][1], given[1][1]]), np.array([given[0][0], given[1][0]]))
    return (float(east[0]), float(north[0])), (float(east[1]), float(north[1]))


def _area(
    contents: Sequence[Contents],
    mappings: Sequence[Mapping],
    specs: Sequence[FileSpec],
    altitude_m: float,
    craft: Craft,
    chosen: tuple[tuple[float, float], tuple[float, float]] | None,
) -> tuple[Box, list[str]]:
    """Bounds of the area, and what to say of them."""
    rasters: list[Box] = []
    vectors: list[Box] = []
    for each, mapping, spec in zip(contents, mappings, specs, strict=True):
        box, is_raster = _extent(each, mapping, spec, altitude_m)
        if box is not None:
            (rasters if is_raster else vectors).append(box)
    notes: list[str] = []
    pad = PAD_TURNS * craft.turn_radius_m
    largest = min(LARGEST_TURNS * craft.turn_radius_m, LARGEST_M)
    whole = _common(rasters)
    if vectors:
        around = _joined(vectors)
        around = (around[0] - pad, around[1] - pad, around[2] + pad, around[3] + pad)
        if whole is None:
            notes.append(f"the area reaches {pad:,.0f} m beyond what the file holds, to leave room to turn")
        whole = around if whole is None else _common([whole, around])
    if whole is None:
        raise WorldFileError("nothing of these files lies in one area; must overlap")
    if chosen is not None:
        (x0, y0), (x1, y1) = chosen
        reach = max(pad, 0.25 * math.dist(*chosen))
        box = (min(x0, x1) - reach, min(y0, y1) - reach, max(x0, x1) + reach, max(y0, y1) + reach)
        if rasters:
            box = _common([_common(rasters) or box, box]) or box
        return box, notes
    sides = whole[2] - whole[0], whole[3] - whole[1]
    if max(sides) > largest:
        x, y = _focus(contents, mappings, whole, altitude_m, largest / 3)
        half = [min(side, largest) / 2 for side in sides]
        x, y = (min(max(v, whole[k] + half[k]), whole[k + 2] - half[k]) for k, v in enumerate((x, y)))
        whole = (x - half[0], y - half[1], x + half[0], y + half[1])
        notes.append(
            f"the files reach over {sides[0] / 1e3:,.0f} x {sides[1] / 1e3:,.0f} km; the area is a part of that"
        )
    return whole, notes


def _extent(
    contents: Contents, mapping: Mapping, spec: FileSpec, altitude_m: float
) -> tuple[Box | None, bool]:
    """What a file covers, and whether it is a raster, beyond which nothing is known."""
    raster = contents.terrain or contents.occupied
    if raster is not None:
        east, north = (np.sort(each) for each in mapping.to_plane(*corners_of(replace(contents, parts=()))))
        # The largest upright rectangle within its four corners, which may lie askew.
        return (float(east[1]), float(north[1]), float(east[2]), float(north[2])), True
    east, north = mapping.to_plane(*corners_of(contents))
    known = np.isfinite(east) & np.isfinite(north)
    if not known.any():
        return None, False
    box = (
        float(east[known].min()),
        float(north[known].min()),
        float(east[known].max()),
        float(north[known].max()),
    )
    return box, contents.kind == "gazebo_world" or any(part.keep_in for part in contents.parts)


def _common(boxes: Sequence[Box]) -> Box | None:
    """What lies in all boxes; None where nothing does."""
    if not boxes:
        return None
    box = tuple(f(each[k] for each in boxes) for k, f in enumerate((max, max, min, min)))
    return box if box[0] < box[2] and box[1] < box[3] else None  # type: ignore[return-value]


def _joined(boxes: Sequence[Box]) -> Box:
    return tuple(f(each[k] for each in boxes) for k, f in enumerate((min, min, max, max)))  # type: ignore[return-value]


def _focus(
    contents: Sequence[Contents], mappings: Sequence[Mapping], whole: Box, altitude_m: float, reach_m: float
) -> tuple[float, float]:
    """Where in a large area to look: at the part with most others near it, else in the middle."""
    import shapely

    middles: list[FloatArray] = []
    for each, mapping in zip(contents, mappings, strict=True):
        solid = [part.footprint for part in each.parts if _may_be_solid(part, altitude_m)]
        if solid:
            points = shapely.get_coordinates(shapely.centroid(np.array(solid, dtype=object)))
            middles.append(np.column_stack(mapping.to_plane(points[:, 0], points[:, 1])))
    if not middles:
        return (whole[0] + whole[2]) / 2, (whole[1] + whole[3]) / 2
    places = np.concatenate(middles)
    inside = ((places >= whole[:2]) & (places <= whole[2:])).all(axis=1) & np.isfinite(places).all(axis=1)
    places = places[inside]
    if not len(places):
        return (whole[0] + whole[2]) / 2, (whole[1] + whole[3]) / 2
    some = places[:: max(len(places) // 2000, 1)]
    near = np.array([(np.abs(places - each).max(axis=1) <= reach_m).sum() for each in some])
    best = some[near.argmax()]
    return float(best[0]), float(best[1])


def _may_be_solid(part: Part, altitude_m: float) -> bool:
    """Whether a part may reach to an altitude, as far as that is told without the ground."""
    low, high = part.bottom, part.top
    return (low.datum is Datum.GROUND or low.height_m <= altitude_m) and (
        high.datum is Datum.GROUND or high.height_m >= altitude_m
    )


def _whole_metres(box: Box) -> Box:
    """Inwards to whole metres, or to a tenth of a small one."""
    step = 1.0 if min(box[2] - box[0], box[3] - box[1]) > 100 else 0.1
    low = [round(math.ceil(each / step - 1e-9) * step, 1) for each in box[:2]]
    high = [round(math.floor(each / step + 1e-9) * step, 1) for each in box[2:]]
    return low[0], low[1], high[0], high[1]


def _ends(
    found: Expanded,
    contents: Sequence[Contents],
    specs: Sequence[FileSpec],
    place: Place | None,
    bounds: Box,
    craft: Craft,
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Start and goal in free room, or a sentence with the numbers that say why not."""
    solid = [each for source in found.sources for each in source.polygons]
    forbidden: list[Any] = []
    for each, spec in zip(contents, specs, strict=True):
        if each.occupied is not None and np.isnan(each.occupied.values).any():
            mapping = Mapping(each.crs, place or ANY_PLACE, spec.shift_m)
            forbidden += sliced_cells(each.occupied, np.isnan(each.occupied.values), mapping, bounds)[0]
    room = free_room(solid, bounds, forbidden)
    chosen = ends(room, craft.turn_radius_m, craft.clearance_m)
    if chosen is not None:
        return chosen
    width, height = bounds[2] - bounds[0], bounds[3] - bounds[1]
    needs = craft.clearance_m + TURNS[-1] * craft.turn_radius_m
    text = (
        f"{width:,.0f} x {height:,.0f} m, {room.free_share:.0%} free, are too small for {craft.name}: its start and "
        f"goal need {needs:,.0f} m of free room around and {LEAST_WAY * craft.turn_radius_m:,.0f} m between them, the "
        f"widest free disc has {room.widest_m:,.0f} m"
    )
    if any(each.crs is None and each.kind in SCALABLE for each in contents):
        scale = scale_that_fits(room, craft.turn_radius_m, craft.clearance_m)
        if scale is not None:
            cell = _cell_m(contents, specs) * scale
            raise WorldFileError(f"{text}; --metres-per-cell {_rounded_up(cell):g} would do")
    raise WorldFileError(
        f"{text}; another altitude, a smaller clearance or aircraft, or a larger file would do"
    )


def _cell_m(contents: Sequence[Contents], specs: Sequence[FileSpec]) -> float:
    from harness.world_files.readers.occupancy import BARN_CELL_M

    for each, spec in zip(contents, specs, strict=True):
        raster = each.occupied or each.terrain
        if raster is not None:
            return math.hypot(raster.affine[0], raster.affine[3])
        if each.kind == "gazebo_world":
            return spec.metres_per_cell or BARN_CELL_M
    return 1.0


def _rounded_up(value: float) -> float:
    """To two digits."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / step - 1e-9) * step
