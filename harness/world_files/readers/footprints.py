"""Footprints on the ellipsoid: circles, arcs, corridors; and what makes footprints of a file valid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final

import numpy as np
import shapely
from pyproj import Geod

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.world_files.parts import Contents, FloatArray
from harness.world_files.plane import CIRCLE_DEG, in_degrees

CIRCLE_POINTS: Final = 96  # corners of the polygon round a circle, whose area is 0.04 % larger
LARGEST_M: Final = 2_000_000.0  # a circle with a larger radius is refused
DEGREE_M: Final = 110_400.0  # no degree of latitude is shorter, less what a round end of 64 corners cuts off
STEP_DEG: Final = 0.1  # pieces of a corridor are this long, none too narrow at any place
EDGE_DEG, EDGE_M, MOST_EDGES = 0.03, 3000.0, 1e4  # edges straight in their crs get points so close

GEOD: Final = Geod(ellps="WGS84")
Place = tuple[float, float]  # longitude and latitude, degrees


def finished(contents: Contents) -> Contents:
    """Makes footprints valid and take the short way round the earth; drops what has no area, and counts whose it is."""
    if contents.raster is not None:
        return contents
    shapes = np.array([part.footprint for part in contents.parts], dtype=object)
    bounds = shapely.bounds(shapes)
    if in_degrees(contents.crs):
        if (off := (np.abs(bounds) > (CIRCLE_DEG, 90.0, CIRCLE_DEG, 90.0)).any(axis=1)).any():
            x, y = np.abs(bounds[off.argmax()]).reshape(2, 2).max(axis=0)
            remedy = ", or give crs" if contents.kind in ("geojson", "cityjson") else ""
            raise InputError(f"has {x:g}, {y:g} for a longitude and a latitude; must be degrees{remedy}")
        wide = bounds[:, 2] - bounds[:, 0] > CIRCLE_DEG / 2
        turned = shapely.transform(shapes[wide], lambda p: np.column_stack((p[:, 0] % CIRCLE_DEG, p[:, 1])))
        west, _, east, _ = shapely.bounds(turned).T
        narrower = (east - west < CIRCLE_DEG / 2) & (shapely.area(turned) > 0.0)
        shapes[wide] = np.where(narrower, turned, shapes[wide])
    if not np.isfinite(bounds[~shapely.is_empty(shapes)]).all():
        raise InputError("has a position that is not finite")
    bad = np.flatnonzero(~shapely.is_valid(shapes))
    outlines, of = shapely.get_parts(shapes[bad], return_index=True)
    shapes[bad] = shapely.make_valid(shapes[bad], method="structure", keep_collapsed=False)
    corners = shapely.extract_unique_points(shapely.get_exterior_ring(outlines))
    lost = bad[of[~shapely.covers(shapes[bad[of]], corners)]]
    flat = np.union1d(lost, np.flatnonzero(shapely.area(shapes) == 0.0))
    if contents.kind in ("geojson", "ed269", "ed318"):
        longest = EDGE_DEG if in_degrees(contents.crs) else EDGE_M
        shapes = shapely.segmentize(shapes, np.maximum(longest, shapely.length(shapes) / MOST_EDGES))
    sound = zip(contents.parts, shapes, strict=True)
    parts = tuple(replace(part, footprint=shape) for part, shape in sound if shape.area > 0.0)
    if not parts:
        raise InputError("has no polygon with an area; must have some")
    passed = [f"of {counted(len(flat), 'polygon')} what has no area is passed over"] if len(flat) else []
    return replace(contents, parts=parts, notes=(*contents.notes, *passed))


def circle(center: Place, radius_m: float) -> Any:
    """Returns a polygon round a circle on the ellipsoid."""
    if not 0.0 < radius_m <= LARGEST_M:
        raise InputError(f"has a circle of radius {radius_m:g} m; must be above 0 and at most {LARGEST_M:g}")
    away_m = radius_m / math.cos(math.pi / CIRCLE_POINTS)
    azimuths = np.arange(0.0, CIRCLE_DEG, CIRCLE_DEG / CIRCLE_POINTS)
    return shapely.Polygon(_places_at(center, azimuths, np.full(CIRCLE_POINTS, away_m)))


def _places_at(center: Place, azimuth_deg: FloatArray, distance_m: FloatArray) -> list[Place]:
    east, north = (np.full(len(azimuth_deg), each) for each in center)
    longitude, latitude, _ = GEOD.fwd(east, north, azimuth_deg, distance_m)
    return list(zip(longitude.tolist(), latitude.tolist(), strict=True))


def arc(center: Place, from_deg: float, to_deg: float, distance_m: tuple[float, float], clockwise: bool) -> list[Place]:
    """Returns places along an arc between two azimuths, one a degree; the distance goes evenly from first to second."""
    sweep = (to_deg - from_deg) % CIRCLE_DEG if clockwise else -((from_deg - to_deg) % CIRCLE_DEG)
    count = max(int(abs(sweep)), 1) + 1
    return _places_at(center, from_deg + np.linspace(0.0, sweep, count), np.linspace(*distance_m, count))


def corridor(line: Sequence[Place], width_m: float) -> Any:
    """Returns the polygon of all places within half of `width_m` of a line that is straight in degrees."""
    # The short way from the first place of the line.
    places = [(line[0][0] + math.remainder(x - line[0][0], CIRCLE_DEG), y) for x, y in line]
    pieces = []
    for ends in pairwise(shapely.segmentize(shapely.LineString(places), STEP_DEG).coords):
        shrink = np.array((math.cos(math.radians(max(abs(y) for _, y in ends))), 1.0))  # nowhere too narrow
        piece = shapely.LineString(np.array(ends) * shrink).buffer(width_m / 2.0 / DEGREE_M, quad_segs=16)
        pieces.append(shapely.set_coordinates(piece, shapely.get_coordinates(piece) / shrink))
    return shapely.union_all(pieces)


def on_earth(longitude: float, latitude: float) -> Place:
    """Returns the place; raises InputError if it is not on earth."""
    if not (abs(longitude) <= CIRCLE_DEG and abs(latitude) <= 90.0):
        raise InputError(f"has a place at {latitude:g}, {longitude:g}; must be degrees, WGS84")
    return longitude, latitude
