"""Simulated scanning range sensor: rays against the true world, with its imperfections.

Frame: local ENU plane, x = east, y = north, metres. Bearings are radians clockwise from north. Rays are followed
in `harness.ray_casting`: a face that is not hit cannot change any bit of a scan.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from harness.ray_casting import Fan, nearest_face_m
from harness.world import Surroundings, World
from planner.compiled import COUNTS_OUT, FLOAT, FLOATS, PLACES, PLACES_OUT, compiled, fused
from planner.interface import ComplexArray, FloatArray, IntArray

if TYPE_CHECKING:
    from harness.scenario_sections import Sensor


# The neighbour list reaches this part of the range further, and this far into the future.
_SKIN = 0.25
_HORIZON_S = 30.0


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


class _Unread(RangeScan):
    """A scan whose rays are followed when somebody first reads their ranges: few scans are news to anybody."""

    @classmethod
    def of(cls, attributes: dict[str, Any]) -> _Unread:
        """A scan of which all is known but the ranges.

        Args:
            attributes: by name; either the ranges are among them or, as `_follow`, what gives them.
        """
        scan = cls.__new__(cls)
        # At once: a frozen dataclass would set them one by one, and that is most of the cost of a scan.
        scan.__dict__.update(attributes)
        return scan

    def __getattr__(self, name: str) -> FloatArray:
        """The ranges, when they are first read."""
        if name != "ranges_m":
            raise AttributeError(name)
        ranges: FloatArray = self.__dict__.pop("_follow")()
        ranges.setflags(write=False)
        self.__dict__[name] = ranges
        return ranges


class RangeSensor:
    """A fan of rays, centred on the nose of the aircraft.

    A ray returns the nearest crossing of an obstacle edge not further than the range; inside an obstacle that
    is the way out. Then, in this order:

    1. Noise: a Gaussian error is added to each range; a negative one becomes 0, one beyond the range is lost.
    2. Dropout: the ray returns nothing.
    3. False return: the ray returns a range uniform in (0, range], whatever there was.

    Each imperfection draws from a stream of its own, for every ray of every scan, so that neither what is
    seen nor another imperfection shifts its draws; one that is off draws nothing.

    Args:
        world: the truth.
        config: the `sensor` part of a scenario.
        seed_sequence: root of the three streams; it is not changed.
    """

    def __init__(self, world: World, config: Sensor, seed_sequence: np.random.SeedSequence) -> None:
        self._world = world
        self._config = config
        self._fan = Fan(math.radians(config.field_of_view_deg), config.rays, config.range_m)
        self._always: dict[str, Any] = {
            "spacing_rad": self._fan.spacing_rad,
            "fan": self._fan.rays,
            "max_range_m": config.range_m,
        }
        self._noise, self._dropout, self._false_return = (
            _stream(seed_sequence, number) for number in range(3)
        )
        self._flawed = config.range_noise_m > 0 or config.dropout > 0 or config.false_return > 0
        self._surroundings: Surroundings | None = None
        self._listed_at = (math.nan, math.nan, math.nan)

    def scan(self, east_m: float, north_m: float, heading_rad: float, time_s: float) -> RangeScan:
        """Looks around from a place, at a time."""
        faces = self._near(east_m, north_m, time_s).faces(time_s)
        seen = {
            **self._always,
            "time_s": time_s,
            "available_s": time_s + self._config.latency_s,
            "east_m": east_m,
            "north_m": north_m,
            "heading_rad": heading_rad,
            "start_rad": (heading_rad + self._fan.first_rad) % math.tau,
        }
        if self._flawed:  # what is drawn at random is drawn now, scan by scan
            ranges = self._fan.ranges_m(faces, east_m, north_m, heading_rad)
            return RangeScan(ranges_m=self._degraded(ranges), **seen)
        face_m = nearest_face_m(faces.circles_m, faces.edges_m, east_m, north_m)
        if face_m > self._config.range_m:  # nothing to follow rays to
            seen["nearest_m"], seen["ranges_m"] = math.inf, self._fan.nothing
        else:
            seen["nearest_m"] = face_m
            seen["_follow"] = partial(self._fan.ranges_m, faces, east_m, north_m, heading_rad)
        return _Unread.of(seen)

    def _near(self, east: float, north: float, time: float) -> Surroundings:
        """All that is in range, from the neighbour list; this renews the list when it runs out."""
        skin = _SKIN * self._config.range_m
        listed_east, listed_north, listed_s = self._listed_at
        moved = math.hypot(east - listed_east, north - listed_north)
        listed = self._surroundings
        if listed is None or not (moved <= skin and listed_s <= time <= listed.until_s):
            reach = self._config.range_m + skin
            self._surroundings = listed = self._world.surroundings(
                east, north, reach, time, time + _HORIZON_S
            )
            self._listed_at = (east, north, time)
        return listed

    def _degraded(self, ranges: FloatArray) -> FloatArray:
        """Ranges with the imperfections of the sensor."""
        config, n = self._config, len(ranges)
        if config.range_noise_m > 0:
            ranges = np.maximum(ranges + config.range_noise_m * self._noise.standard_normal(n), 0.0)
            ranges[ranges > config.range_m] = math.inf
        if config.dropout > 0:
            ranges[self._dropout.random(n) < config.dropout] = math.inf
        if config.false_return > 0:
            chance, share = self._false_return.random((2, n))
            ranges = np.where(chance < config.false_return, config.range_m * (1.0 - share), ranges)
        return ranges


def _stream(root: np.random.SeedSequence, number: int) -> np.random.Generator:
    """The numbered child stream of a root, whatever was spawned from the root before."""
    key = (*root.spawn_key, number)
    return np.random.default_rng(
        np.random.SeedSequence(root.entropy, spawn_key=key, pool_size=root.pool_size)
    )


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
