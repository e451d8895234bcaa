"""How far an outline has moved, found by matching it to the returns of a later scan.

The translation is sought that lays the outline upon the returns (point-to-line registration; Y. Chen and G. Medioni,
"Object modelling by registration of multiple range images", 1992). A flat face tells nothing of a shift along
itself; there its ends do, where they are ends: what is hidden, out of range or out of view further on has none.
Points are complex: east + i north, m.
"""

from __future__ import annotations

import math
from statistics import median
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.mapping.scan import RangeScan, all_round
from planner.compiled import PLACES, compiled
from planner.interface import ComplexArray, IntArray

Ends = tuple[bool, bool]

FEWEST = 3  # an outline, a match or a change needs at least this many returns
ROUNDS = 3  # a match is refined this many times, each time with the nearest points of the one before
STRAIGHT_COSINE = 0.9  # points of an outline where it turns by an angle of a smaller cosine are not matched
CLOSER_FACTOR = 0.5  # each round of a match uses returns within so many times the distance of the last one
FLAT_MEAN = 0.99
"""An outline is straight if the mean of its unit tangents squared, as complex numbers, is at least this long."""
BESIDE_SHARE = 0.2  # a return may lie beyond the points of the outline, along it, by this share of the gate
END_WEIGHT = 0.01  # each end has this share of the weight of all points between
STIFF, STIFF_IN_NOISE = 1e-4, 0.05
"""Weight, as a share of all returns', that holds the shift at its prediction; the second is for noisy ranges."""
BEYOND_RAYS = 5
"""This many rays beyond an end of an outline are compared; chance hardly ever loses all of them."""
FARTHEST_SHARE = 0.95  # an outline that is lost beyond this share of the sensing range does not end there


class Outline(NamedTuple):
    """A run of returns from neighbouring rays."""

    points: ComplexArray  # (m,) places, clockwise as the sensor saw them
    ends: Ends  # whether the first and the last of them are where the thing ends
    several: int = 1  # of so many points each the mean tells whether it is straight: the others err too much

    @property
    def is_definite(self) -> bool:
        """Whether it shows shifts in every direction: it has both of its ends, or is not straight."""
        return all(self.ends) or self.is_bent

    @property
    def is_bent(self) -> bool:
        """Whether it is not straight."""
        return abs(self._tangent_mean) < FLAT_MEAN

    @property
    def along(self) -> complex:
        """Unit vector along a straight one, either way."""
        return (self._tangent_mean / abs(self._tangent_mean)) ** 0.5

    @property
    def _tangent_mean(self) -> complex:
        """Mean of its unit tangents squared; of its chord where it is straight nowhere."""
        points = self.points
        if self.several > 1 and len(points) >= FEWEST * self.several:
            points = means(points, self.several)
        along, straight = _tangents(points)
        if straight.any():
            return complex((along[straight] ** 2).mean())
        chord = complex(self.points[-1] - self.points[0])
        return (chord / abs(chord)) ** 2 if chord else 1.0 + 0j

    def lines(self, noisy: bool) -> tuple[ComplexArray, NDArray[np.bool_]]:
        """(m,) directions along it, and where it is straight; noise on a face would seem to show shifts along it."""
        along, straight = _tangents(self.points)
        if noisy and not self.is_bent:
            along[:], straight[1:-1] = self.along, True
        return along, straight

    def moved(self, by: complex) -> Outline:
        """Returns the outline shifted `by` a vector."""
        return Outline(self.points + by, self.ends, self.several)


def means(points: ComplexArray, several: int) -> ComplexArray:
    """(k,) means of each `several` points in order; the last of those left over."""
    first = np.arange(0, len(points), several)
    return (np.add.reduceat(points, first) / np.diff(np.append(first, len(points)))).astype(np.complex128)


class Registration(NamedTuple):
    """An outline matched to returns."""

    shift: complex  # translation, east + i north, m
    members: IntArray  # (k,) which of the returns belong to it, clockwise


def ends_of(scan: RangeScan, rays: IntArray, apart_m: float) -> Ends:
    """Tells at both ends of a run of rays whether the obstacle ends: rays beyond it end `apart_m` away or further."""
    return _is_end(scan, int(rays[0]), -1, apart_m), _is_end(scan, int(rays[-1]), 1, apart_m)


def register(
    outline: Outline,
    returns: tuple[IntArray, ComplexArray],
    scan: RangeScan,
    gate_m: float,
    apart_m: float,
    stiff: float = STIFF,
    near_m: float = 0.0,
) -> Registration | None:
    """Matches an outline, where it is expected, to some `returns` of a scan: (n,) rays `hits`, at (n,) places.

    Returns further from the outline than `gate_m` are not its; those within `near_m` may be in every round, since they
    err that much. Beyond an end, rays go on, and end `apart_m` away or further. `stiff` is the share of the weight of
    all returns that holds the outline where it is expected.

    Returns:
        None where too few of the returns are near, or the shift would be larger than the gate.
    """
    hits, places = returns
    near = _within_gate(outline.points, places, gate_m)
    if min(len(near), len(outline.points)) < FEWEST:
        return None
    sensor = complex(scan.east_m, scan.north_m)
    ahead = (outline.points[len(outline.points) // 2] - sensor).conjugate()
    near = near[np.argsort(-np.angle((places[near] - sensor) * ahead))]
    along, straight = outline.lines(near_m > 0.0)
    if np.count_nonzero(straight) < FEWEST:
        return _register_by_middle(outline, returns, near, scan, apart_m)
    reach = 1.5 * median(np.abs(outline.points[1:] - outline.points[:-1]).tolist()) + 1e-6
    shift = 0j
    for i in range(ROUNDS):
        within_m = max(gate_m * CLOSER_FACTOR**i, near_m)
        moved = outline.points + shift
        own = nearest(places[near], moved)
        off = (places[near] - moved[own]) * along[own].conj()  # along + i across
        inside = (np.abs(off.imag) < within_m) & (np.abs(off.real) < reach + BESIDE_SHARE * gate_m)
        inner = inside & straight[own] & (np.abs(off.real) < reach)
        if np.count_nonzero(inner) < FEWEST:
            return None
        members = near[inside]
        seen_ends = ends_of(scan, hits[members], apart_m)
        ends = [
            places[members[end]] - outline.points[end] - shift
            for end, was, still in zip((0, -1), outline.ends, seen_ends, strict=True)
            if was and still
        ]
        # An end that is far off is another one: faces come into view and go out of it.
        ends = [end for end in ends if abs(end) < reach + BESIDE_SHARE * gate_m]
        shift += _least_squares(1j * along[own[inner]], off.imag[inner], ends, shift, stiff)
    if abs(shift) > gate_m:
        return None
    return Registration(shift, np.asarray(members, dtype=np.intp))


def _register_by_middle(
    outline: Outline, returns: tuple[IntArray, ComplexArray], near: IntArray, scan: RangeScan, apart_m: float
) -> Registration | None:
    """Matches an outline by its middle to the run of `near` returns next to it; None unless both are whole."""
    (hits, places), middle = returns, outline.points.mean()
    runs = np.split(near, (np.abs(np.diff(places[near])) > apart_m).nonzero()[0] + 1)
    members = min(runs, key=lambda run: abs(places[run].mean() - middle))
    if len(members) < FEWEST or not all((*outline.ends, *ends_of(scan, hits[members], apart_m))):
        return None
    return Registration(complex(places[members].mean() - middle), members)


@compiled(PLACES, PLACES, rare=True)
def nearest(places: ComplexArray, points: ComplexArray) -> IntArray:
    """(k,) index of the nearest of (m,) points to each of (k,) places, without a table of all distances."""
    which = np.zeros(len(places), dtype=np.intp)
    for i in range(len(places)):
        least = math.inf
        for j in range(len(points)):
            dx, dy = points[j].real - places[i].real, points[j].imag - places[i].imag
            if dx * dx + dy * dy < least:
                least, which[i] = dx * dx + dy * dy, j
    return which


def _least_squares(
    normals: ComplexArray, across: NDArray[np.float64], ends: list[complex], shift: complex, stiff: float
) -> complex:
    """Returns the further shift that fits best: points to their lines, ends to ends, and close to the prediction."""
    a, b, c = (normals.real**2).sum(), (normals.real * normals.imag).sum(), (normals.imag**2).sum()
    hold, pull = stiff * (a + c), END_WEIGHT * (a + c)
    right = complex((normals * across).sum()) + pull * sum(ends) - hold * shift
    a, c = a + hold + pull * len(ends), c + hold + pull * len(ends)
    return complex(c * right.real - b * right.imag, a * right.imag - b * right.real) / float(a * c - b * b)


def _within_gate(points: ComplexArray, places: ComplexArray, gate_m: float) -> IntArray:
    """Returns the indices of places within `gate_m` of the upright box round some points."""
    inside = np.ones(len(places), dtype=np.bool_)
    for of_points, of_places in ((points.real, places.real), (points.imag, places.imag)):
        inside &= (of_places > of_points.min() - gate_m) & (of_places < of_points.max() + gate_m)
    return inside.nonzero()[0]


def _tangents(points: ComplexArray) -> tuple[ComplexArray, NDArray[np.bool_]]:
    """Returns (m,) unit vectors along an outline, and whether it is straight there, which it is not at its ends."""
    along = np.empty_like(points)
    along[1:-1] = points[2:] - points[:-2]
    along[0], along[-1] = points[1] - points[0], points[-1] - points[-2]
    along /= np.maximum(np.abs(along), 1e-9)
    straight = np.zeros(len(points), dtype=np.bool_)
    straight[1:-1] = (along[2:] * along[:-2].conj()).real > STRAIGHT_COSINE
    return along, straight


def _is_end(scan: RangeScan, ray: int, side: int, apart_m: float) -> bool:
    ranges, rays, closed = scan.ranges_m, len(scan.ranges_m), all_round(scan)
    own = float(ranges[ray])
    if not own < FARTHEST_SHARE * scan.max_range_m:
        return False
    for steps in range(1, BEYOND_RAYS + 1):
        beyond = ray + side * steps
        if not (closed or 0 <= beyond < rays):
            return False
        further = float(ranges[beyond % rays]) - own
        if not (further > 0.0 and math.hypot(further, own * scan.spacing_rad * steps) > apart_m):
            return False
    return True
