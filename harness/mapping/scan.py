"""One scan of a range sensor: what came back along each ray, and where the sensor was.

Frame: local ENU plane, x = east, y = north, metres. Bearings are radians clockwise from north.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.compiled import COUNTS_OUT, FLOAT, FLOATS, PLACES, PLACES_OUT, compiled, fused
from planner.interface import ComplexArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class RangeScan:
    """One scan; all arrays are read-only, and copied if they were not.

    Attributes:
        time_s: when the sensor looked.
        available_s: when the scan may be used.
        east_m: sensor position.
        north_m: sensor position.
        heading_rad: bearing of the nose, clockwise from north.
        start_rad: bearing of ray 0, clockwise from north, in [0, 2 pi).
        spacing_rad: bearing of each ray less that of the one before; positive, clockwise.
        fan: (n,) unit vectors of the rays as the nose sees them, to its right + i ahead.
        ranges_m: (n,) measured ranges, +inf where nothing came back.
        max_range_m: no return is longer.
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
        """(k,) rays that returned something, and where they ended, east + i north from an origin."""
        most, sensor = len(self.ranges_m), complex(self.east_m, self.north_m) - origin_m
        rays, places = np.empty(most, dtype=np.intp), np.empty(most, dtype=np.complex128)
        many = _returned(rays, places, self.fan, self.ranges_m, -self.heading_rad, sensor.real, sensor.imag)
        return rays[:many], places[:many]

    def from_sensor_m(self, rays: IntArray) -> ComplexArray:
        """(k,) where some rays ended, east + i north of the sensor."""
        turned: ComplexArray = self.fan.take(rays) * self.ranges_m.take(rays)
        turned *= cmath.rect(1.0, -self.heading_rad)
        return turned

    def ends_m(self, rays: IntArray) -> ComplexArray:
        """(k,) where some rays ended, east + i north."""
        return self.from_sensor_m(rays) + complex(self.east_m, self.north_m)

    def kept(self) -> RangeScan:
        """The same, its rays followed by now: nothing leads from it to the world any more."""
        _ = self.ranges_m
        return self

    @property
    def followed(self) -> bool:
        """Whether its rays have been followed: ranges that nobody has read yet cost more than others."""
        return "ranges_m" in self.__dict__

    @property
    def directions(self) -> FloatArray:
        """(n, 2) unit vectors (east, north) of the rays."""
        turned: ComplexArray = self.fan * cmath.rect(1.0, -self.heading_rad)
        turned.setflags(write=False)
        return turned.view(np.float64).reshape(-1, 2)


@compiled(COUNTS_OUT, PLACES_OUT, PLACES, FLOATS, FLOAT, FLOAT, FLOAT)
def _returned(
    rays: IntArray,
    places: ComplexArray,
    fan: ComplexArray,
    ranges: FloatArray,
    turned_rad: float,
    east: float,
    north: float,
) -> int:
    many, cos, sin = 0, math.cos(turned_rad), math.sin(turned_rad)
    for ray in range(len(ranges)):
        if ranges[ray] < math.inf:
            right, ahead = fan[ray].real * ranges[ray], fan[ray].imag * ranges[ray]
            x, y = fused(right, cos, -(ahead * sin)), fused(right, sin, ahead * cos)
            rays[many], places[many] = ray, complex(x + east, y + north)
            many += 1
    return many


def all_round(scan: RangeScan) -> bool:
    """Whether the first ray is the neighbour of the last."""
    return len(scan.ranges_m) * scan.spacing_rad > math.tau - 1e-9


def clockwise_from(start_rad: float, east: FloatArray, north: FloatArray) -> FloatArray:
    """(k,) bearings of offsets, clockwise from a bearing, in [0, 2 pi]."""
    turns = (np.arctan2(east, north) - start_rad) * (1.0 / math.tau)
    turned: FloatArray = (turns - np.floor(turns)) * math.tau
    return turned


def supported(scan: RangeScan, apart_m: float) -> NDArray[np.bool_]:
    """(n,) which rays returned something that one of the two to either side returned, too: no false return."""
    ranges = scan.ranges_m if all_round(scan) else np.concatenate((scan.ranges_m, np.full(2, math.inf)))
    supported = np.zeros(len(ranges), dtype=np.bool_)
    for side in (1, 2):
        # Where one of two is missing, they are infinitely far apart; where both are, that is no number.
        with np.errstate(invalid="ignore"):
            alike = np.abs(ranges - np.roll(ranges, side)) < apart_m
        supported |= alike | np.roll(alike, -side)
    return supported[: len(scan.ranges_m)]
