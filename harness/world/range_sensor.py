"""Simulated scanning range sensor: beams against the true world, with its imperfections.

Frame: local ENU plane, x = east, y = north, metres. Bearings are radians clockwise from north. What a beam meets is
found in `harness.world.ray_casting`: a face that is not met cannot change any bit of a scan.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.mapping.scan import RangeScan
from harness.world.ray_casting import Fan, nearest_face_m
from harness.world.world import Surroundings, World
from planner.interface import FloatArray

if TYPE_CHECKING:
    from harness.scenario.sections import Sensor


_SKIN_SHARE = 0.25
"""The list of obstacles near the aircraft reaches further than the sensor's range by this share of it."""
_HORIZON_S = 30.0  # the list holds obstacles that come near within this time; after it the list is made anew


class _LazyScan(RangeScan):
    """A scan whose ranges are computed when they are first read, since few scans are ever read."""

    @classmethod
    def of(cls, attributes: dict[str, Any]) -> _LazyScan:
        """Makes a scan of its attributes by name; instead of the ranges there may be `_follow`, which computes them."""
        scan = cls.__new__(cls)
        # At once: a frozen dataclass would set them one by one, and that is most of the cost of a scan.
        object.__setattr__(scan, "__dict__", attributes)
        return scan

    def __getattr__(self, name: str) -> FloatArray:
        """Computes the ranges when they are first read."""
        if name != "ranges_m":
            raise AttributeError(name)
        ranges: FloatArray = self.__dict__.pop("_follow")()
        ranges.setflags(write=False)
        self.__dict__[name] = ranges
        return ranges


class RangeSensor:
    """A fan of beams, centred on the nose of the aircraft.

    A beam returns the distance to the nearest obstacle edge within its width, if that is not further than the range;
    inside an obstacle that is the nearest way out. Then, in this order:

    1. Noise: a Gaussian error is added to each range; a negative one becomes 0, one beyond the range is lost.
    2. Dropout: the beam returns nothing.
    3. False return: the beam returns a range uniform in (0, range], whatever there was.

    Each imperfection draws from a stream of its own, for every beam of every scan, so that neither what is
    seen nor another imperfection shifts its draws; one that is off draws nothing. The root of the three streams,
    `seed_sequence`, is not changed.
    """

    def __init__(self, world: World, config: Sensor, seed_sequence: np.random.SeedSequence) -> None:
        self._world = world
        self._config = config
        beam_rad = None if config.beam_deg is None else math.radians(config.beam_deg)
        self._fan = Fan(math.radians(config.field_of_view_deg), config.rays, config.range_m, beam_rad)
        self._always: dict[str, Any] = {
            "spacing_rad": self._fan.spacing_rad,
            "beam_rad": self._fan.beam_rad,
            "fan": self._fan.rays,
            "max_range_m": config.range_m,
            "noise_m": config.range_noise_m,
            "lossy": config.dropout > 0.0,
        }
        self._noise, self._dropout, self._false_return = (child_stream(seed_sequence, number) for number in range(3))
        self._flawed = config.range_noise_m > 0 or config.dropout > 0 or config.false_return > 0
        self._surroundings: Surroundings | None = None
        self._listed_at = (math.nan, math.nan, math.nan)

    def scan(self, east_m: float, north_m: float, heading_rad: float, time_s: float) -> RangeScan:
        """Takes a scan from a place at a time; ranges without errors are computed when they are first read."""
        faces = self._nearby(east_m, north_m, time_s).faces(time_s)
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
            return RangeScan(ranges_m=self._degrade(ranges), **seen)
        face_m = nearest_face_m(faces.circles_m, faces.edges_m, east_m, north_m)
        if face_m > self._config.range_m:  # nothing to follow rays to
            seen["nearest_m"], seen["ranges_m"] = math.inf, self._fan.nothing
        else:
            seen["nearest_m"] = face_m
            seen["_follow"] = partial(self._fan.ranges_m, faces, east_m, north_m, heading_rad)
        return _LazyScan.of(seen)

    def _nearby(self, east: float, north: float, time: float) -> Surroundings:
        """Returns all faces in range, from the neighbour list, which is renewed when it runs out."""
        skin = _SKIN_SHARE * self._config.range_m
        listed_east, listed_north, listed_s = self._listed_at
        moved = math.hypot(east - listed_east, north - listed_north)
        listed = self._surroundings
        if listed is None or not (moved <= skin and listed_s <= time <= listed.until_s):
            self._surroundings = listed = self._world.surroundings(
                east, north, self._config.range_m + skin, time, time + _HORIZON_S
            )
            self._listed_at = (east, north, time)
        return listed

    def _degrade(self, ranges: FloatArray) -> FloatArray:
        """Adds the imperfections of the sensor to ranges: noise, lost returns, false returns."""
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


def child_stream(root: np.random.SeedSequence, number: int) -> np.random.Generator:
    """Returns the numbered child stream of a root, which does not depend on what was spawned before."""
    key = (*root.spawn_key, number)
    child = np.random.SeedSequence(root.entropy, spawn_key=key, pool_size=root.pool_size)
    return np.random.default_rng(child)
