"""Obstacles as they truly are: exact circles and polygons that may move, appear and disappear.

Frame: local ENU plane, x = east, y = north, metres; times are simulated seconds. A distance is to the edge of
an obstacle, negative inside it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.interface import FloatArray

_PAIRS_AT_ONCE = 1_000_000
"""At most this many distances between points and edges are computed together, to keep memory small."""
LEAST_M2 = float(np.finfo(np.float64).tiny)
"""An edge's length squared counts as at least this in a division: both its ends may be rounded to one place."""


@dataclass(frozen=True)
class Circle:
    """A disc.

    Attributes:
        center_m: (east, north).
        radius_m: greater than 0.

    Raises ValueError where a number is not finite or the radius not positive.
    """

    center_m: tuple[float, float]
    radius_m: float

    def __post_init__(self) -> None:
        if not (all(map(math.isfinite, (*self.center_m, self.radius_m))) and self.radius_m > 0):
            raise ValueError(f"a circle needs a finite centre and a positive radius; got {self}")

    @property
    def rounded_box(self) -> tuple[float, float, float, float, float]:
        """Centre east, centre north, half widths east and north, rounding radius: here only rounding."""
        return (*self.center_m, 0.0, 0.0, self.radius_m)

    @property
    def edges_m(self) -> FloatArray:
        """(4, 0): a circle has no straight edges."""
        return np.zeros((4, 0))

    def distance(self, east_m: FloatArray, north_m: FloatArray) -> FloatArray:
        """(k,) distances from points to the circle."""
        return np.hypot(east_m - self.center_m[0], north_m - self.center_m[1]) - self.radius_m


@dataclass(frozen=True)
class Polygon:
    """A simple polygon, convex or not, of either orientation. The last vertex of a ring joins the first.

    Attributes:
        vertices_m: (east, north) of each vertex.
        holes_m: rings inside of it within which it is free, each as `vertices_m`.

    Raises ValueError for fewer than three vertices, or a number that is not finite.
    """

    vertices_m: tuple[tuple[float, float], ...]
    holes_m: tuple[tuple[tuple[float, float], ...], ...] = ()

    def __post_init__(self) -> None:
        for ring in self.rings_m:
            if len(ring) < 3 or not np.isfinite(ring).all():
                raise ValueError(f"a polygon needs at least three finite vertices a ring; got {self}")

    @property
    def rings_m(self) -> tuple[tuple[tuple[float, float], ...], ...]:
        """The outline and then the holes."""
        return self.vertices_m, *self.holes_m

    @property
    def rounded_box(self) -> tuple[float, float, float, float, float]:
        """Centre east, centre north, half widths east and north, rounding radius: here not rounded."""
        east, north = zip(*self.vertices_m, strict=True)
        (xmin, ymin), (xmax, ymax) = (min(east), min(north)), (max(east), max(north))
        return ((xmin + xmax) / 2, (ymin + ymax) / 2, (xmax - xmin) / 2, (ymax - ymin) / 2, 0.0)

    @cached_property
    def edges_m(self) -> FloatArray:
        """(4, e) edges: start east, start north, end east, end north. Each ends where the next of its ring starts."""
        rings = [np.array(ring, dtype=np.float64) for ring in self.rings_m]
        edges = np.vstack([np.hstack((ring, np.roll(ring, -1, axis=0))) for ring in rings])
        edges_m: FloatArray = edges[(edges[:, :2] != edges[:, 2:]).any(axis=1)].T.copy()
        edges_m.setflags(write=False)
        return edges_m

    def distance(self, east_m: FloatArray, north_m: FloatArray) -> FloatArray:
        """(k,) distances from points to the nearest edge, negative inside.

        Inside follows from the count of edges that a ray crosses, holes included (Haines, Graphics Gems IV, 1994, I.4).
        """
        if len(east_m) > (rows := max(1, _PAIRS_AT_ONCE // self.edges_m.shape[1])):
            first = range(0, len(east_m), rows)
            return np.concatenate([self.distance(east_m[i : i + rows], north_m[i : i + rows]) for i in first])
        start_east, start_north, end_east, end_north = self.edges_m
        along_east, along_north = end_east - start_east, end_north - start_north
        from_east, from_north = east_m[:, None] - start_east, north_m[:, None] - start_north
        length_m2 = np.maximum(along_east**2 + along_north**2, LEAST_M2)
        share = (from_east * along_east + from_north * along_north) / length_m2
        share = np.minimum(np.maximum(share, 0.0), 1.0)
        off_east, off_north = from_east - share * along_east, from_north - share * along_north
        distance = np.sqrt((off_east * off_east + off_north * off_north).min(axis=1))
        straddled = (from_north >= 0) != (north_m[:, None] >= end_north)
        crossed = straddled & ((along_east * from_north > along_north * from_east) == (along_north > 0))
        return np.asarray(np.where(np.logical_xor.reduce(crossed, axis=1), -distance, distance))


@dataclass(frozen=True)
class Obstacle:
    """A solid body that stands or moves in a straight line, always or for some time.

    Attributes:
        shape: where it is at `epoch_s`.
        velocity_mps: (east, north).
        active_s: first and last time at which it is there, both included; None: always.
        heights_m: bottom and top above mean sea level, where they are known: for drawings, and for flights that
            climb; at the altitude of the mission it is there. Twice the same: terrain, cut at that height.

    Raises ValueError where a velocity or a first time is not finite.
    """

    shape: Circle | Polygon
    velocity_mps: tuple[float, float] = (0.0, 0.0)
    active_s: tuple[float, float] | None = None
    heights_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (*self.velocity_mps, self.epoch_s))):
            raise ValueError(f"an obstacle needs a finite velocity and first time; got {self}")

    @property
    def epoch_s(self) -> float:
        """Time (s) at which its motion starts: as it appears, or 0 if it is always there."""
        return self.active_s[0] if self.active_s else 0.0

    @property
    def stands_for_ever(self) -> bool:
        """Whether it neither moves nor comes or goes."""
        return self.active_s is None and self.velocity_mps == (0.0, 0.0)

    @property
    def interval_s(self) -> tuple[float, float]:
        """First and last time at which it is there, infinite if it always is."""
        return self.active_s or (-math.inf, math.inf)

    def displacement_m(self, time_s: float) -> tuple[float, float]:
        """(east, north) from `shape` to where it is at a time."""
        elapsed = time_s - self.epoch_s
        return self.velocity_mps[0] * elapsed, self.velocity_mps[1] * elapsed

    def distance(self, points_m: FloatArray, times_s: FloatArray) -> FloatArray:
        """(k,) distances from points (k, 2), each at its own time (k,); +inf while it is not there."""
        east, north = points_m[:, 0], points_m[:, 1]
        if self.velocity_mps != (0.0, 0.0):
            elapsed = times_s - self.epoch_s
            east, north = east - self.velocity_mps[0] * elapsed, north - self.velocity_mps[1] * elapsed
        distance = self.shape.distance(east, north)
        if self.active_s is None:
            return distance
        return np.where((self.active_s[0] <= times_s) & (times_s <= self.active_s[1]), distance, math.inf)
