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
"""The area reaches so many turn radii beyond buildings and zones, which leaves room around them."""
FAR_M: Final = 50_000.0
"""An area whose middle lies farther from the origin gets an origin of its own: the plane is true to scale near it."""
TRIES: Final = 6
"""Parts of a large file that are tried before there is said to be no room."""
COUNTRY_DEG: Final = 5.0
"""Of files that span more, the origin lies where most of them is."""

Ends = tuple[tuple[float, float], tuple[float, float]]
"""Start and goal."""


@dataclass(frozen=True)
class Covered:
    """What some files cover in a plane.

    Attributes:
        inside: boxes of rasters and of fences to stay inside of: nothing is known or free beyond.
        around: boxes of all others.
    """

    inside: tuple[Box, ...]
    around: tuple[Box, ...]

    @classmethod
    def by(cls, contents: Sequence[Contents], mappings: Sequence[Mapping]) -> Covered:
        """What files cover; one of which nothing has a place is left out."""
        inside: list[Box] = []
        around: list[Box] = []
        for each, mapping in zip(contents, mappings, strict=True):
            raster = each.terrain or each.occupied
            corners = corners_of(each if raster is None else replace(each, parts=()))
            east, north = mapping.to_plane(*corners)
            known = np.isfinite(east) & np.isfinite(north)
            x, y = (np.sort(side[known]) for side in (east, north))
            if not len(x):
                continue
            # Of a raster the largest upright rectangle within its four corners, which may lie askew.
            first, last = (1, 2) if raster is not None else (0, -1)
            box = (float(x[first]), float(y[first]), float(x[last]), float(y[last]))
            fenced = any(part.keep_in for part in each.parts)
            (inside if raster is not None or fenced else around).append(box)
        return cls(tuple(inside), tuple(around))

    def whole(self, pad_m: float) -> Box:
        """What lies in all rasters and fences, and about the rest.

        Raises:
            WorldFileError: that is nothing.
        """
        boxes = list(self.inside)
        if self.around:
            low, high = np.min(self.around, axis=0), np.max(self.around, axis=0)
            boxes.append((*(low[:2] - pad_m).tolist(), *(high[2:] + pad_m).tolist()))
        box = common(boxes)
        if box is None:
            raise WorldFileError("nothing of these files lies in one area; must overlap")
        return box


def common(boxes: Sequence[Box]) -> Box | None:
    """What lies in all of some boxes; None where nothing does."""
    if not boxes:
        return None
    xmin, ymin = np.max(boxes, axis=0)[:2].tolist()
    xmax, ymax = np.min(boxes, axis=0)[2:].tolist()
    return (xmin, ymin, xmax, ymax) if xmin < xmax and ymin < ymax else None


def middle_of(contents: Sequence[Contents], given: Ends | None) -> Place:
    """Origin: between start and goal, else in the middle of what the files hold."""
    if given is not None:
        latitude, longitude = np.array(given).T
        return _place(float(np.mean(latitude)), float(np.mean(short_way(longitude))))
    found = np.hstack([np.stack(geodetic(str(each.crs), *corners_of(each))) for each in contents])
    latitude, longitude = found[:, np.isfinite(found).all(axis=0)]
    if not len(latitude):
        raise WorldFileError("nothing of these files has a place on earth; their crs may be another")
    degrees = latitude, short_way(longitude)
    middle = [0.5 * float(each.min() + each.max()) for each in degrees]
    if max(map(np.ptp, degrees)) > COUNTRY_DEG:
        middle = [float(np.median(each)) for each in degrees]
    return _place(min(max(middle[0], -84.0), 84.0), middle[1])


def _place(latitude_deg: float, longitude_deg: float) -> Place:
    return Place(round(latitude_deg, 5), round(math.remainder(longitude_deg, TURN_DEG), 5))


def moved(place: Place, to_m: tuple[float, float]) -> Place:
    """The place of a point of the plane about another place."""
    longitude, latitude = Mapping(WGS84, place).from_plane(np.array([to_m[0]]), np.array([to_m[1]]))
    return _place(float(latitude[0]), float(longitude[0]))


def center_of(box: Box) -> tuple[float, float]:
    """East and north of the middle of a box."""
    return (box[0] + box[2]) / 2, (box[1] + box[3]) / 2


def area_about(ends: Ends, covered: Covered, turn_radius_m: float) -> Box:
    """The area about a start and a goal that are given, within rasters and fences."""
    covered.whole(0.0)
    reach = max(PAD_TURNS * turn_radius_m, 0.25 * math.dist(*ends))
    low, high = np.min(ends, axis=0) - reach, np.max(ends, axis=0) + reach
    box: Box = (*low.tolist(), *high.tolist())
    return (common([*covered.inside, box]) if covered.inside else None) or box


def areas_of(
    covered: Covered,
    contents: Sequence[Contents],
    mappings: Sequence[Mapping],
    altitude_m: float,
    turn_radius_m: float,
) -> tuple[list[Box], tuple[str, ...]]:
    """The area that some files cover; or of large ones several parts, the most crowded first, the corners last.

    Returns:
        The areas, and what is to be said of them.

    Raises:
        WorldFileError: the files have nothing in common.
    """
    pad = PAD_TURNS * turn_radius_m
    whole = covered.whole(pad)
    sides, largest = (whole[2] - whole[0], whole[3] - whole[1]), min(LARGEST_TURNS * turn_radius_m, LARGEST_M)
    if max(sides) <= largest:
        told = f"the area reaches {pad:,.0f} m beyond what the file holds, to leave room to turn"
        return [whole], () if covered.inside else (told,)
    foci = _foci(contents, mappings, whole, altitude_m, largest)
    if not covered.inside:  # a zone larger than the area leaves room at the corners of what is about it
        foci += [(whole[i], whole[j]) for i in (0, 2) for j in (1, 3)]
    half = [min(side, largest) / 2 for side in sides]
    areas: list[Box] = []
    for focus in foci:
        x, y = (min(max(v, whole[k] + half[k]), whole[k + 2] - half[k]) for k, v in enumerate(focus))
        areas.append((x - half[0], y - half[1], x + half[0], y + half[1]))
    told = (
        f"the files reach over {sides[0] / 1e3:,.0f} x {sides[1] / 1e3:,.0f} km; the area is a part of that"
    )
    return areas, (told,)


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
    places = places[((places >= whole[:2]) & (places <= whole[2:])).all(axis=1)]
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
