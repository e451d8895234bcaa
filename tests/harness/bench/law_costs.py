"""What a guidance law costs over bare JSBSim: `python -m tests.harness.bench.law_costs`.

Each law is asked again for what it said on a course of 14 turns of the Aerosonde, state by state, in turns with bare
`run()` of as much flight at 120 steps a second. Of many turns the fastest of each counts. Prints a row for each law:
microseconds an update and the share of bare JSBSim; exits with 1 where a law on its path is above `MOST`.
"""

from __future__ import annotations

import sys
import time
from typing import Final

from aircraft.airframes import airframe
from aircraft.envelope import performance
from aircraft.frames import LocalPlane
from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLaw
from aircraft.guidance.registry import guidance_kinds
from aircraft.guidance.waypoints import WaypointLaw, acceptance
from aircraft.interface import AircraftState, Route
from aircraft.jsbsim_model import JsbsimModel
from aircraft.start import StartConditions
from harness.bench.tracking import ALTITUDE_M, COURSE_RAD, course
from tests.closed_loop.laws_table import FLOWN

MOST: Final = 0.03
BARE_RATE_HZ = 120
FLIGHT_S, ROUNDS = 60, 40
"""Simulated seconds of a turn, and how many turns."""


def model(step_rate_hz: int) -> JsbsimModel:
    """The Aerosonde at the start of the course."""
    frame = airframe("aerosonde")
    start = StartConditions(0.0, 0.0, ALTITUDE_M, COURSE_RAD, frame.cruise_mps)
    return JsbsimModel(frame, start, LocalPlane(47.0, 8.0), step_rate_hz=step_rate_hz)


def law_of(kind: str, follow: str) -> GuidanceLaw:
    """A law at its defaults, on the path or on its waypoints."""
    limits, known = airframe("aerosonde").guidance_limits(), guidance_kinds()[kind]
    law = known.law(limits)
    if follow == "path":
        return law
    return WaypointLaw(law, acceptance(kind, known.config().resolved(limits), limits))


def states(law: GuidanceLaw, route: Route) -> list[AircraftState]:
    """What the law is told on its way."""
    flown, told = model(60), []
    law.follow(route)
    for _ in range(FLIGHT_S * UPDATE_RATE_HZ):
        told.append(flown.state())
        flown.command(law.update(told[-1]).roll_command_rad, ALTITUDE_M, 25.0)
        flown.advance(flown.step_rate_hz // UPDATE_RATE_HZ)
    return told


def seconds(law: GuidanceLaw, route: Route, told: list[AircraftState]) -> float:
    """Processor time of all updates of a flight."""
    law.follow(route)
    update, begun = law.update, time.thread_time()
    for state in told:
        update(state)
    return time.thread_time() - begun


def main() -> int:
    route = course(1, performance(airframe("aerosonde"), 25.0).turn_radius_m)
    laws = {(kind, follow): law_of(kind, follow) for kind, follow in FLOWN}
    told = {name: states(law, route) for name, law in laws.items()}
    bare, bare_s, least = model(BARE_RATE_HZ), float("inf"), dict.fromkeys(laws, float("inf"))
    for _ in range(ROUNDS):
        begun = time.thread_time()
        bare.advance(FLIGHT_S * BARE_RATE_HZ)
        bare_s = min(bare_s, time.thread_time() - begun)
        for name, law in laws.items():
            least[name] = min(least[name], seconds(law, route, told[name]))
    print(
        f"bare run(): {1e6 * bare_s / FLIGHT_S / BARE_RATE_HZ:.1f} us a step, {1e3 * bare_s / FLIGHT_S:.2f} ms a second"
    )
    print("| law | us an update | share of bare JSBSim |")
    for (kind, follow), cost_s in least.items():
        row = f"`{kind}`" if follow == "path" else f"`{kind}`, {follow}"
        print(f"| {row} | {1e6 * cost_s / FLIGHT_S / UPDATE_RATE_HZ:.1f} | {cost_s / bare_s:.3f} |")
    dear = [law for (law, follow), cost_s in least.items() if follow == "path" and cost_s > MOST * bare_s]
    return 1 if dear else 0


if __name__ == "__main__":
    sys.exit(main())
