"""How close an aircraft stays to planned paths: random courses flown in JSBSim, the worst of many.

A course is a chain of lines and arcs as planners make them, at the radius that planning uses in that air; no planner
takes part.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np

from aircraft.actuators import Actuators
from aircraft.airframe import Airframe
from aircraft.airframes import airframe
from aircraft.envelope import performance
from aircraft.guidance.registry import DEFAULT_KIND
from aircraft.interface import Route
from aircraft.route import arc_point
from aircraft.start import Atmosphere
from harness.scenario.kinds import guidance_kinds
from planner.kernel_cache import seal

FIRST_COURSE_RAD: Final = 0.3
TURNS: Final = 14
TURN_DEG: Final = (20.0, 120.0)
STRAIGHT_RADII: Final = (1.0, 4.0)
"""Least and greatest length of the line between two turns, in turn radii."""


@dataclass(frozen=True)
class Tracking:
    """How a course was flown, or the limits for it: m, and a share of the time."""

    cross_track_p95_m: float
    cross_track_max_m: float
    altitude_p95_m: float
    bank_saturation: float

    def within(self, limits: Tracking) -> bool:
        """Whether no figure is above its limit."""
        return self.worse(limits) == limits

    def worse(self, other: Tracking) -> Tracking:
        """The greater of each figure."""
        return Tracking(*map(max, zip(vars(self).values(), vars(other).values(), strict=True)))

    def times(self, factor: float) -> Tracking:
        """Limits for an aircraft that is coarser by a factor: bank is cut for 0.1 % more of the time for each."""
        across, most, altitude, saturation = vars(self).values()
        cut = saturation + 0.001 * max(factor - 1.0, 0.0)
        return Tracking(factor * across, factor * most, factor * altitude, cut)


@dataclass(frozen=True)
class Case:
    """One kind of air."""

    name: str
    limits: Tracking  # promised for the Aerosonde
    wind_share: float = 0.0  # steady wind over airspeed; its direction is drawn
    turbulence: str | None = None
    intensity: str | None = None

    def atmosphere(self, airspeed_mps: float, seed: int) -> Atmosphere:
        """The air of a seed."""
        towards = np.random.default_rng((seed, 2)).uniform(0.0, math.tau)
        wind = self.wind_share * airspeed_mps
        east, north = wind * math.sin(towards), wind * math.cos(towards)
        return Atmosphere(east, north, self.turbulence, self.intensity, seed)


CASES: Final = (
    Case("calm", Tracking(0.15, 0.35, 0.15, 0.0)),
    Case("wind 30 %", Tracking(0.20, 0.50, 0.15, 0.0), 0.3),
    Case("wind 50 %", Tracking(0.30, 0.80, 0.20, 0.0), 0.5),
    Case("moderate Tustin", Tracking(0.50, 2.0, 1.0, 0.0), 0.0, "tustin", "moderate"),
    Case("moderate Milspec", Tracking(0.50, 2.0, 1.0, 0.0), 0.0, "milspec", "moderate"),
    Case("severe, wind 30 %", Tracking(1.0, 4.0, 2.0, 0.05), 0.3, "tustin", "severe"),
)
LIMIT_FACTORS: Final = {
    "aerosonde": 1.0,
    **dict.fromkeys(("c172p", "c172x", "t6texan2"), 4.0),
    **dict.fromkeys(("c172r", "DHC6", "OV10", "T38", "A4", "F80C", "F4N", "A320", "B747"), 8.0),
    **dict.fromkeys(("T37", "f15", "f16", "787-8", "MD11", "global5000", "737"), 16.0),
}
"""By how much the limits of the Aerosonde are multiplied, for the aircraft whose tracking is verified: the least of 1,
4, 8 and 16 of which no more than two thirds is flown; of the 737's altitude in severe turbulence 0.78 of 16."""
ALTITUDE_NOT_HELD: Final = frozenset({("f15", "severe"), ("F80C", "severe")})
"""Aircraft and turbulence in which thrust does not suffice: nothing is promised of the altitude there."""


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
    flown = trials.tracked(frame, airspeed_mps, law, route, air)
    if flown.lost:
        raise ArithmeticError(f"{frame.name}: {flown.lost}")
    cross, altitude = (float(np.percentile(each, 95)) for each in (flown.cross_m, flown.altitude_m))
    return Tracking(cross, flown.most_m, altitude, flown.cut_share)


def tracked(
    name: str,
    case: Case,
    seeds: Sequence[int],
    airspeed_mps: float | None = None,
    guidance: str = DEFAULT_KIND,
    actuators: Actuators | None = None,
) -> Tracking:
    """The worst of the courses of some seeds, each at the radius that planning uses for `preview` in that air."""
    seal()
    frame = airframe(name, actuators)
    speed = airspeed_mps or frame.cruise_mps
    worst = Tracking(0.0, 0.0, 0.0, 0.0)
    for seed in seeds:
        air = case.atmosphere(speed, seed)
        radius_m = performance(frame, speed, air.wind_mps, air.intensity).turn_radius_m
        worst = worst.worse(fly_course(frame, speed, air, course(seed, radius_m), guidance))
    return worst


def bench_tracking(
    name: str,
    seeds: int,
    progress: Callable[[int, int, str], None] | None = None,
    guidance: str = DEFAULT_KIND,
) -> dict[str, Any]:
    """Flies every case; AircraftError if the aircraft cannot be flown in one of them.

    Each of `cases` has the figures of `Tracking`, worst over the seeds, its `limits` likewise (None where nothing is
    promised), whether they are `kept`, and how control was `lost`: then the figures are None.
    """
    factor = LIMIT_FACTORS.get(name) if guidance == DEFAULT_KIND else None
    rows = []
    for done, case in enumerate(CASES):
        if progress is not None:
            progress(done, len(CASES), case.name)
        limits = (
            case.limits.times(factor) if factor and (name, case.intensity) not in ALTITUDE_NOT_HELD else None
        )
        row: dict[str, Any] = {"case": case.name, "limits": vars(limits) if limits else None, "lost": None}
        try:
            flown = tracked(name, case, range(1, seeds + 1), guidance=guidance)
        except ArithmeticError as error:
            row |= {**{each.name: None for each in fields(Tracking)}, "kept": False, "lost": str(error)}
        else:
            row |= {**vars(flown), "kept": flown.within(limits) if limits else None}
        rows.append(row)
    told = {"aircraft": name, "guidance": guidance, "airspeed_mps": airframe(name).cruise_mps}
    return {**told, "seeds": seeds, "cases": rows}
