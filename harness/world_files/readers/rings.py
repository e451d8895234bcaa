"""Footprints on the ellipsoid: rings of longitude and latitude, circles, arcs, corridors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import Any, Final

import numpy as np

from harness.world_files.parts import FloatArray, WorldFileError
from harness.world_files.plane import TURN_DEG, short_way

NAUTICAL_MILE_M: Final = 1852.0
CIRCLE_POINTS: Final = 96
"""Corners of a circle; it lies inside of their polygon, whose area is 0.04 % larger."""
ARC_STEP_DEG: Final = 1.0
LARGEST_M: Final = 2_000_000.0
HALF_TURN_DEG: Final = TURN_DEG / 2

Place = tuple[float, float]
"""Longitude and latitude, degrees."""


def circle(center: Place, radius_m: float) -> Any:
    """A polygon round a circle on the ellipsoid."""
    import shapely

    if not 0.0 < radius_m <= LARGEST_M:
        raise WorldFileError(
            f"has a circle of radius {radius_m:g} m; must be positive and at most {LARGEST_M:g} m"
        )
    azimuths = np.arange(0.0, 360.0, 360.0 / CIRCLE_POINTS)
    return shapely.Polygon(short_ring(around(center, azimuths, radius_m / math.cos(math.pi / CIRCLE_POINTS))))


def short_ring(places: Sequence[Place] | FloatArray, about_deg: float | None = None) -> FloatArray:
    """A ring of longitude and latitude that goes the short way round the earth.

    Args:
        places: (k, 2) of the ring.
        about_deg: its longitudes are given by the turn that is nearest to this one, if given.
    """
    points = np.array(places, dtype=np.float64)
    if np.ptp(points[:, 0]) > HALF_TURN_DEG:
        points[:, 0] = short_way(points[:, 0])
    if about_deg is not None:
        middle = 0.5 * float(points[:, 0].min() + points[:, 0].max())
        points[:, 0] += TURN_DEG * round((about_deg - middle) / TURN_DEG)
    return points


def around(center: Place, azimuth_deg: FloatArray, distance_m: float | FloatArray) -> list[Place]:
    """Places at azimuths and distances from another."""
    east, north = np.full(len(azimuth_deg), center[0]), np.full(len(azimuth_deg), center[1])
    longitude, latitude, _ = _geod().fwd(
        east, north, azimuth_deg, np.broadcast_to(distance_m, azimuth_deg.shape)
    )
    return list(zip(longitude.tolist(), latitude.tolist(), strict=True))


def arc(
    center: Place, from_deg: float, to_deg: float, distance_m: tuple[float, float], clockwise: bool
) -> list[Place]:
    """Places along an arc between two azimuths; the distance goes evenly from the first to the second."""
    sweep = (to_deg - from_deg) % 360.0 if clockwise else -((from_deg - to_deg) % 360.0)
    count = max(int(abs(sweep) / ARC_STEP_DEG), 1) + 1
    return around(center, from_deg + np.linspace(0.0, sweep, count), np.linspace(*distance_m, count))


def polar(center: Place, place: Place) -> tuple[float, float]:
    """Azimuth (deg) and distance (m) of a place from another."""
    azimuth, _, distance = _geod().inv(center[0], center[1], place[0], place[1])
    return float(azimuth), float(distance)


def corridor(line: Sequence[Place], width_m: float) -> Any:
    """All that lies within half a width of a line."""
    import shapely

    latitude = line[0][1]
    stretch = math.cos(math.radians(latitude))
    plane = shapely.LineString([((x - line[0][0]) * stretch, y - latitude) for x, y in short_ring(line)])
    grown = plane.buffer(width_m / 2.0 / 111_200.0, quad_segs=16)
    return shapely.transform(
        grown, lambda p: np.column_stack((p[:, 0] / stretch + line[0][0], p[:, 1] + latitude))
    )


def ring(places: Sequence[Place]) -> Any:
    """The area inside a ring, closed or not; None where it encloses none."""
    import shapely

    if len(set(places)) < 3:
        return None
    shape = shapely.make_valid(shapely.Polygon(short_ring(places)), method="structure", keep_collapsed=False)
    return None if shape.is_empty or shape.area == 0.0 else shape


def shapes_of(batch: Sequence[Sequence[Sequence[FloatArray]]], degrees: bool = False) -> list[Any]:
    """Shapes of many parts at once: each is some polygons, each polygon its outline and then its holes.

    Args:
        batch: (k, 2) places of each ring, closed or not; rings with fewer than three places are left out.
        degrees: they are longitude and latitude: rings go the short way, and those of a part lie together.

    Returns:
        A valid shapely geometry for each part, None where it has no area.

    Raises:
        WorldFileError: one is of degrees, and has places that are none.
    """
    import shapely

    polygons = [
        (part, kept)
        for part, several in enumerate(batch)
        for rings in several
        if (kept := [ring for ring in rings if len(ring) >= 3]) and len(rings[0]) >= 3
    ]
    found: list[Any] = [None] * len(batch)
    if not polygons:
        return found
    if degrees:
        flat = [ring for _, kept in polygons for ring in kept]
        _check_degrees(flat)
        first = {part: float(kept[0][0][0]) for part, kept in reversed(polygons)}
        apart = iter(_apart(flat, [first[part] for part, kept in polygons for _ in kept]))
        polygons = [
            (part, [short_ring(ring, first[part]) if next(apart) else ring for ring in kept])
            for part, kept in polygons
        ]
    every = [ring for _, rings in polygons for ring in rings]
    lines = shapely.linearrings(
        np.concatenate(every), indices=np.repeat(np.arange(len(every)), [len(r) for r in every])
    )
    counts = [len(rings) for _, rings in polygons]
    shapes = shapely.polygons(lines, indices=np.repeat(np.arange(len(polygons)), counts))
    bad = ~shapely.is_valid(shapes)
    shapes[bad] = shapely.make_valid(shapes[bad], method="structure", keep_collapsed=False)
    several: dict[int, list[Any]] = {}
    for (part, _), shape, area in zip(polygons, shapes, shapely.area(shapes).tolist(), strict=True):
        if area > 0.0:
            several.setdefault(part, []).append(shape)
    for part, pieces in several.items():
        if len(pieces) > 1:  # floor and roof of a block are the same
            pieces = list(dict(zip(shapely.to_wkb(shapely.normalize(pieces)), pieces, strict=True)).values())
        found[part] = pieces[0] if len(pieces) == 1 else shapely.union_all(pieces)
    return found


def _check_degrees(every: Sequence[FloatArray]) -> None:
    """Raises WorldFileError if a ring of longitude and latitude has a place that is not on earth."""
    highest = np.abs(np.concatenate(every)).max(axis=0)
    if highest[0] <= TURN_DEG and highest[1] <= 0.25 * TURN_DEG:
        return
    for ring in every:
        x, y = ring[np.abs(ring).argmax(axis=0), (0, 1)].tolist()
        if abs(x) > TURN_DEG or abs(y) > 0.25 * TURN_DEG:
            raise WorldFileError(
                f"has {x:g}, {y:g} for a longitude and a latitude; must be degrees, or give crs, as EPSG:32632"
            )


def _apart(every: Sequence[FloatArray], about_deg: Sequence[float]) -> list[bool]:
    """Of each ring whether it reaches farther than half a turn from its longitude."""
    counts = [len(ring) for ring in every]
    off_deg = np.abs(np.concatenate(every)[:, 0] - np.repeat(about_deg, counts))
    apart: list[bool] = (np.maximum.reduceat(off_deg, np.cumsum([0, *counts[:-1]])) > HALF_TURN_DEG).tolist()
    return apart


def together(shape: Any) -> Any:
    """A shape of longitude and latitude, its pieces at both ends of the map put together."""
    import shapely

    if shape is None or not shape.bounds[2] - shape.bounds[0] > HALF_TURN_DEG:
        return shape
    west = [each.bounds for each in shapely.get_parts(shape)]
    if any(bounds[2] - bounds[0] > HALF_TURN_DEG for bounds in west):
        return shape
    return shapely.transform(
        shape, lambda p: np.column_stack((np.where(p[:, 0] < 0.0, p[:, 0] + TURN_DEG, p[:, 0]), p[:, 1]))
    )


def on_earth(longitude: float, latitude: float) -> Place:
    """The place, if it is one.

    Raises:
        WorldFileError: it is not on earth.
    """
    if not (abs(longitude) <= 360.0 and abs(latitude) <= 90.0):
        raise WorldFileError(
            f"has a place at latitude {latitude:g}, longitude {longitude:g}; must be degrees, WGS84"
        )
    return longitude, latitude


@cache
def _geod() -> Any:
    from pyproj import Geod

    return Geod(ellps="WGS84")
