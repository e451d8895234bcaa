"""The area of a world made from files: where its plane touches the earth, and which part of large files it takes.

Frame: local ENU plane about the origin that is chosen, metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from harness.world_files.expansion import corners_of
from harness.world_files.parts import WGS84, Contents, Datum, FloatArray, Part, WorldFileError
from harness.world_files.plane import TURN_DEG, Mapping, Place, geodetic, short_way
from harness.world_files.slicing import Box

LARGEST_TURNS, LARGEST_M = 400.0, 400_000.0
"""Longest side of an area, in turn radii and in metres: of larger files a part is taken."""
PAD_TURNS: Final = 12.0
"""The area reaches so many turn radii beyond buildings and zones: they leave room around them."""
FAR_M: Final = 50_000.0
"""An area whose middle lies farther from the origin gets an origin of its own: the plane is true to scale near it."""
TRIES: Final = 6
"""Parts of a large file that are tried before there is said to be no room."""


@dataclass(frozen=True)
class PlaneArea:
    """A part of the plane.

    Attributes:
        bounds_m: xmin, ymin, xmax, ymax.
        notes: what is to be said of it.
    """

    bounds_m: Box
    notes: tuple[str, ...]


Ends = tuple[tuple[float, float], tuple[float, float]]
"""Start and goal."""


def middle_of(contents: Sequence[Contents], given: Ends | None) -> Place:
    """Origin: between start and goal, else in the middle of what the files hold."""
    if given is not None:
        latitude, longitude = np.array(given).T
        east = float(np.mean(short_way(longitude)))
        return Place(round(float(np.mean(latitude)), 5), round(math.remainder(east, TURN_DEG), 5))
    latitudes, longitudes = [], []
    for each in contents:
        latitude, longitude = geodetic(str(each.crs), *corners_of(each))
        latitudes.append(latitude[np.isfinite(latitude)])
        longitudes.append(longitude[np.isfinite(latitude)])
    latitude, longitude = np.concatenate(latitudes), short_way(np.concatenate(longitudes))
    if not len(latitude):
        raise WorldFileError("nothing of these files has a place on earth; their crs may be another")
    middle = [0.5 * float(each.min() + each.max()) for each in (latitude, longitude)]
    if max(np.ptp(latitude), np.ptp(longitude)) > 5.0:  # a country: where most of it is
        middle = [float(np.median(each)) for each in (latitude, longitude)]
    return Place(round(min(max(middle[0], -84.0), 84.0), 5), round(math.remainder(middle[1], TURN_DEG), 5))


def center_of(box: Box) -> tuple[float, float]:
    """East and north of the middle of a box."""
    return (box[0] + box[2]) / 2, (box[1] + box[3]) / 2


def moved(place: Place, to_m: tuple[float, float]) -> Place:
    """The place of a point of the plane about another place."""
    longitude, latitude = Mapping(WGS84, place).from_plane(np.array([to_m[0]]), np.array([to_m[1]]))
    return Place(round(float(latitude[0]), 5), round(float(longitude[0]), 5))


def about_origin(bounds: Box, contents: Sequence[Contents], mappings: Sequence[Mapping]) -> Box:
    """An area of the same size about the origin, no larger than the rasters and fences there."""
    half = (bounds[2] - bounds[0]) / 2, (bounds[3] - bounds[1]) / 2
    boxes: list[Box] = [(-half[0], -half[1], half[0], half[1])]
    boxes += _boxes(contents, mappings)[0]
    return _common(boxes) or boxes[0]


def area_about(
    chosen: Ends | None, contents: Sequence[Contents], mappings: Sequence[Mapping], turn_radius_m: float
) -> PlaneArea:
    """The area about a start and a goal that are given, within rasters and fences."""
    assert chosen is not None
    rasters, vectors = _boxes(contents, mappings)
    _whole(rasters, vectors, 0.0)
    (x0, y0), (x1, y1) = chosen
    reach = max(PAD_TURNS * turn_radius_m, 0.25 * math.dist(*chosen))
    box = (min(x0, x1) - reach, min(y0, y1) - reach, max(x0, x1) + reach, max(y0, y1) + reach)
    if rasters:
        box = _common([*rasters, box]) or box
    return PlaneArea(box, ())


def areas_of(
    contents: Sequence[Contents], mappings: Sequence[Mapping], altitude_m: float, turn_radius_m: float
) -> list[PlaneArea]:
    """The area that some files cover; or of large ones several parts, the most crowded first, the corners last.

    Raises:
        WorldFileError: the files have nothing in common.
    """
    pad = PAD_TURNS * turn_radius_m
    rasters, vectors = _boxes(contents, mappings)
    whole = _whole(rasters, vectors, pad)
    notes: tuple[str, ...] = ()
    if vectors and not rasters:
        notes = (f"the area reaches {pad:,.0f} m beyond what the file holds, to leave room to turn",)
    largest = min(LARGEST_TURNS * turn_radius_m, LARGEST_M)
    sides = whole[2] - whole[0], whole[3] - whole[1]
    if max(sides) <= largest:
        return [PlaneArea(whole, notes)]
    notes = (
        f"the files reach over {sides[0] / 1e3:,.0f} x {sides[1] / 1e3:,.0f} km; the area is a part of that",
    )
    half = [min(side, largest) / 2 for side in sides]
    areas = []
    foci = _foci(contents, mappings, whole, altitude_m, largest)
    if not rasters:  # a zone larger than the area leaves room at the corners of what is about it
        foci += [(whole[i], whole[j]) for i in (0, 2) for j in (1, 3)]
    for x, y in foci:
        x, y = (min(max(v, whole[k] + half[k]), whole[k + 2] - half[k]) for k, v in enumerate((x, y)))
        areas.append(PlaneArea((x - half[0], y - half[1], x + half[0], y + half[1]), notes))
    return areas


def _boxes(contents: Sequence[Contents], mappings: Sequence[Mapping]) -> tuple[list[Box], list[Box]]:
    """What the files cover: rasters and fences to stay inside of, and all others."""
    rasters: list[Box] = []
    vectors: list[Box] = []
    for each, mapping in zip(contents, mappings, strict=True):
        box, is_raster = _extent(each, mapping)
        if box is not None:
            (rasters if is_raster else vectors).append(box)
    return rasters, vectors


def _whole(rasters: Sequence[Box], vectors: Sequence[Box], pad_m: float) -> Box:
    """What lies in all rasters, and about the rest."""
    boxes = list(rasters)
    if vectors:
        around = _joined(vectors)
        boxes.append((around[0] - pad_m, around[1] - pad_m, around[2] + pad_m, around[3] + pad_m))
    whole = _common(boxes)
    if whole is None:
        raise WorldFileError("nothing of these files lies in one area; must overlap")
    return whole


def _extent(contents: Contents, mapping: Mapping) -> tuple[Box | None, bool]:
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
    return box, any(part.keep_in for part in contents.parts)


def _common(boxes: Sequence[Box]) -> Box | None:
    """What lies in all boxes; None where nothing does."""
    if not boxes:
        return None
    box = tuple(f(each[k] for each in boxes) for k, f in enumerate((max, max, min, min)))
    return box if box[0] < box[2] and box[1] < box[3] else None  # type: ignore[return-value]


def _joined(boxes: Sequence[Box]) -> Box:
    return tuple(f(each[k] for each in boxes) for k, f in enumerate((min, min, max, max)))  # type: ignore[return-value]


def _foci(
    contents: Sequence[Contents], mappings: Sequence[Mapping], whole: Box, altitude_m: float, side_m: float
) -> list[tuple[float, float]]:
    """Where in a large area to look: at parts with most others near them, half a side apart; else in the middle."""
    import shapely

    middles: list[FloatArray] = [np.zeros((0, 2))]
    for each, mapping in zip(contents, mappings, strict=True):
        solid = [part.footprint for part in each.parts if _may_be_solid(part, altitude_m)]
        if solid:
            points = shapely.get_coordinates(shapely.centroid(np.array(solid, dtype=object)))
            middles.append(np.column_stack(mapping.to_plane(points[:, 0], points[:, 1])))
    places = np.concatenate(middles)
    inside = ((places >= whole[:2]) & (places <= whole[2:])).all(axis=1) & np.isfinite(places).all(axis=1)
    places = places[inside]
    some = places[:: max(len(places) // 2000, 1)]
    near = np.array([(np.abs(places - each).max(axis=1) <= side_m / 3).sum() for each in some])
    found: list[tuple[float, float]] = []
    for index in np.argsort(-near, kind="stable").tolist():
        x, y = some[index].tolist()
        if len(found) < TRIES and all(max(abs(x - u), abs(y - v)) > side_m / 2 for u, v in found):
            found.append((x, y))
    return found or [center_of(whole)]


def _may_be_solid(part: Part, altitude_m: float) -> bool:
    """Whether a part may reach to an altitude, as far as that is told without the ground."""
    low, high = part.bottom, part.top
    return (low.datum is Datum.GROUND or low.height_m <= altitude_m) and (
        high.datum is Datum.GROUND or high.height_m >= altitude_m
    )


def whole_metres(box: Box) -> Box:
    """Inwards to whole metres, or to a tenth of a small one."""
    step = 1.0 if min(box[2] - box[0], box[3] - box[1]) > 100 else 0.1
    low = [round(math.ceil(each / step - 1e-9) * step, 1) for each in box[:2]]
    high = [round(math.floor(each / step + 1e-9) * step, 1) for each in box[2:]]
    return low[0], low[1], high[0], high[1]
