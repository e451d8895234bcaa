"""Simulated scanning range sensor: rays against the true world, with its imperfections.

Frame: local ENU plane, x = east, y = north, metres. Bearings are radians clockwise from north. Whether and
where a ray hits is decided by correctly rounded operations on that ray and that face alone; bearings of faces
only choose which rays are tried, with a margin. So a face that is not hit cannot change any bit of a scan.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from harness.world import Surroundings, World

if TYPE_CHECKING:
    from harness.scenario_sections import Sensor

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

# The neighbour list reaches this part of the range further, and this far into the future.
_SKIN = 0.1
_HORIZON_S = 30.0
# Rays tried beyond the bearings of a face, in rays: more than bearings err, even at a tangent (1.5e-8 rad).
_MARGIN_RAYS = 1e-3


@dataclass(frozen=True, eq=False)
class RangeScan:
    """One scan; all arrays are copied and read-only.

    Attributes:
        time_s: when the sensor looked.
        available_s: when the scan may be used.
        east_m: sensor position.
        north_m: sensor position.
        start_rad: bearing of ray 0, clockwise from north, in [0, 2 pi).
        spacing_rad: bearing of each ray less that of the one before; positive, clockwise.
        directions: (n, 2) unit vectors (east, north) of the rays.
        ranges_m: (n,) measured ranges, +inf where nothing came back.
        max_range_m: no return is longer.
    """

    time_s: float
    available_s: float
    east_m: float
    north_m: float
    start_rad: float
    spacing_rad: float
    directions: FloatArray
    ranges_m: FloatArray
    max_range_m: float

    def __post_init__(self) -> None:
        for name in ("directions", "ranges_m"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.setflags(write=False)
            object.__setattr__(self, name, array)


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
        field_rad = math.radians(config.field_of_view_deg)
        self._spacing_rad = field_rad / config.rays
        self._first_rad = 0.5 * self._spacing_rad - field_rad / 2
        offsets = self._first_rad + self._spacing_rad * np.arange(config.rays)
        # A face may begin in this turn and reach into the next: it is tried as it is, and one turn back.
        self._turns = np.array([[0.0], [math.tau / self._spacing_rad]])
        self._fan_sin, self._fan_cos = np.sin(offsets), np.cos(offsets)
        self._noise, self._dropout, self._false_return = (
            _stream(seed_sequence, number) for number in range(3)
        )
        self._surroundings: Surroundings | None = None
        self._listed_at = (math.nan, math.nan, math.nan)

    def scan(self, east_m: float, north_m: float, heading_rad: float, time_s: float) -> RangeScan:
        """Looks around from a place, at a time."""
        sin, cos = math.sin(heading_rad), math.cos(heading_rad)
        rays = np.empty((2, self._config.rays))
        rays[0] = sin * self._fan_cos + cos * self._fan_sin
        rays[1] = cos * self._fan_cos - sin * self._fan_sin
        start_rad = (heading_rad + self._first_rad) % math.tau
        ranges = self._true_ranges(east_m, north_m, time_s, start_rad, rays)
        return RangeScan(
            time_s=time_s,
            available_s=time_s + self._config.latency_s,
            east_m=east_m,
            north_m=north_m,
            start_rad=start_rad,
            spacing_rad=self._spacing_rad,
            directions=rays.T,
            ranges_m=self._degraded(ranges),
            max_range_m=self._config.range_m,
        )

    def _near(self, east: float, north: float, time: float) -> Surroundings:
        """All that is in range, from the neighbour list; this renews the list when it runs out."""
        skin = _SKIN * self._config.range_m
        listed_east, listed_north, listed_s = self._listed_at
        moved = math.hypot(east - listed_east, north - listed_north)
        if self._surroundings is None or not (moved <= skin and 0 <= time - listed_s <= _HORIZON_S):
            reach = self._config.range_m + skin
            self._surroundings = self._world.surroundings(east, north, reach, time, time + _HORIZON_S)
            self._listed_at = (east, north, time)
        return self._surroundings

    def _true_ranges(
        self, east: float, north: float, time: float, start_rad: float, rays: FloatArray
    ) -> FloatArray:
        """(n,) ranges to the nearest face, +inf beyond the range."""
        faces = self._near(east, north, time).faces(time)
        ranges = np.full(rays.shape[1], math.inf)
        if faces.circles_m.shape[1]:
            self._hit_circles(ranges, rays, start_rad, faces.circles_m - np.array([[east], [north], [0.0]]))
        if faces.edges_m.shape[1]:
            self._hit_edges(ranges, rays, start_rad, faces.edges_m - np.array([[east], [north]] * 2))
        ranges[ranges > self._config.range_m] = math.inf
        return ranges

    def _hit_circles(
        self, ranges: FloatArray, rays: FloatArray, start_rad: float, circles: FloatArray
    ) -> None:
        """Lowers ranges to circles (3, c), centres relative to the sensor."""
        east, north, radius = circles
        away = np.sqrt(east * east + north * north)
        outside = away > radius
        half_rad = np.where(outside, np.arcsin(radius / np.maximum(away, radius)), math.pi)
        ray, face = self._tried(np.arctan2(east, north) - half_rad - start_rad, 2 * half_rad)
        ray_east, ray_north = rays.take(ray, axis=1)
        east, north, radius = circles.take(face, axis=1)
        along = east * ray_east + north * ray_north
        across = east * ray_north - north * ray_east
        under_root = radius * radius - across * across
        half_chord = np.sqrt(np.maximum(under_root, 0.0))
        distance = along + np.where(outside, -1.0, 1.0)[face] * half_chord
        distance[(under_root < 0) | (distance < 0)] = math.inf
        np.minimum.at(ranges, ray, distance)

    def _hit_edges(self, ranges: FloatArray, rays: FloatArray, start_rad: float, edges: FloatArray) -> None:
        """Lowers ranges to edges (4, e), ends relative to the sensor.

        A ray hits where the ends lie on different sides of it. Two edges that share a vertex agree about its
        side, so that no ray slips through between them.
        """
        start_east, start_north, end_east, end_north = edges
        turn = start_north * end_east - start_east * end_north
        dot = start_east * end_east + start_north * end_north
        width = np.arctan2(turn, dot)
        first_east, first_north = np.where(width < 0, edges[2:], edges[:2])
        ray, face = self._tried(np.arctan2(first_east, first_north) - start_rad, np.abs(width))
        ray_east, ray_north = rays.take(ray, axis=1)
        pair_start_east, pair_start_north, pair_end_east, pair_end_north = edges.take(face, axis=1)
        start_side = ray_east * pair_start_north - ray_north * pair_start_east
        end_side = ray_east * pair_end_north - ray_north * pair_end_east
        hit = np.flatnonzero((start_side >= 0) != (end_side >= 0))
        along_east, along_north = end_east - start_east, end_north - start_north
        lever = start_east * along_north - start_north * along_east
        distance = lever[face[hit]] / (end_side[hit] - start_side[hit])
        distance[distance < 0] = math.inf
        np.minimum.at(ranges, ray[hit], distance)

    def _tried(self, first_rad: FloatArray, width_rad: FloatArray) -> tuple[IntArray, IntArray]:
        """Rays between bearings.

        Args:
            first_rad: (m,) where each face begins, clockwise from ray 0.
            width_rad: (m,) how far it reaches clockwise from there.

        Returns:
            (p,) numbers of rays and (p,) numbers of faces: the pairs that may meet.
        """
        first = (first_rad % math.tau) / self._spacing_rad - self._turns
        last = first + width_rad / self._spacing_rad
        lowest = np.maximum(np.ceil(first - _MARGIN_RAYS), 0.0).astype(np.intp).ravel()
        highest = np.minimum(np.floor(last + _MARGIN_RAYS), self._config.rays - 1).astype(np.intp).ravel()
        counts = np.maximum(highest - lowest + 1, 0)
        pair = np.repeat(np.arange(len(counts)), counts)
        ray = np.arange(len(pair)) + (lowest - counts.cumsum() + counts)[pair]
        return ray, pair % len(first_rad)

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
