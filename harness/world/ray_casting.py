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

FACES, PLACE, FOUR = "Array(float64, 2, 'A', readonly=True)", "complex128", "UniTuple(float64, 4)"
Four = tuple[float, float, float, float]

TOUCHING_SHARE = 1e-9
"""Beams touch if their width is their spacing but for this share, since both may come from degrees."""

_MARGIN_RAYS = 1e-3
"""Beams are tried this far, in beams, beyond the bearings of a face, which err by at most 1.5e-8 rad (at a tangent)."""


class Fan:
    """Beams spread evenly about the nose.

    Args:
        field_rad: bearings that their axes are spread over.
        rays: how many.
        range_m: nothing is met beyond it.
        beam_rad: width of each, less than pi; None: they touch; 0: each is a ray.
    """

    def __init__(self, field_rad: float, rays: int, range_m: float, beam_rad: float | None = None) -> None:
        self.spacing_rad = field_rad / rays  # bearing of each axis less that of the one before
        self.first_rad = 0.5 * self.spacing_rad - field_rad / 2  # bearing of the axis of beam 0 from the nose
        self.beam_rad = self.spacing_rad if beam_rad is None else beam_rad  # width of each beam
        self._touching = abs(self.beam_rad - self.spacing_rad) <= TOUCHING_SHARE * self.spacing_rad
        self._range_m = range_m
        offsets = self.first_rad + self.spacing_rad * np.arange(rays)
        self.rays: ComplexArray = np.sin(offsets) + 1j * np.cos(offsets)
        """(n,) unit vectors of the axes as the nose sees them, to its right + i ahead."""
        self.rays.setflags(write=False)
        self._left, self._right = self._sides(field_rad, rays)
        self.nothing = np.full(rays, math.inf)  # (n,) ranges where nothing is met
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
        ranges = self.nothing.copy()
        pose = east, north, math.cos(heading_rad), math.sin(heading_rad)
        fan = self._range_m, self.first_rad, self.spacing_rad, self.beam_rad
        for each in (faces.circles_m, faces.edges_m):
            if each.shape[1]:
                _lower(ranges, self._left, self._right, each, self._touching, pose, fan)
        return ranges


@compiled(FLOAT, FLOAT, FLOAT, FLOAT, COUNT, inner=True)
def _beams_between(
    bearing_rad: float, width_rad: float, first_rad: float, spacing_rad: float, rays: int
) -> tuple[int, int, int]:
    """Returns the beams whose axes lie between two bearings: begin and stop of one span, and the stop of one from 0 on.

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


@compiled(PLACE, FLOAT, FLOAT, inner=True)
def _side(ray: complex, right: float, ahead: float) -> float:
    """Returns how far (m) a place lies clockwise of a ray, negative if it lies the other way."""
    return ray.imag * right - ray.real * ahead


@compiled(PLACE, PLACE, FLOAT, FLOAT, inner=True)
def _between(left: complex, right: complex, to_right: float, ahead: float) -> bool:
    """Tells whether a place lies between the two sides of a beam, which is narrower than a half turn."""
    return (
        _side(left, to_right, ahead) >= 0.0
        and _side(right, to_right, ahead) <= 0.0
        and (left.real + right.real) * to_right + (left.imag + right.imag) * ahead >= 0.0
    )


@compiled(FLOAT, FLOAT, FLOAT, FLOAT, inner=True)
def _nearest_of(
    start_right: float, start_ahead: float, end_right: float, end_ahead: float
) -> tuple[float, float, float]:
    """Returns the nearest place of an edge, to the right and ahead of the sensor (m), and its distance."""
    along_right, along_ahead = end_right - start_right, end_ahead - start_ahead
    length_m2 = max(along_right * along_right + along_ahead * along_ahead, LEAST_M2)
    share = min(max(-(start_right * along_right + start_ahead * along_ahead) / length_m2, 0.0), 1.0)
    right, ahead = start_right + share * along_right, start_ahead + share * along_ahead
    return right, ahead, math.hypot(right, ahead)


@compiled(FACES, COUNT, FOUR, inner=True)
def _view(faces: FloatArray, face: int, pose: Four) -> tuple[Four, tuple[float, float, float], float, float]:
    """Returns a face as the nose sees it: the argument for `_along`, its nearest place with distance, its bearings.

    The nearest place is to the right and ahead; bearings are that of its left end and how far it reaches clockwise.
    """
    east, north, cos, sin = pose
    away_east, away_north = faces[0, face] - east, faces[1, face] - north
    right, ahead = away_east * cos - away_north * sin, away_east * sin + away_north * cos
    if len(faces) == 3:
        radius, away = faces[2, face], math.hypot(right, ahead)
        half_rad = math.asin(radius / away) if away > radius else math.pi
        # Its nearest place is that towards its centre; seen from inside, away from that.
        way = 1.0 if away > radius else -1.0
        foot = way * right, way * ahead, abs(away - radius)
        return (right, ahead, radius, way), foot, math.atan2(right, ahead) - half_rad, 2.0 * half_rad
    away_east, away_north = faces[2, face] - east, faces[3, face] - north
    end_right, end_ahead = away_east * cos - away_north * sin, away_east * sin + away_north * cos
    width_rad = math.atan2(ahead * end_right - right * end_ahead, right * end_right + ahead * end_ahead)
    begins_rad = math.atan2(right, ahead) if width_rad >= 0.0 else math.atan2(end_right, end_ahead)
    foot = _nearest_of(right, ahead, end_right, end_ahead)
    return (right, ahead, end_right, end_ahead), foot, begins_rad, abs(width_rad)


@compiled(PLACE, FOUR, BOOL, inner=True)
def _along(ray: complex, face: Four, circular: bool) -> float:
    """Returns the distance along a ray to a face, +inf where it does not meet it.

    A circle is its centre, its radius, and 1, or -1 where the ray begins inside of it and leads to the way out. An edge
    is its two ends; it is met where they lie on different sides of the ray. Two edges that share a vertex agree about
    its side, so that no ray slips through between them.
    """
    right, ahead, end_right, end_ahead = face
    start_side = _side(ray, right, ahead)
    if circular:
        beside, radius = abs(start_side), end_right
        if beside > radius:
            return math.inf
        half_chord = math.sqrt((radius - beside) * (radius + beside))
        distance = ray.real * right + ray.imag * ahead - end_ahead * half_chord
    else:
        end_side = _side(ray, end_right, end_ahead)
        if (start_side >= 0.0) == (end_side >= 0.0):
            return math.inf
        lever = right * (end_ahead - ahead) - ahead * (end_right - right)
        distance = lever / (start_side - end_side)
    return distance if distance >= 0.0 else math.inf


@compiled(PLACE, PLACE, FOUR, "UniTuple(float64, 3)", BOOL, inner=True)
def _inside(left: complex, right: complex, face: Four, foot: tuple[float, float, float], circular: bool) -> float:
    """Returns the distance to the nearest place or vertex of a face that lies in a beam; +inf where none does."""
    distance = foot[2] if _between(left, right, foot[0], foot[1]) else math.inf
    if not circular:
        # Both vertices: where the nearest place of the edge is out of the beam, one may be nearest in it.
        if _between(left, right, face[0], face[1]):
            distance = min(distance, math.hypot(face[0], face[1]))
        if _between(left, right, face[2], face[3]):
            distance = min(distance, math.hypot(face[2], face[3]))
    return distance


@compiled(FLOATS_OUT, PLACES, PLACES, FACES, BOOL, FOUR, FOUR)
def _lower(
    ranges: FloatArray,
    left: ComplexArray,
    right: ComplexArray,
    faces: FloatArray,
    touching: bool,
    pose: Four,
    fan: Four,
) -> None:
    """Lowers each beam's range to the nearest of the faces: (3, c) circles or (4, e) edges, as in `Faces`.

    `left` and `right` are unit vectors of the sides of the beams as the nose sees them, to its right + i ahead; of
    beams that are `touching` the right side of each is the left side of the next. `pose` is the place of the sensor and
    cosine and sine of its heading; `fan` the range, the bearing of the axis of beam 0, from axis to axis, and the width
    of a beam.
    """
    (range_m, first_rad, spacing_rad, beam_rad), circular, rays = fan, len(faces) == 3, len(ranges)
    for number in range(faces.shape[1]):
        face, foot, begins_rad, width_rad = _view(faces, number, pose)
        if not foot[2] <= range_m:  # or what tells where it is is not a number
            continue
        low, high, again = _beams_between(
            begins_rad - 0.5 * beam_rad, width_rad + beam_rad, first_rad, spacing_rad, rays
        )
        for begin, end in ((low, high), (0, again)):
            at_right = math.inf
            for beam in range(begin, end):
                at_left = at_right
                if beam == begin or not touching:
                    at_left = _along(left[beam], face, circular)
                distance = at_right = at_left
                if beam_rad > 0.0:
                    at_right = _along(right[beam], face, circular)
                    distance = min(at_left, at_right, _inside(left[beam], right[beam], face, foot, circular))
                if distance <= range_m:
                    ranges[beam] = min(ranges[beam], distance)


@compiled(FACES, FACES, FLOAT, FLOAT)
def nearest_face_m(circles: FloatArray, edges: FloatArray, east: float, north: float) -> float:
    """Returns the distance from a place to the nearest face in any direction, +inf where there is none."""
    nearest = math.inf
    for i in range(circles.shape[1]):
        away = math.hypot(circles[0, i] - east, circles[1, i] - north) - circles[2, i]
        nearest = min(nearest, abs(away))
    for i in range(edges.shape[1]):
        start_east, start_north = edges[0, i] - east, edges[1, i] - north
        _, _, away = _nearest_of(start_east, start_north, edges[2, i] - east, edges[3, i] - north)
        nearest = min(nearest, away)
    return nearest
