"""Where rays of a range sensor end among the faces of the true world.

Frame: local ENU plane, x = east, y = north, metres. Bearings are radians clockwise from north. Whether and
where a ray hits is decided by correctly rounded operations on that ray and that face alone; bearings of faces
only choose which rays are tried, with a margin. So a face that is not hit cannot change any range.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from harness.world.obstacle import LEAST_M2
from harness.world.world import Faces
from planner.compiled import COUNT, FLOAT, FLOATS, FLOATS_OUT, compiled
from planner.interface import ComplexArray, FloatArray

FACES = "Array(float64, 2, 'A', readonly=True)"

# Rays tried beyond the bearings of a face, in rays: more than bearings err, even at a tangent (1.5e-8 rad).
_MARGIN_RAYS = 1e-3


class Fan:
    """Rays spread evenly about the nose.

    Args:
        field_rad: bearings that they cover.
        rays: how many.
        range_m: nothing is met beyond it.
    """

    def __init__(self, field_rad: float, rays: int, range_m: float) -> None:
        self.spacing_rad = field_rad / rays
        """Bearing of each ray less that of the one before."""
        self.first_rad = 0.5 * self.spacing_rad - field_rad / 2
        """Bearing of ray 0 from the nose."""
        self._range_m = range_m
        offsets = self.first_rad + self.spacing_rad * np.arange(rays)
        self._fan = np.array((np.sin(offsets), np.cos(offsets)))  # seen from the nose: to its right, ahead
        self._fan_right, self._fan_ahead = self._fan
        self.rays: ComplexArray = self._fan_right + 1j * self._fan_ahead
        """(n,) unit vectors of the rays as the nose sees them, to its right + i ahead."""
        self.rays.setflags(write=False)
        self.nothing = np.full(rays, math.inf)
        """(n,) ranges where nothing is met."""
        self.nothing.setflags(write=False)

    def ranges_m(self, faces: Faces, east: float, north: float, heading_rad: float) -> FloatArray:
        """(n,) ranges to the nearest face, +inf beyond the range."""
        sin, cos = math.sin(heading_rad), math.cos(heading_rad)
        ranges = self.nothing.copy()
        if faces.circles_m.shape[1]:
            _lower_to_circles(
                ranges,
                self._fan_right,
                self._fan_ahead,
                faces.circles_m,
                east,
                north,
                cos,
                sin,
                self._range_m,
                self.first_rad,
                self.spacing_rad,
            )
        if faces.edges_m.shape[1]:
            away_east, away_north = faces.edges_m[::2] - east, faces.edges_m[1::2] - north
            self._hit_edges(ranges, cos * away_east - sin * away_north, sin * away_east + cos * away_north)
        return ranges

    def _hit_edges(self, ranges: FloatArray, right: FloatArray, ahead: FloatArray) -> None:
        """Lowers ranges to edges; (2, e) where they start and end, to the right and ahead.

        A ray hits where the ends lie on different sides of it. Two edges that share a vertex agree about its
        side, so that no ray slips through between them.
        """
        (start_right, end_right), (start_ahead, end_ahead) = right, ahead
        turn = start_ahead * end_right - start_right * end_ahead
        dot = start_right * end_right + start_ahead * end_ahead
        width = np.arctan2(turn, dot)
        backwards = width < 0.0
        first = np.arctan2(
            np.where(backwards, end_right, start_right), np.where(backwards, end_ahead, start_ahead)
        )
        tries, faces = [], []
        for face, (bearing, wide) in enumerate(zip(first.tolist(), np.abs(width).tolist(), strict=True)):
            low, high, again = _tried(bearing, wide, self.first_rad, self.spacing_rad, len(self.rays))
            for span in ((low, high), (0, again)):
                if span[0] < span[1]:
                    tries.append(span)
                    faces.append(face)
        if not tries:
            return
        along_right, along_ahead = end_right - start_right, end_ahead - start_ahead
        lever = start_right * along_ahead - start_ahead * along_right
        columns = np.array((start_right, start_ahead, end_right, end_ahead, lever))[:, faces]
        rays, (start_right, start_ahead, end_right, end_ahead, lever) = self._pairs(tries, columns)
        ray_right, ray_ahead = rays
        start_side = ray_right * start_ahead - ray_ahead * start_right
        end_side = ray_right * end_ahead - ray_ahead * end_right
        hit = ((start_side >= 0) != (end_side >= 0)).nonzero()[0]
        distance = np.full(len(lever), math.inf)
        distance[hit] = lever[hit] / (end_side[hit] - start_side[hit])
        distance[(distance < 0) | (distance > self._range_m)] = math.inf
        _lower(ranges, tries, distance)

    def _pairs(self, tries: Sequence[tuple[int, int]], faces: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rays and faces that may meet: (2, p) directions to the right and ahead, and (k, p) rows of faces."""
        counts = [high - low for low, high in tries]
        rays = np.concatenate([self._fan[:, low:high] for low, high in tries], axis=1)
        return rays, faces.repeat(counts, axis=1)


@compiled(FACES, FACES, FLOAT, FLOAT, unchecked=True)  # every scan begins with it
def nearest_face_m(circles: FloatArray, edges: FloatArray, east: float, north: float) -> float:
    """Distance from a place to the nearest face, ahead or not; +inf where there is none.

    Args:
        circles: (3, c) as `Faces` has them,
        edges: (4, e) and these.
        east: of the place, m.
        north: of the place, m.
    """
    nearest = math.inf
    for i in range(circles.shape[1]):
        away = math.hypot(circles[0, i] - east, circles[1, i] - north) - circles[2, i]
        nearest = min(nearest, abs(away))
    for i in range(edges.shape[1]):
        right, ahead = edges[0, i] - east, edges[1, i] - north
        along_right, along_ahead = edges[2, i] - edges[0, i], edges[3, i] - edges[1, i]
        length_m2 = max(along_right * along_right + along_ahead * along_ahead, LEAST_M2)
        share = min(max(-(right * along_right + ahead * along_ahead) / length_m2, 0.0), 1.0)
        nearest = min(nearest, math.hypot(right + share * along_right, ahead + share * along_ahead))
    return nearest


@compiled(FLOAT, FLOAT, FLOAT, FLOAT, COUNT)
def _tried(
    bearing_rad: float, width_rad: float, first_rad: float, spacing_rad: float, rays: int
) -> tuple[int, int, int]:
    """Rays that may meet a face: of two spans the first, after the last, and after the last of one from ray 0 on.

    Args:
        bearing_rad: from the nose at which the face begins.
        width_rad: how far it reaches clockwise from there.
        first_rad: bearing of ray 0 from the nose.
        spacing_rad: of the rays.
        rays: how many.
    """
    first = (bearing_rad - first_rad) % math.tau / spacing_rad
    last = first + width_rad / spacing_rad
    low, high = math.ceil(first - _MARGIN_RAYS), math.floor(last + _MARGIN_RAYS) + 1
    if high <= rays:
        return low, high, 0
    # It may begin in this turn and reach into the next: it is tried as it is, and one turn back.
    return low, rays, min(math.floor(last - math.tau / spacing_rad + _MARGIN_RAYS) + 1, rays)


@compiled(FLOATS_OUT, FLOATS, FLOATS, FACES, FLOAT, FLOAT, FLOAT, FLOAT, FLOAT, FLOAT, FLOAT)
def _lower_to_circles(
    ranges: FloatArray,
    fan_right: FloatArray,
    fan_ahead: FloatArray,
    circles: FloatArray,
    east: float,
    north: float,
    cos: float,
    sin: float,
    range_m: float,
    first_rad: float,
    spacing_rad: float,
) -> None:
    """Lowers ranges to circles.

    Args:
        ranges: of all rays, m.
        fan_right: unit vectors of the rays as the nose sees them,
        fan_ahead: to its right and ahead.
        circles: (3, c) as `Faces` has them.
        east: of the sensor.
        north: of the sensor.
        cos: of its heading,
        sin: and the sine.
        range_m: nothing is met beyond it.
        first_rad: bearing of ray 0 from the nose.
        spacing_rad: of the rays.
    """
    rays = len(ranges)
    for circle in range(circles.shape[1]):
        away_east, away_north, radius = (
            circles[0, circle] - east,
            circles[1, circle] - north,
            circles[2, circle],
        )
        right, ahead = away_east * cos - away_north * sin, away_east * sin + away_north * cos
        away = math.hypot(right, ahead)
        if not away - radius <= range_m:  # or what tells where it is is not a number
            continue
        half_rad = math.asin(radius / away) if away > radius else math.pi
        # The power of the sensor's place: the square of its tangent to the circle, negative inside.
        power = (away - radius) * (away + radius)
        low, high, again = _tried(
            math.atan2(right, ahead) - half_rad, 2.0 * half_rad, first_rad, spacing_rad, rays
        )
        for begin, end in ((low, high), (0, again)):
            for ray in range(begin, end):
                along = fan_right[ray] * right + fan_ahead[ray] * ahead
                half_chord2 = along * along - power
                if half_chord2 < 0.0:
                    continue
                half_chord = math.sqrt(half_chord2)
                distance = along + half_chord if power <= 0.0 else along - half_chord
                if 0.0 <= distance <= range_m:
                    ranges[ray] = min(ranges[ray], distance)


def _lower(ranges: FloatArray, tries: Iterable[tuple[int, int]], distance: FloatArray) -> None:
    """Lowers ranges to the distances of pairs of rays and faces."""
    first = 0
    for low, high in tries:
        reached = ranges[low:high]
        np.minimum(reached, distance[first : first + high - low], out=reached)
        first += high - low
