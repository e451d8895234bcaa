"""Waypoints of a mission one after the other, up to the next circle: how they are flown and rounded."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from aircraft.guidance.altitude import VerticalProfile
from aircraft.guidance.waypoints import MissionLeg, straight
from aircraft.interface import FloatArray
from harness.files.mavlink.items import GROUND, HOME, SEA
from harness.run_files.given_path import SAME_PLACE_M, FlyBy, Tightest, fly_by
from harness.run_files.mission.program import MissionStep

Ground = Callable[[FloatArray, FloatArray], FloatArray]  # height above the sea at east and north, or NaN
CORNER_M: Final = 90.0  # the limit of a waypoint without an acceptance radius: ArduPilot Plane's WP_RADIUS
FOLLOWED_M: Final = 50.0  # along a leg above ground, the ground is looked up at this spacing


def corner_limit_m(acceptance_m: float, corner_m: float | None) -> float:
    """Returns how far off a waypoint may be passed: `corner_m` for all, else its own acceptance, else `CORNER_M`."""
    return corner_m if corner_m is not None else acceptance_m or CORNER_M


@dataclass(frozen=True)
class Flying:
    """The aircraft's figures that a mission's route depends on.

    The airspeed is that before the mission says otherwise, the range what the aircraft holds. Functions of the airspeed
    are the turn radius with bank in hand, the fastest climb and descent, and the least radius, at the bank limit in
    calm air. A corner may be passed at `free_cut_m` only to make its arc wider, and at `corner_m`, by default as its
    item says, at the most. Without `ground` it is as high as home. Where it `heads_for_centres`, the aircraft flies
    towards the centre of a loiter up to its circle, else along a tangent. Winds are east and north (m, 2).
    """

    airspeed_mps: float
    airspeed_range_mps: tuple[float, float]
    turn_radius_m: Callable[[float], float]
    climb_mps: Callable[[float], tuple[float, float]]
    free_cut_m: float
    least_radius_m: Callable[[float], float]
    ground: Ground | None = None
    heads_for_centres: bool = False
    corner_m: float | None = None
    kept_radii: Callable[[float], float] = lambda airspeed_mps: 1.0
    winds: Callable[[FloatArray, FloatArray], FloatArray] = lambda points_m, up_m: np.zeros_like(points_m)


class Vertex(NamedTuple):
    """A place that is flown to, east + i north, at an altitude above mean sea level.

    Where a circle is joined it has no item. An acceptance of 0 is that of an item that does not say. A height above
    ground (`agl_m`) is held on the way to it, else the altitude is linear. The centre is that of the circle that it
    lies on and for which the aircraft heads. The mission asks for `commanded_mps` on the way to it.
    """

    place: complex
    altitude_m: float
    item: int | None
    acceptance_m: float = 0.0
    agl_m: float | None = None
    centre: complex | None = None
    commanded_mps: float = 0.0
    airspeed_mps: float = 0.0


@dataclass(frozen=True, eq=False)
class MissionRoute:
    """A mission as it is flown: lines and arcs, whose corners have the numbers of their items, altitude and airspeed.

    The aircraft may not hold the airspeeds `commanded_mps` of the mission. Marks are item and arc length where
    each is reached, legs are for a law that flies to waypoints, notes say what was assumed.
    """

    way: FlyBy
    profile: VerticalProfile
    commanded_mps: FloatArray
    marks: tuple[tuple[int, float], ...]
    notes: tuple[str, ...]
    legs: tuple[MissionLeg, ...]
    over_unknown: tuple[int, ...]  # items above ground that is not known there, or on the way to them


def rounded(run: Sequence[Vertex], flying: Flying) -> FlyBy:
    """Returns lines and arcs through waypoints, not all in one place."""
    points = np.array([(vertex.place.real, vertex.place.imag) for vertex in run])
    speeds = [vertex.airspeed_mps for vertex in run]
    wide = np.array([flying.turn_radius_m(each) for each in speeds])
    least, kept = np.array([(flying.least_radius_m(each), flying.kept_radii(each)) for each in speeds]).T
    free = np.array([min(flying.free_cut_m, vertex.acceptance_m or math.inf) for vertex in run])
    limits = np.array([corner_limit_m(vertex.acceptance_m, flying.corner_m) for vertex in run])
    wind = flying.winds(points, np.array([each.altitude_m for each in run])) @ np.array((1.0, 1j)) / speeds
    return fly_by(points, wide, free, Tightest(least, limits, wind, kept), every=True)


def legs_of(run: Sequence[Vertex], stations_m: FloatArray) -> list[MissionLeg]:
    """Returns the legs between waypoints, by arc lengths; a place where a circle is joined has no acceptance."""
    return [
        straight((a.place, b.place), along, 0.0 if b.item is None else b.acceptance_m or None, b.centre)
        for (a, b), along in zip(pairwise(run), pairwise(stations_m.tolist()), strict=True)
        if abs(b.place - a.place) > SAME_PLACE_M
    ]


def altitude_m(step: MissionStep, home_altitude_m: float, ground_m: float, before_m: float) -> float:
    """Returns the altitude of a step above mean sea level, from home, the ground below, and the step before or NaN."""
    if step.height_m is None:
        return before_m if math.isfinite(before_m) else home_altitude_m
    return step.height_m + {SEA: 0.0, HOME: home_altitude_m, GROUND: ground_m}[step.above]


def without_steps(points: Sequence[tuple[float, float]], slope: Callable[[], float]) -> list[tuple[float, float]]:
    """Turns two altitudes at one place along a route into a ramp, on which the aircraft climbs or sinks afterwards.

    At the end of the route it does so before. A ramp that would be longer than the way to the next altitude goes there.
    Points, as many as before, are arc length, not falling, and altitude (m); the slope is asked for where it is needed.
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
            ramped[-1] = (max(before - run, ramped[-2][0] if len(ramped) > 1 else before), height)
            ramped.append((along, high))
        else:
            ramped.append((before + run, high) if before + run < after else (before, height))
    return ramped


def above_ground(
    ends: tuple[Vertex, Vertex], stations_m: tuple[float, float], ground_m: Callable[[complex], float]
) -> list[tuple[float, float]]:
    """Returns altitudes on the way to a waypoint that is above ground: above it all the way, as ArduPilot flies it."""
    (begin, end), (begin_m, end_m) = ends, stations_m
    assert end.agl_m is not None
    begin_agl_m = begin.altitude_m - ground_m(begin.place)
    above = []
    for share in np.linspace(0.0, 1.0, 1 + math.ceil((end_m - begin_m) / FOLLOWED_M))[1:-1].tolist():
        height = begin_agl_m + share * (end.agl_m - begin_agl_m)
        ground = ground_m(begin.place + share * (end.place - begin.place))
        above.append((begin_m + share * (end_m - begin_m), ground + height))
    return above
