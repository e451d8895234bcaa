"""How close an aircraft stays to planned paths: random courses flown in JSBSim.

A course is a chain of lines and arcs as planners make them; no planner takes part.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from aircraft.airframe import Airframe
from aircraft.guidance.registry import DEFAULT_KIND
from aircraft.interface import Route
from aircraft.route import arc_point
from aircraft.start import Atmosphere
from harness.scenario.kinds import guidance_kinds

FIRST_COURSE_RAD: Final = 0.3  # first course, clockwise from north
TURNS: Final = 14  # number of turns of a course, where nothing else is said
TURN_DEG: Final = (20.0, 120.0)  # least and greatest angle of a turn
STRAIGHT_RADII: Final = (1.0, 4.0)  # least and greatest length of the line between two turns, in turn radii


class Tracking(NamedTuple):
    """Figures of how closely a course was flown: m, and a share of the time."""

    cross_track_p95_m: float
    cross_track_max_m: float
    altitude_p95_m: float
    bank_saturation: float


def course(seed: int, radius_m: float, turns: int = TURNS) -> Route:
    """Lines and arcs of 20 to 120 degrees, left and right, at one radius, from (0, 0) along `FIRST_COURSE_RAD`."""
    rng = np.random.default_rng((seed, 1))
    pieces = [(0.0, STRAIGHT_RADII[1] * radius_m)]
    for _ in range(turns):
        curvature = rng.choice((-1.0, 1.0)) / radius_m
        pieces.append((curvature, math.radians(rng.uniform(*TURN_DEG)) * radius_m))
        pieces.append((0.0, rng.uniform(*STRAIGHT_RADII) * radius_m))
    rows = []
    point = (0.0, 0.0, math.sin(FIRST_COURSE_RAD), math.cos(FIRST_COURSE_RAD))
    for curvature, length in pieces:
        rows.append((*point, curvature, length))
        point = arc_point(rows[-1], length)
    return Route(np.array(rows))


def fly_course(
    frame: Airframe, airspeed_mps: float, air: Atmosphere, route: Route, guidance: str = DEFAULT_KIND
) -> Tracking:
    """Flies a route at a true airspeed under a law at its defaults; ArithmeticError says how control is lost."""
    from aircraft import trials  # loads JSBSim

    law = guidance_kinds()[guidance].law(frame.guidance_limits(airspeed_mps))
    if (flown := trials.tracked(frame, airspeed_mps, law, route, air)).lost:
        raise ArithmeticError(f"{frame.name}: {flown.lost}")
    cross, altitude = (float(np.percentile(each, 95)) for each in (flown.cross_m, flown.altitude_m))
    return Tracking(cross, flown.most_m, altitude, flown.cut_share)
