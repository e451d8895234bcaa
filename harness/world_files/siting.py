"""From files alone to an area with start and goal; own metres are moved so that its south-west corner is (0, 0)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Final

import numpy as np

from harness.files.input_file import InputError
from harness.world_files.expansion import Expanded, FileFault, blaming, expanded, loaded_file, unused_keys
from harness.world_files.free_room import ROOM_RADII, WAY_RADII, FreeRoom, covered, ends, free_room
from harness.world_files.height_field import window_of
from harness.world_files.parts import WGS84, Box, Contents, FileSpec, FloatArray
from harness.world_files.plane import CIRCLE_DEG, Mapping, Place, geodetic, short_way
from harness.world_files.solids import placed_cells

ANY_PLACE: Final = Place(47.0, 8.0)  # origin of the plane for files that name no place on earth
LARGEST_RADII, LARGEST_M = 400.0, 400_000.0  # longest side of an area in turn radii, and in metres
SAME_SIDE: Final = 0.02  # tiles of terrain may leave gaps, and differ in length, by this share of a side
PAD_RADII: Final = 12.0  # an area reaches this many turn radii beyond buildings and zones, or start and goal


@dataclass(frozen=True)
class Craft:
    """The aircraft that the area must have room for: turn radius that plans may ask for, and wanted clearance."""

    name: str
    turn_radius_m: float
    clearance_m: float


@dataclass(frozen=True, eq=False)
class Site:
    """An area with a mission, start and goal (2, 2); `place` is the plane's origin, None without one on earth."""

    specs: tuple[FileSpec, ...]
    place: Place | None
    bounds_m: Box
    ends_m: FloatArray
    expanded: Expanded
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Files:
    """Files with their contents and the origin of the plane; without a `place` they keep their own metres."""

    specs: tuple[FileSpec, ...]
    contents: tuple[Contents, ...]
    place: Place | None

    def placed(self) -> list[tuple[Contents, Mapping]]:
        """Pairs each file's contents with the mapping of its coordinates to the plane."""
        each = zip(self.specs, self.contents, strict=True)
        return [(held, Mapping(held.crs, self.place or ANY_PLACE, spec.shift_m)) for spec, held in each]


def site(
    specs: Sequence[FileSpec],
    altitude_m: float,
    craft: Craft,
    given: Sequence[Sequence[float]] | None = None,
    report: Callable[[str], None] = lambda _: None,
) -> Site:
    """Chooses an area with start and goal in what some files hold, at an altitude above mean sea level.

    Of files larger than an area, other parts are tried where the first has no room for start and goal. Those that are
    given are latitude and longitude where the files have a place on earth, else x and y. A FileFault says that a file
    cannot be used, another InputError that there is no room, with the numbers and what would do.
    """
    contents = _read(specs, report)
    specs = _with_used_keys(specs, contents)
    places = None if given is None else np.array(given)
    if contents[0].crs is not None and places is not None and (np.abs(places) > (90.0, CIRCLE_DEG)).any():
        raise InputError("--start and --goal must be latitude,longitude in degrees, as 46.81,9.85")
    files = _Files(tuple(specs), contents, None if contents[0].crs is None else _origin(contents, places))
    if places is not None and files.place is not None:
        places = np.column_stack(Mapping(WGS84, files.place).to_plane(places[:, 1], places[:, 0]))
    faults: list[InputError] = []
    for area in _areas(files, craft, places):
        try:
            return _in_area(*area, altitude_m, craft, places)
        except FileFault:
            raise
        except InputError as error:
            faults.append(error)
    raise faults[0]


def _in_area(
    files: _Files, bounds: Box, notes: list[str], altitude_m: float, craft: Craft, places: FloatArray | None
) -> Site:
    """Returns a site in one area; an InputError gives the numbers that say why there is none."""
    if files.place is None:
        places = None if places is None else places - bounds[:2]
        shifts = (np.subtract(spec.shift_m, bounds[:2]).tolist() for spec in files.specs)
        moved = [replace(spec, shift_m=(x, y)) for spec, (x, y) in zip(files.specs, shifts, strict=True)]
        files = replace(files, specs=tuple(moved))
        bounds = (0.0, 0.0, bounds[2] - bounds[0], bounds[3] - bounds[1])
    # Inwards to whole metres, or to a tenth of a small area.
    step = 1.0 if min(bounds[2] - bounds[0], bounds[3] - bounds[1]) > 100 else 0.1
    low = [round(math.ceil(side / step - 1e-9) * step, 1) for side in bounds[:2]]
    high = [round(math.floor(side / step + 1e-9) * step, 1) for side in bounds[2:]]
    bounds = (*low, *high)  # type: ignore[assignment]
    found = expanded(files.specs, files.place or ANY_PLACE, bounds, altitude_m)
    if places is None:
        places, more = _ends(files, craft, bounds, found)
        notes = notes + more
    return Site(files.specs, files.place, bounds, places.round(1), found, tuple(notes))


def _read(specs: Sequence[FileSpec], report: Callable[[str], None]) -> tuple[Contents, ...]:
    """Reads the files; raises FileFault if some have a place on earth and others have none."""
    contents: list[Contents] = []
    for index, spec in enumerate(specs):
        report(f"reading {spec.path.name}")
        with blaming(index):
            contents.append(loaded_file(spec))
    if len(set(local := [each.crs is None for each in contents])) > 1:
        raise FileFault(local.index(True), "names no place on earth, another file does; give crs")
    return tuple(contents)


def _with_used_keys(specs: Sequence[FileSpec], contents: Sequence[Contents]) -> list[FileSpec]:
    """Leaves keys out of the files that do not use them; raises FileFault for a key that no file uses."""
    unused = [unused_keys(*each) for each in zip(specs, contents, strict=True)]
    for key, sentence in unused[0].items():
        if all(key in each for each in unused):
            raise FileFault(0, sentence, key)
    left_out = ({key: getattr(FileSpec, key) for key in each} for each in unused)
    return [replace(spec, **keys) for spec, keys in zip(specs, left_out, strict=True)]


def _origin(contents: Sequence[Contents], given: FloatArray | None) -> Place:
    """Returns the plane's origin: between start and goal, else in the middle of the files."""
    if given is not None:
        return _rounded_place(float(np.mean(given[:, 0])), float(np.mean(short_way(given[:, 1]))))
    found = np.hstack([np.stack(geodetic(str(each.crs), *each.corners)) for each in contents])
    latitude, longitude = found[:, np.isfinite(found).all(axis=0)]
    if not len(latitude):
        raise InputError("nothing of these files has a place on earth; their crs may be another")
    north, east = (0.5 * float(x.min() + x.max()) for x in (latitude, short_way(longitude)))
    return _rounded_place(min(max(north, -84.0), 84.0), east)


def _rounded_place(latitude_deg: float, longitude_deg: float) -> Place:
    return Place(round(latitude_deg, 5), round(math.remainder(longitude_deg, CIRCLE_DEG), 5))


def _areas(files: _Files, craft: Craft, given: FloatArray | None) -> Iterator[tuple[_Files, Box, list[str]]]:
    """Yields bounds round start and goal, else round the files; of large files the most crowded part, then others."""
    inside, around = _file_boxes(files)
    pad = PAD_RADII * craft.turn_radius_m
    if given is not None:
        reach = max(pad, 0.25 * math.dist(*given))
        bounds = _around(np.vstack((given - reach, given + reach)))
        yield files, _intersection(*inside, bounds, default=bounds), []
        return
    boxes = around or inside or [(math.nan,) * 4]  # then they lie nowhere
    low, high = np.min(boxes, axis=0)[:2] - pad, np.max(boxes, axis=0)[2:] + pad
    if (whole := _intersection(*inside, (*low.tolist(), *high.tolist()))) is None:
        raise InputError("nothing of these files lies in one area (another crs?); give --start and --goal")
    sides = np.subtract(whole[2:], whole[:2])
    half = np.minimum(sides, min(LARGEST_RADII * craft.turn_radius_m, LARGEST_M)) / 2.0
    if (2.0 * half >= sides).all():
        note = f"the area reaches {pad:,.0f} m beyond what the file holds, to leave room to turn"
        yield files, whole, [] if inside else [note]
        return
    extent = f"{sides[0] / 1e3:,.0f} x {sides[1] / 1e3:,.0f} km"
    note = f"the files reach over {extent}; the area is a part of that (--start and --goal choose another)"
    corners = [(x, y) for x in whole[::2] for y in whole[1::2]]
    for middle in (*_most_crowded(files, half), np.mean(corners, axis=0), *corners):
        x, y = np.clip(middle, whole[:2] + half, whole[2:] - half).tolist()
        at, box = files, (x - half[0], y - half[1], x + half[0], y + half[1])
        if files.place is not None:  # with its origin in its middle, about which the plane is true to scale
            longitude, latitude = Mapping(WGS84, files.place).from_plane(np.array([x]), np.array([y]), 0.0)
            at = replace(files, place=_rounded_place(float(latitude[0]), float(longitude[0])))
            box = (*(-half).tolist(), *half.tolist())
            box = _intersection(box, *_file_boxes(at)[0], default=box)
        yield at, box, [note]


def _most_crowded(files: _Files, half: FloatArray) -> list[FloatArray]:
    """Returns the mean of the obstacles' box corners in the part with the most of them; nothing for rasters alone."""
    places = np.hstack([at.to_plane(*replace(each, raster=None).corners) for each, at in files.placed()]).T
    if not len(places := places[np.isfinite(places).all(axis=1)]):
        return []
    parts = np.floor((places - places.min(axis=0)) / (2.0 * half))
    _, part, count = np.unique(parts, axis=0, return_inverse=True, return_counts=True)
    return [places[part.ravel() == count.argmax()].mean(axis=0)]


def _file_boxes(files: _Files) -> tuple[list[Box], list[Box]]:
    """Returns boxes of files that bound the area (rasters, tiles together; keep-in fences), and of all other files."""
    tiles, inside, around = list[Box](), list[Box](), list[Box]()
    for each, at in files.placed():
        places = np.column_stack(at.to_plane(*(replace(each, parts=()) if each.raster else each).corners))
        if len(known := places[np.isfinite(places).all(axis=1)]):
            bound = each.raster is not None or any(part.keep_in for part in each.parts)
            boxes = tiles if each.terrain is not None else inside if bound else around
            boxes.append(_upright(known) if each.raster and len(known) == 4 else _around(known))
    return [box for box in inside + _join_boxes(tiles) if box[2] - box[0] > 1e-6], around


def _upright(corners: FloatArray) -> Box:
    """Returns the largest upright rectangle about the middle of a raster, which may lie turned."""
    middle, sides = corners.mean(axis=0), np.roll(corners, -1, axis=0) - corners
    reach = np.abs(np.linalg.det(np.stack((sides, corners - middle), axis=1)))
    half = np.vstack((np.ptp(corners, axis=0), [(1.0, 1.003**k) for k in range(-1500, 1501)]))
    half *= (reach / np.maximum(half @ np.abs(sides[:, ::-1]).T, 1e-9)).min(axis=1)[:, None]  # up to a side
    return _around(middle + [[-1.0], [1.0]] * half[half.prod(axis=1).argmax()])


def _around(places: FloatArray) -> Box:
    """Returns the box round places, (n, 2)."""
    return (*places.min(axis=0).tolist(), *places.max(axis=0).tolist())


def _join_boxes(boxes: list[Box]) -> list[Box]:
    """Joins boxes that lie side by side and are about as long there."""
    for one, other in combinations(boxes, 2):
        both = np.reshape((one, other), (2, 2, 2))  # box, end, axis
        low, high = both[:, 0].max(axis=0), both[:, 1].min(axis=0)  # of what both have
        as_long = high - low > (1.0 - SAME_SIDE) * (both[:, 1] - both[:, 0]).max(axis=0)
        for k in np.flatnonzero(as_long[::-1] & (low - high < SAME_SIDE * (high - low)[::-1])):
            low[k], high[k] = both[:, 0, k].min(), both[:, 1, k].max()
            return _join_boxes([*(box for box in boxes if box not in (one, other)), (*low.tolist(), *high.tolist())])
    return boxes


def _intersection(*boxes: Box, default: Any = None) -> Any:
    """Returns the intersection of boxes, or the default where it is empty, or narrower than can be rounded."""
    (xmin, ymin), (xmax, ymax) = np.max(boxes, axis=0)[:2].tolist(), np.min(boxes, axis=0)[2:].tolist()
    return (xmin, ymin, xmax, ymax) if xmax - xmin > 0.2 and ymax - ymin > 0.2 else default


def _ends(files: _Files, craft: Craft, bounds: Box, found: Expanded) -> tuple[FloatArray, list[str]]:
    """Chooses start and goal in free room, with notes on the way; an InputError gives the numbers where it cannot."""
    solid = [each for source in found.sources for each in source.polygons]
    for each, mapping in files.placed():
        if each.raster is not None and each.raster.occupancy:  # what is not known is no place for a start
            near = each.raster.window(*window_of(each.raster, mapping, bounds))
            solid += placed_cells(near, np.isnan(near.values), mapping)
    room = free_room(solid, bounds)
    turn_m, clearance_m = craft.turn_radius_m, craft.clearance_m
    if (chosen := ends(room, turn_m, clearance_m, turning=True)) is not None:
        return chosen, []
    cell = f"--metres-per-cell {cell_m:g}" if (cell_m := _cell_that_fits(files, craft, room)) else ""
    if (chosen := ends(room, turn_m, clearance_m, turning=False)) is not None:
        width_m = 2.0 * (clearance_m + turn_m)
        note = f"every way from start to goal is somewhere narrower than {width_m:,.0f} m, where {craft.name}"
        note += " cannot turn round: the goal may be proved unreachable"
        return chosen, [note + (f"; with {cell} it can" if cell else "")]
    would = cell or "--start and --goal, another altitude, a smaller clearance or aircraft, or a larger file"
    raise InputError(
        f"{bounds[2] - bounds[0]:,.0f} x {bounds[3] - bounds[1]:,.0f} m, {1.0 - covered(solid, bounds):.0%} free, "
        f"are too small for {craft.name}: its start and goal need {clearance_m + ROOM_RADII[-1] * turn_m:,.0f} m of "
        f"free room around and {WAY_RADII * turn_m:,.0f} m between them, the widest free disc has "
        f"{room.room_m.max():,.0f} m; {would} would do"
    )


def _cell_that_fits(files: _Files, craft: Craft, room: FreeRoom) -> float | None:
    """Returns the side (m) of a cell with which the aircraft has room; None where the files give their scale."""
    rasters = [each.raster for each in files.contents if each.crs is None and each.raster is not None]
    for scale in 1.1 ** np.arange(1.0, 120.0) if rasters else ():
        if ends(room, craft.turn_radius_m / scale, craft.clearance_m / scale, turning=True) is not None:
            cell_m = math.hypot(rasters[0].affine[0], rasters[0].affine[3]) * float(scale)
            step = 10.0 ** (math.floor(math.log10(cell_m)) - 1)
            return math.ceil(cell_m / step - 1e-9) * step
    return None
