"""Waypoints of a mission one after the other, up to the next circle: how they are rounded, and their legs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from aircraft.guidance.mission_legs import MissionLeg, straight
from harness.run_files.given_path import SAME_PLACE_M, FloatArray, FlyBy, Tightest, fly_by
from harness.run_files.mission.flying import Flying, corner_limit_m
from harness.run_files.mission.items import GROUND, HOME, SEA
from harness.run_files.mission.steps import MissionStep


class Vertex(NamedTuple):
    """A place that is flown to.

    Attributes:
        place: east + i north.
        altitude_m: above mean sea level.
        item: number of its item; None where it has none, as where a circle is joined.
        acceptance_m: how far off it may be passed; 0 where its item does not say.
        agl_m: height above ground that is held on the way to it; None: the altitude is linear.
        centre: of the circle that it lies on, for which the aircraft heads.
    """

    place: complex
    altitude_m: float
    item: int | None
    acceptance_m: float = 0.0
    agl_m: float | None = None
    centre: complex | None = None


def rounded(run: Sequence[Vertex], speeds_mps: FloatArray, flying: Flying) -> FlyBy:
    """Lines and arcs through some waypoints, not all in one place.

    Args:
        run: the waypoints.
        speeds_mps: airspeed on the way to each.
        flying: what they are flown with.
    """
    points = np.array([(vertex.place.real, vertex.place.imag) for vertex in run])
    speeds = speeds_mps.tolist()
    radii = np.array([flying.turn_radius_m(speed) for speed in speeds])
    free = np.array([min(flying.free_cut_m, vertex.acceptance_m or math.inf) for vertex in run])
    tightest = None
    if flying.least_radius_m is not None:
        least = np.array([flying.least_radius_m(speed) for speed in speeds])
        limits = np.array([corner_limit_m(vertex.acceptance_m, flying.corner_m) for vertex in run])
        tightest = Tightest(least, limits, np.asarray(flying.wind_mps / speeds_mps, dtype=np.complex128))
    return fly_by(points, radii, free, overshoot=True, tightest=tightest)


def legs_of(run: Sequence[Vertex], stations_m: FloatArray) -> list[MissionLeg]:
    """The legs between waypoints; places that only mark where a circle is joined or left are passed.

    Args:
        run: the waypoints.
        stations_m: arc length of the route at each.
    """
    legs = []
    for (begin, end), along in zip(pairwise(run), pairwise(stations_m.tolist()), strict=True):
        if abs(end.place - begin.place) > SAME_PLACE_M:
            acceptance_m = 0.0 if end.item is None else end.acceptance_m or None
            legs.append(straight((begin.place, end.place), along, acceptance_m, end.centre))
    return legs


def altitude_m(step: MissionStep, home_altitude_m: float, ground_m: float, before_m: float) -> float:
    """Altitude of a step above mean sea level.

    Args:
        step: the step.
        home_altitude_m: of home, above mean sea level.
        ground_m: of the ground below it, above mean sea level; NaN where it is not known.
        before_m: of the step before, NaN at the first.
    """
    if step.height_m is None:
        return before_m if math.isfinite(before_m) else home_altitude_m
    base = {SEA: 0.0, HOME: home_altitude_m, GROUND: ground_m}[step.above]
    return step.height_m + base
