"""The nearest face of the true world within each beam of a range sensor.

A beam is all that lies between its two sides, which are rays. The nearest place of a face within it lies on one of
the sides, or is the nearest place of the whole face, or a vertex. Beams that touch share a side, bit for bit, so that
nothing is so thin that it fits between two. A beam without a width is one ray.

Frame: local ENU plane, x = east, y = north, metres. Bearings are radians clockwise from north. What a beam meets is
decided by correctly rounded operations on its sides and that face alone; bearings of faces only choose which beams
are tried, with a margin. So a face that is not met cannot change any range.
"""

from __future__ import annotations

import math

import numpy as np

from harness.world.obstacle import LEAST_M2
from harness.world.world import Faces
from planner.compiled import BOOL, COUNT, FLOAT, FLOATS_OUT, PLACES, compiled
from planner.interface import ComplexArray, FloatArray

FACES, PLACE = "Array(float64, 2, 'A', readonly=True)", "complex128"

SAME = 1e-9
"""Beams touch where their width is their spacing but for this share: both may come from degrees."""

# Beams tried beyond the bearings of a face, in beams: more than bearings err, even at a tangent (1.5e-8 rad).
_MARGIN_RAYS = 1e-3


class Fan:
    """Beams spread evenly about the nose.

    Args:
        field_rad: bearings that their axes are spread over.
        rays: how many.
        range_m: nothing is met beyond it.
        beam_rad: width of each, less than pi; None: they touch; 0: each is a ray.
    """

    def __init__(self, field_rad: float, rays: int, range_m: float, beam_rad: float | None = None) -> None:
        self.spacing_rad = field_rad / rays
        """Bearing of each axis less that of the one before."""
        self.first_rad = 0.5 * self.spacing_rad - field_rad / 2
        """Bearing of the axis of beam 0 from the nose."""
        self.beam_rad = self.spacing_rad if beam_rad is None else beam_rad
        """Width of each beam."""
        self._touching = abs(self.beam_rad - self.spacing_rad) <= SAME * self.spacing_rad
        self._range_m = range_m
        offsets = self.first_rad + self.spacing_rad * np.arange(rays)
        self.rays: ComplexArray = np.sin(offsets) + 1j * np.cos(offsets)
        """(n,) unit vectors of the axes as the nose sees them, to its right + i ahead."""
        self.rays.setflags(write=False)
        self._left, self._right = self._sides(field_rad, rays)
        self.nothing = np.full(rays, math.inf)
        """(n,) ranges where nothing is met."""
        self.nothing.setflags(write=False)

    def _sides(self, field_rad: float, rays: int) -> tuple[ComplexArray, ComplexArray]:
        """(n,) unit vectors of the left and the right side of each beam, as `rays`."""
        if not self.beam_rad:
            return self.rays, self.rays
        if not self._touching:
            half = np.exp(0.5j * self.beam_rad)
            return self.rays * half, self.rays / half
        bearings = self.spacing_rad * np.arange(rays + 1) - field_rad / 2
        sides = np.sin(bearings) + 1j * np.cos(bearings)
        if field_rad > math.tau - 1e-9:
            sides[-1] = sides[0]
        return sides[:-1].copy(), sides[1:].copy()

    def ranges_m(self, faces: Faces, east: float, north: float, heading_rad: float) -> FloatArray:
        """(n,) ranges to the nearest face within each beam, +inf beyond the range."""
        sin, cos = math.sin(heading_rad), math.cos(heading_rad)
        ranges = self.nothing.copy()
        pose = (east, north, cos, sin, self._range_m, self.first_rad, self.spacing_rad, self.beam_rad)
        if faces.circles_m.shape[1]:
            _lower_to_circles(ranges, self._left, self._right, faces.circles_m, self._touching, *pose)
        if faces.edges_m.shape[1]:
            _lower_to_edges(ranges, self._left, self._right, faces.edges_m, self._touching, *pose)
        return ranges


@compiled(FLOAT, FLOAT, FLOAT, FLOAT, COUNT)
def _tried(
    bearing_rad: float, width_rad: float, first_rad: float, spacing_rad: float, rays: int
) -> tuple[int, int, int]:
    """Beams whose axes lie between two bearings: of one span the first and after the last, and of one from 0 on.

    The left one is at `bearing_rad` from the nose, the other `width_rad` clockwise from there, the axis of beam 0 at
    `first_rad`.
    """
    first = (bearing_rad - first_rad) % math.tau / spacing_rad
    last = first + width_rad / spacing_rad
    low, high = math.ceil(first - _MARGIN_RAYS), math.floor(last + _MARGIN_RAYS) + 1
    if high <= rays:
        return low, high, 0
    # It may begin in this turn and reach into the next: it is tried as it is, and one turn back.
    return low, rays, min(math.floor(last - math.tau / spacing_rad + _MARGIN_RAYS) + 1, rays)


@compiled(PLACE, FLOAT, FLOAT)
def _side(ray: complex, right: float, ahead: float) -> float:
    """How far a place lies clockwise of a ray, m; negative: the other way."""
    return ray.imag * right - ray.real * ahead


@compiled(PLACE, PLACE, FLOAT, FLOAT)
def _between(left: complex, right: complex, to_right: float, ahead: float) -> bool:
    """Whether a place lies between the two sides of a beam that is narrower than a half turn."""
    return (
        _side(left, to_right, ahead) >= 0.0
        and _side(right, to_right, ahead) <= 0.0
        and (left.real + right.real) * to_right + (left.imag + right.imag) * ahead >= 0.0
    )


@compiled(PLACE, FLOAT, FLOAT, FLOAT, BOOL)
def _along_to_circle(ray: complex, right: float, ahead: float, radius: float, outside: bool) -> float:
    """Distance along a ray to a circle, from inside to the way out; +inf where it does not meet it.

    Its centre lies to the right and ahead of the sensor, which may be `outside`.
    """
    beside = abs(_side(ray, right, ahead))
    if beside > radius:
        return math.inf
    along, half_chord = ray.real * right + ray.imag * ahead, math.sqrt((radius - beside) * (radius + beside))
    distance = along - half_chord if outside else along + half_chord
    return distance if distance >= 0.0 else math.inf


@compiled(FLOATS_OUT, PLACES, PLACES, FACES, BOOL, *[FLOAT] * 8)
def _lower_to_circles(
    ranges: FloatArray,
    left: ComplexArray,
    right: ComplexArray,
    circles: FloatArray,
    touching: bool,
    east: float,
    north: float,
    cos: float,
    sin: float,
    range_m: float,
    first_rad: float,
    spacing_rad: float,
    beam_rad: float,
) -> None:
    """Lowers ranges to circles.

    `left` and `right` are unit vectors of the sides of the beams as the nose sees them, to its right + i ahead; of
    beams that are `touching` the right side of each is the left side of the next. (3, c) `circles` are those of
    `Faces`. The sensor is at east and north, its heading has `cos` and `sin`; `first_rad` is the bearing of the axis of
    beam 0.
    """
    rays = len(ranges)
    for circle in range(circles.shape[1]):
        away_east, away_north = circles[0, circle] - east, circles[1, circle] - north
        radius = circles[2, circle]
        to_right, ahead = away_east * cos - away_north * sin, away_east * sin + away_north * cos
        away = math.hypot(to_right, ahead)
        if not away - radius <= range_m:  # or what tells where it is is not a number
            continue
        half_rad = math.asin(radius / away) if away > radius else math.pi
        outside = away > radius
        # Its nearest place is that towards its centre; seen from inside, away from that.
        way = 1.0 if outside else -1.0
        begins_rad = math.atan2(to_right, ahead) - half_rad - 0.5 * beam_rad
        low, high, again = _tried(begins_rad, 2.0 * half_rad + beam_rad, first_rad, spacing_rad, rays)
        for begin, end in ((low, high), (0, again)):
            at_right = math.inf
            for beam in range(begin, end):
                if touching and beam > begin:
                    at_left = at_right
                else:
                    at_left = _along_to_circle(left[beam], to_right, ahead, radius, outside)
                at_right = at_left
                if beam_rad > 0.0:
                    at_right = _along_to_circle(right[beam], to_right, ahead, radius, outside)
                distance = min(at_left, at_right)
                if beam_rad > 0.0 and _between(left[beam], right[beam], way * to_right, way * ahead):
                    distance = min(distance, abs(away - radius))
                if distance <= range_m:
                    ranges[beam] = min(ranges[beam], distance)


@compiled(FLOAT, FLOAT, FLOAT, FLOAT)
def _nearest_of(
    start_right: float, start_ahead: float, end_right: float, end_ahead: float
) -> tuple[float, float, float]:
    """The nearest place of an edge, to the right and ahead of the sensor, and how far away it is."""
    along_right, along_ahead = end_right - start_right, end_ahead - start_ahead
    length_m2 = max(along_right * along_right + along_ahead * along_ahead, LEAST_M2)
    share = min(max(-(start_right * along_right + start_ahead * along_ahead) / length_m2, 0.0), 1.0)
    right, ahead = start_right + share * along_right, start_ahead + share * along_ahead
    return right, ahead, math.hypot(right, ahead)


@compiled(PLACE, FLOAT, FLOAT, FLOAT, FLOAT, rare=True)
def _along_to_edge(
    ray: complex, start_right: float, start_ahead: float, end_right: float, end_ahead: float
) -> float:
    """Distance along a ray to an edge; +inf where it does not meet it.

    It does where the ends lie on different sides of it. Two edges that share a vertex agree about its side, so that no
    ray slips through between them.
    """
    start_side, end_side = _side(ray, start_right, start_ahead), _side(ray, end_right, end_ahead)
    if (start_side >= 0.0) == (end_side >= 0.0):
        return math.inf
    lever = start_right * (end_ahead - start_ahead) - start_ahead * (end_right - start_right)
    distance = lever / (start_side - end_side)
    return distance if distance >= 0.0 else math.inf


@compiled(FLOATS_OUT, PLACES, PLACES, FACES, BOOL, *[FLOAT] * 8, rare=True)
def _lower_to_edges(
    ranges: FloatArray,
    left: ComplexArray,
    right: ComplexArray,
    edges: FloatArray,
    touching: bool,
    east: float,
    north: float,
    cos: float,
    sin: float,
    range_m: float,
    first_rad: float,
    spacing_rad: float,
    beam_rad: float,
) -> None:
    """Lowers ranges to edges of polygons; arguments as `_lower_to_circles` has them, (4, e) edges as `Faces`."""
    rays = len(ranges)
    for edge in range(edges.shape[1]):
        away_east, away_north = edges[0, edge] - east, edges[1, edge] - north
        start_right, start_ahead = away_east * cos - away_north * sin, away_east * sin + away_north * cos
        away_east, away_north = edges[2, edge] - east, edges[3, edge] - north
        end_right, end_ahead = away_east * cos - away_north * sin, away_east * sin + away_north * cos
        turn = start_ahead * end_right - start_right * end_ahead
        width_rad = math.atan2(turn, start_right * end_right + start_ahead * end_ahead)
        begins_rad = math.atan2(start_right, start_ahead)
        if width_rad < 0.0:
            begins_rad, width_rad = math.atan2(end_right, end_ahead), -width_rad
        foot_right, foot_ahead, foot_m = _nearest_of(start_right, start_ahead, end_right, end_ahead)
        if not foot_m <= range_m:
            continue
        low, high, again = _tried(
            begins_rad - 0.5 * beam_rad, width_rad + beam_rad, first_rad, spacing_rad, rays
        )
        for begin, end in ((low, high), (0, again)):
            at_right = math.inf
            for beam in range(begin, end):
                if touching and beam > begin:
                    at_left = at_right
                else:
                    at_left = _along_to_edge(left[beam], start_right, start_ahead, end_right, end_ahead)
                at_right = at_left
                if beam_rad > 0.0:
                    at_right = _along_to_edge(right[beam], start_right, start_ahead, end_right, end_ahead)
                distance = min(at_left, at_right)
                if beam_rad > 0.0:
                    if _between(left[beam], right[beam], foot_right, foot_ahead):
                        distance = min(distance, foot_m)
                    # Both vertices: where the nearest place of the edge is out of the beam, one may be nearest in it.
                    if _between(left[beam], right[beam], start_right, start_ahead):
                        distance = min(distance, math.hypot(start_right, start_ahead))
                    if _between(left[beam], right[beam], end_right, end_ahead):
                        distance = min(distance, math.hypot(end_right, end_ahead))
                if distance <= range_m:
                    ranges[beam] = min(ranges[beam], distance)


@compiled(FACES, FACES, FLOAT, FLOAT)
def nearest_face_m(circles: FloatArray, edges: FloatArray, east: float, north: float) -> float:
    """Distance from a place to the nearest face, ahead or not; +inf where there is none."""
    nearest = math.inf
    for i in range(circles.shape[1]):
        away = math.hypot(circles[0, i] - east, circles[1, i] - north) - circles[2, i]
        nearest = min(nearest, abs(away))
    for i in range(edges.shape[1]):
        start_east, start_north = edges[0, i] - east, edges[1, i] - north
        _, _, away = _nearest_of(start_east, start_north, edges[2, i] - east, edges[3, i] - north)
        nearest = min(nearest, away)
    return nearest
