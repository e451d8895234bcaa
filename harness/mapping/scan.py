"""One scan of a range sensor: what came back within each beam, and where the sensor was.

A beam tells that something is at its range somewhere within its width, and that nothing within it is nearer. Where:
what reaches into the beam from a neighbour that returned less is nearest where the two meet, and its place is exact;
anything else is taken to be on the axis, and may be half a width to either side. A beam without a width is a ray,
all of which lies on its axis.

Frame: local ENU plane, x = east, y = north, metres. Bearings are radians clockwise from north.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from planner.compiled import BOOL, COUNT, COUNTS_OUT, FLOAT, FLOATS, FLOATS_OUT, PLACES, PLACES_OUT, compiled
from planner.interface import ComplexArray, FloatArray, IntArray

Beams = tuple[float, float, float, float, float]  # the value of `RangeScan.beams`

GRAZING_WIDTHS = 30.0
"""Neighbouring beams show one face if their ranges differ by at most this many beam widths: a face at 2 degrees."""
NEARER_SHARE = 0.5
"""Neighbouring beams show one face only if the smaller range is less by at most this share of the larger one."""
TURNED_SHARE = 1.0 / 8.0  # turned by this share of its field of view, a sensor looks elsewhere
SURE_SIGMAS = 3.0
"""A range shorter by this many standard deviations of the noise is that of a nearer obstacle."""


@dataclass(frozen=True, eq=False)
class RangeScan:
    """One scan; all arrays are read-only, and copied if they were not.

    Attributes:
        time_s: when the sensor looked.
        available_s: when the scan may be used.
        east_m: sensor position.
        north_m: sensor position.
        heading_rad: bearing of the nose, clockwise from north.
        start_rad: bearing of the axis of beam 0, clockwise from north, in [0, 2 pi).
        spacing_rad: bearing of each axis less that of the one before; positive, clockwise.
        fan: (n,) unit vectors of the axes as the nose sees them, to its right + i ahead.
        ranges_m: (n,) measured ranges, +inf where nothing came back.
        max_range_m: no return is longer.
        beam_rad: width of each beam; 0: rays.
        noise_m: standard deviation of ranges, as the sensor's maker states it.
        lossy: returns get lost, likewise: a beam without one may have met something.
        nearest_m: no return is shorter; +inf if surely nothing came back. It may be of a face out of view.
    """

    time_s: float
    available_s: float
    east_m: float
    north_m: float
    heading_rad: float
    start_rad: float
    spacing_rad: float
    fan: ComplexArray
    ranges_m: FloatArray
    max_range_m: float
    beam_rad: float = 0.0
    noise_m: float = 0.0
    lossy: bool = False
    nearest_m: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "nearest_m", float(self.ranges_m.min(initial=math.inf)))
        for name in ("fan", "ranges_m"):
            array = getattr(self, name)
            if array.flags.writeable:
                array = array.copy()
                array.setflags(write=False)
                object.__setattr__(self, name, array)

    def returned(self, origin_m: complex = 0j) -> tuple[IntArray, ComplexArray]:
        """Returns the (k,) beams that returned something, and the places, east + i north from an origin."""
        most, sensor = len(self.ranges_m), complex(self.east_m, self.north_m) - origin_m
        rays, places = np.empty(most, dtype=np.intp), np.empty(most, dtype=np.complex128)
        many = _fill_returned(
            rays,
            places,
            self.fan,
            self.ranges_m,
            -self.heading_rad,
            sensor.real,
            sensor.imag,
            self.beam_rad,
            self.noise_m,
            all_round(self),
            self.lossy,
        )
        return rays[:many], places[:many]

    def from_sensor_m(self, rays: IntArray) -> ComplexArray:
        """(k,) places of the returns of some beams, east + i north of the sensor."""
        turned: ComplexArray = self.fan.take(rays) * self.ranges_m.take(rays)
        if self.beam_rad:
            sides = np.empty(len(self.ranges_m))
            _fill_sides(sides, self.ranges_m, self.beam_rad, self.noise_m, all_round(self), self.lossy)
            by_side = np.exp((-0.5j * self.beam_rad) * np.array((0.0, 1.0, -1.0)))
            turned *= by_side[sides.take(rays).astype(np.intp)]
        turned *= cmath.rect(1.0, -self.heading_rad)
        return turned

    def ends_m(self, rays: IntArray) -> ComplexArray:
        """(k,) places of the returns of some beams, east + i north."""
        return self.from_sensor_m(rays) + complex(self.east_m, self.north_m)

    def taken_from(self, east_m: float, north_m: float, heading_rad: float) -> RangeScan:
        """Returns the same ranges from another pose of the sensor: east and north (m), bearing of the nose (rad)."""
        values = {each.name: getattr(self, each.name) for each in fields(RangeScan) if each.init}
        start_rad = (self.start_rad + heading_rad - self.heading_rad) % math.tau
        pose = {"east_m": east_m, "north_m": north_m, "heading_rad": heading_rad, "start_rad": start_rad}
        return RangeScan(**{**values, **pose})

    def computed(self) -> RangeScan:
        """Returns itself with all ranges computed, so that it no longer refers to the world."""
        _ = self.ranges_m
        return self

    @property
    def beams(self) -> Beams:
        """Sensor's east and north (m); bearing of the first axis, angle from axis to axis, and width (rad)."""
        return self.east_m, self.north_m, self.start_rad, self.spacing_rad, self.beam_rad

    @property
    def followed(self) -> bool:
        """Whether its ranges have been computed, which happens when they are first read."""
        return "ranges_m" in self.__dict__

    @property
    def directions(self) -> FloatArray:
        """(n, 2) unit vectors (east, north) of the axes."""
        turned: ComplexArray = self.fan * cmath.rect(1.0, -self.heading_rad)
        turned.setflags(write=False)
        return turned.view(np.float64).reshape(-1, 2)


@compiled(FLOATS, COUNT, COUNT, BOOL, BOOL, inner=True)
def _next_range(ranges: FloatArray, ray: int, step: int, closed: bool, lossy: bool) -> float:
    """Returns the range of the next beam to one side, or where that may be lost, of the one after it."""
    rays, beside = len(ranges), math.inf
    for steps in range(1, 3 if lossy else 2):
        other = ray + steps * step
        if math.isinf(beside) and (closed or 0 <= other < rays):
            beside = ranges[other % rays]
    return beside


@compiled(FLOATS, COUNT, FLOAT, FLOAT, BOOL, BOOL, inner=True)
def _side(ranges: FloatArray, ray: int, beam_rad: float, noise_m: float, closed: bool, lossy: bool) -> float:
    """Tells where within a beam its return comes from: 1 its right side, -1 its left side, 0 the axis.

    `closed` means that the last beam is the neighbour of the first, and `lossy` that returns get lost.
    """
    own = ranges[ray]
    before, after = _next_range(ranges, ray, -1, closed, lossy), _next_range(ranges, ray, 1, closed, lossy)
    least, most = own - min(GRAZING_WIDTHS * beam_rad, NEARER_SHARE) * own, own - SURE_SIGMAS * noise_m
    from_left, from_right = least <= before <= most, least <= after <= most
    if from_left == from_right:  # a corner that points away, or all as far: no side is nearer than the axis
        return 0.0
    return 1.0 if from_right else -1.0


@compiled(FLOATS_OUT, FLOATS, FLOAT, FLOAT, BOOL, BOOL, rare=True)
def _fill_sides(
    sides: FloatArray, ranges: FloatArray, beam_rad: float, noise_m: float, closed: bool, lossy: bool
) -> None:
    """Writes from where in its beam each return comes: 1 right side, -1 left side, 0 the axis; 0 without a return."""
    for ray in range(len(ranges)):
        sides[ray] = _side(ranges, ray, beam_rad, noise_m, closed, lossy) if ranges[ray] < math.inf else 0.0


@compiled(COUNTS_OUT, PLACES_OUT, PLACES, FLOATS, *[FLOAT] * 5, BOOL, BOOL)
def _fill_returned(
    rays: IntArray,
    places: ComplexArray,
    fan: ComplexArray,
    ranges: FloatArray,
    turned_rad: float,
    east: float,
    north: float,
    beam_rad: float,
    noise_m: float,
    closed: bool,
    lossy: bool,
) -> int:
    """Writes the rays that returned and the places (m) of their returns; returns how many."""
    many, cos, sin = 0, math.cos(turned_rad), math.sin(turned_rad)
    half_cos, half_sin = math.cos(0.5 * beam_rad), math.sin(0.5 * beam_rad)
    for ray in range(len(ranges)):
        if ranges[ray] < math.inf:
            right, ahead = fan[ray].real * ranges[ray], fan[ray].imag * ranges[ray]
            if beam_rad > 0.0:
                side = _side(ranges, ray, beam_rad, noise_m, closed, lossy)
                if side != 0.0:
                    aside = side * half_sin
                    right, ahead = right * half_cos + ahead * aside, ahead * half_cos - right * aside
            x, y = right * cos - ahead * sin, right * sin + ahead * cos
            rays[many], places[many] = ray, complex(x + east, y + north)
            many += 1
    return many


def all_round(scan: RangeScan) -> bool:
    """Tells whether the scan goes all round, so that its first beam is the neighbour of its last."""
    return len(scan.fan) * scan.spacing_rad > math.tau - 1e-9


def turned(scan: RangeScan, before_rad: float) -> bool:
    """Tells whether a scan does not go all round, and its nose has turned by `TURNED_SHARE` since a heading."""
    angle_rad = abs(math.remainder(scan.heading_rad - before_rad, math.tau))
    return angle_rad > TURNED_SHARE * len(scan.fan) * scan.spacing_rad and not all_round(scan)


def clockwise_from(start_rad: float, east: FloatArray, north: FloatArray) -> FloatArray:
    """(k,) bearings of offsets, clockwise from a bearing, in [0, 2 pi]."""
    turns = (np.arctan2(east, north) - start_rad) * (1.0 / math.tau)
    return (turns - np.floor(turns)) * math.tau


def supported(scan: RangeScan, apart_m: float) -> NDArray[np.bool_]:
    """(n,) which beams returned a range that one of the two to either side returned too, so that it is not false."""
    ranges = scan.ranges_m if all_round(scan) else np.concatenate((scan.ranges_m, np.full(2, math.inf)))
    supported = np.zeros(len(ranges), dtype=np.bool_)
    for side in (1, 2):
        # Where one of two is missing, they are infinitely far apart; where both are, that is no number.
        with np.errstate(invalid="ignore"):
            alike = np.abs(ranges - np.roll(ranges, side)) < apart_m
        supported |= alike | np.roll(alike, -side)
    return supported[: len(scan.ranges_m)]
