"""The tables of the fleet in aircraft/MEASURED.md: `python -m tests.closed_loop.fleet_table LOG [AIRCRAFT...]`.

Every listed aircraft flies a world under every law in six airs. The worlds are the same in units of the turn radius
that planners get for the aircraft in that air: discs, clearance, which is written and so makes the limits, and sensing
range, which grows with the radius that the law needs. LOG gets a line of JSON for each flight; what it has already is
not flown again. Then it prints a row for each aircraft and for each air, with a cell for each law: goals reached, and
flown within the limits all the way, of the worlds flown; at last what was not as it should be.
"""

import json
import math
import sys
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from aircraft.airframe import Airframe
from aircraft.airframes import airframe
from aircraft.envelope import performance
from aircraft.law_cards import law_card
from harness.analysis.metrics import metrics
from harness.flight.closed_loop import fly
from harness.run.scenario_flight import flight_limits, make_loop
from harness.scenario.kinds import guidance_kinds
from harness.scenario.scenario import scenario_of
from tests.closed_loop.courses_table import CASES
from tests.closed_loop.tables import line, upper
from wayproof import AircraftError, InputError, Scenario

LAWS: Final = ("preview", "npfg", "l1", "vector_field", "pure_pursuit", "bearing")
AIRS: Final = {case.name: case for case in CASES if case.limits}
SEEDS: Final = (1,)
WIDE, HIGH, DISCS = 28.0, 20.0, 6  # size of the area and number of discs; all lengths are in turn radii
ROOM, GAP = 4.0, 5.5
"""No disc is nearer to start and goal, and to another disc, than this: a law that tracks worse has wider turns."""
CLEARANCE, RANGE = 0.5, 6.0  # the sensing range is in turn radii that the aircraft has under the law


class Flown(NamedTuple):
    """What the table needs of a flight."""

    aircraft: str
    law: str
    air: str
    seed: int
    outcome: str
    reason: str
    clearance_share: float
    cross_track_m: float
    altitude_error_m: float
    causes: str  # why legs were not trackable; empty where all were

    @property
    def good(self) -> bool:
        """Reached, at the wanted clearance but for the tolerance of tracking, every leg trackable."""
        return self.outcome == "reached" and self.clearance_share >= 0.9 and not self.causes


def discs(seed: int) -> list[tuple[float, float, float]]:
    """East, north and radius of the discs of a world, in turn radii; the first lies on the straight way."""
    rng = np.random.default_rng((seed, 5))
    ends = ((2.0, 0.5 * HIGH), (WIDE - 2.0, 0.5 * HIGH))
    placed: list[tuple[float, float, float]] = []
    while len(placed) < DISCS:
        east, north, radius = rng.uniform((0.0, 0.0, 0.4), (WIDE, HIGH, 1.5)).tolist()
        if not placed:
            north = 0.5 * HIGH + rng.uniform(-0.5, 0.5) * radius
        clear = all(math.dist(end, (east, north)) >= radius + ROOM for end in ends)
        if clear and all(math.dist((east, north), (x, y)) >= radius + r + GAP for x, y, r in placed):
            placed.append((east, north, radius))
    return placed


def scaled(frame: Airframe, law: str, air: str, seed: int, range_radii: float = RANGE) -> Scenario:
    """A world at the scale of an aircraft in an air, wind from the left; InputError if it cannot fly it."""
    case, speed = AIRS[air], frame.cruise_mps
    wind_mps = case.wind_share * speed
    radius_m = performance(frame, speed, wind_mps, case.intensity).turn_radius_m
    card = law_card(frame, guidance_kinds()[law], guidance_kinds()[law].config())
    with_law_m = performance(frame, speed, wind_mps, case.intensity, law=card).turn_radius_m
    environment: dict[str, Any] = {"wind": {"speed_mps": wind_mps, "from_deg": 0.0}} if wind_mps else {}
    if case.intensity:
        environment["turbulence"] = {"model": case.turbulence, "intensity": case.intensity}

    def metres(*radii: float) -> list[float]:
        return [round(radius_m * each, 2) for each in radii]

    def at(east: float, north: float) -> list[float]:
        """The origin of the local plane lies in the middle of the area: the plane is right up to its corners."""
        return metres(east - 0.5 * WIDE, north - 0.5 * HIGH)

    keys: dict[str, Any] = {
        "schema": "wayproof/scenario/1",
        "name": f"fleet-{seed}",
        "seed": seed,
        "area": {"bounds_m": [*at(0.0, 0.0), *at(WIDE, HIGH)]},
        "obstacles": [
            {"circle": {"center_m": at(east, north), "radius_m": metres(radius)[0]}}
            for east, north, radius in discs(seed)
        ],
        "mission": {"start_m": at(2.0, 0.5 * HIGH), "course_deg": 90.0, "goal_m": at(WIDE - 2.0, 0.5 * HIGH)},
        "aircraft": {"model": frame.name, "airspeed_mps": frame.cruise_mps},
        "sensor": {"range_m": round(range_radii * with_law_m, 2)},
        "planner": {"clearance_m": metres(CLEARANCE)[0]},
        "guidance": {"kind": law},
        "environment": environment,
    }
    return scenario_of(keys)


def flown(name: str, law: str, air: str, seed: int, range_radii: float = RANGE) -> Flown:
    """A world flown; what an aircraft cannot fly ends as `refused`."""
    try:
        scenario = scaled(airframe(name), law, air, seed, range_radii)
        loop = make_loop(scenario)
    except (InputError, AircraftError) as error:
        return Flown(name, law, air, seed, "refused", str(error), math.nan, math.nan, math.nan, "")
    flight = fly(loop)
    track, told = flight.track, metrics(flight, flight_limits(scenario))
    share = min(float(track.clearance_m.min()), flight.contact_m) / float(scenario.planner.clearance_m or 0.0)
    off_m = float(np.abs(track.cross_track_m[track.plan_index >= 0]).max(initial=0.0))
    high_m = float(np.abs(track.up_m - scenario.mission.altitude_m).max())
    causes = {leg["cause"] for leg in told["trackability"] if not leg["trackable"]}
    ended = flight.outcome.value, flight.reason
    return Flown(name, law, air, seed, *ended, share, off_m, high_m, ", ".join(sorted(causes)))


def table(title: str, key: int, flights: list[Flown]) -> None:
    laws = [law for law in LAWS if any(each.law == law for each in flights)]
    print("", line(title, *(f"`{law}`" for law in laws)), sep="\n")
    for value in [*dict.fromkeys(each[key] for each in flights), "all"]:
        rows = [each for each in flights if value in (each[key], "all")]
        cells = [[each for each in rows if each.law == law] for law in laws]
        reached = [[each for each in cell if each.outcome == "reached"] for cell in cells]
        told = (
            f"{len(there)}, {sum(not each.causes for each in there)} of {len(cell)}"
            for there, cell in zip(reached, cells, strict=True)
        )
        print(line(str(value), *told))


def main(log: Path, names: list[str]) -> int:
    lines = log.read_text().splitlines() if log.exists() else []
    known = {(each := Flown(**json.loads(line)))[:4]: each for line in lines}
    for key in ((name, law, air, seed) for seed in SEEDS for name in names for air in AIRS for law in LAWS):
        if key not in known:
            known[key] = flown(*key)
            with log.open("a") as file:
                file.write(json.dumps(known[key]._asdict()) + "\n")
    flights = list(known.values())
    hit = sum(each.outcome == "collision" for each in flights)
    count = sum(each.outcome != "refused" for each in flights)
    print(f"{hit} of {count} flights hit an obstacle: less than {upper(hit, count):.2%} at 95 %")
    table("aircraft", 0, flights)
    table("air", 2, flights)
    for each in flights:
        if not each.good:
            said = f"{each.outcome}: {each.reason}; clearance {each.clearance_share:.2f}"
            print(f"  {each.aircraft}, {each.law}, {each.air}: {said}; not tracked: {each.causes or 'none'}")
    return 1 if hit else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2:]))
