"""Waypoints of a mission one after the other, up to the next circle: how they are rounded, and their legs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from aircraft.guidance.mission_legs import MissionLeg, straight
from harness.run_files.given_path import SAME_PLACE_M, FloatArray, FlyBy, Tightest, fly_by
from harness.run_files.mission.flying import Flying, corner_limit_m
from harness.run_files.mission.items import GROUND, HOME, SEA
from harness.run_files.mission.steps import MissionStep

FOLLOWED_M: Final = 50.0
"""The ground is looked up so often along a leg whose altitude is above it."""


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
    return fly_by(points, radii, free, overshoot=True, tightest=tightest, every=True)


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


def without_steps(
    points: Sequence[tuple[float, float]], slope: Callable[[], float]
) -> list[tuple[float, float]]:
    """Altitudes along a route, where two at one place are a ramp: the aircraft climbs or sinks on the way on.

    At the end of the route it does so before. A ramp that would be longer than the way to the next altitude goes there.
    There are as many altitudes as before.

    Args:
        points: arc length, not falling, and altitude (m).
        slope: of a ramp; asked for where there is one.
    """
    ramped = [points[0]]
    for number, (along, high) in enumerate(points[1:], start=1):
        before, height = ramped[-1]
        if along - before > SAME_PLACE_M or high == height:
            ramped.append((along, high))
            continue
        run = abs(high - height) / slope()
        after = next((place for place, _ in points[number:] if place > along + SAME_PLACE_M), None)
        if after is None:
            earlier = ramped[-2][0] if len(ramped) > 1 else before
            ramped[-1] = (max(before - run, earlier), height)
            ramped.append((along, high))
        else:
            ramped.append((before + run, high) if before + run < after else (before, height))
    return ramped


def followed(
    ends: tuple[Vertex, Vertex], stations_m: tuple[float, float], ground_m: Callable[[complex], float]
) -> list[tuple[float, float]]:
    """Altitudes on the way to a waypoint that is above ground: above it all the way, as ArduPilot flies it.

    Args:
        ends: of the leg; the second has a height above ground.
        stations_m: arc lengths at both.
        ground_m: height of the ground at a place.
    """
    (begin, end), (begin_m, end_m) = ends, stations_m
    assert end.agl_m is not None
    begin_agl_m = begin.altitude_m - ground_m(begin.place)
    above = []
    for share in np.linspace(0.0, 1.0, 1 + math.ceil((end_m - begin_m) / FOLLOWED_M))[1:-1].tolist():
        height = begin_agl_m + share * (end.agl_m - begin_agl_m)
        ground = ground_m(begin.place + share * (end.place - begin.place))
        above.append((begin_m + share * (end_m - begin_m), ground + height))
    return above
