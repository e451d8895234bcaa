"""Courses under one law in six airs: `python -m tests.closed_loop.courses_table AIRCRAFT [LAW] [SEEDS]`.

Prints the worst of the courses of some seeds in each air: p95 and largest cross-track error, p95 of the altitude error,
m, the share of the time for which the bank is cut, and whether the limits are kept, where an aircraft has some.
"""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from aircraft.actuators import Actuators
from aircraft.airframes import airframe
from aircraft.envelope import performance
from aircraft.guidance.registry import DEFAULT_KIND
from aircraft.start import Atmosphere
from harness.bench.tracking import Tracking, course, fly_course
from planner.kernel_cache import seal
from tests.closed_loop.tables import head, line


def within(flown: Tracking, limits: Tracking) -> bool:
    return all(figure <= limit for figure, limit in zip(flown, limits, strict=True))


def times(limits: Tracking, factor: float) -> Tracking:
    """Limits for an aircraft that is coarser by a factor: bank is cut for 0.1 % more of the time for each."""
    across, most, altitude, saturation = limits
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
        flown = fly_course(frame, speed, air, course(seed, radius_m), guidance)
        worst = Tracking(*map(max, zip(worst, flown, strict=True)))
    return worst


def main(name: str, guidance: str = DEFAULT_KIND, seeds: str = "20") -> None:
    print("\n".join(head("air", "cross-track p95 / max, m", "altitude p95, m", "bank cut", "limits")))
    factor = LIMIT_FACTORS.get(name) if guidance == DEFAULT_KIND else None
    for case in CASES:
        try:
            flown = tracked(name, case, range(1, int(seeds) + 1), guidance=guidance)
        except ArithmeticError as error:
            print(line(case.name, str(error)))
            continue
        limited = factor and (name, case.intensity) not in ALTITUDE_NOT_HELD
        kept = "kept" if limited and within(flown, times(case.limits, factor or 1.0)) else "not kept"
        cross, most, altitude, cut = flown
        figures = f"{cross:.3f} / {most:.3f}", f"{altitude:.3f}", f"{cut:.1%}"
        print(line(case.name, *figures, kept if limited else "none"))


if __name__ == "__main__":
    main(*sys.argv[1:])
