"""The table of the fleet in aircraft/MEASURED.md: `python -m tests.closed_loop.fleet_table [LOG] [AIRCRAFT...]`.

Every listed aircraft flies worlds that are the same in units of its own turn radius in calm air: discs, clearance, and
the sensing range, which grows with the radius that the law needs. Prints a row for each aircraft, with a cell for each
law and air: goals reached of the worlds flown, collisions, the least distance from an obstacle over the wanted
clearance, and the largest cross-track error (m); then every flight that was not as it should be, and exits with 1 where
there is one. LOG is a file that gets a line of JSON for each flight; what it has already is not flown again.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from aircraft.airframe import Airframe
from aircraft.airframes import AircraftError, aircraft_names, airframe
from aircraft.envelope import performance
from aircraft.guidance.registry import guidance_kinds
from aircraft.law_cards.cards import law_card
from harness.analysis.metrics import metrics
from harness.files.strict_yaml import InputError
from harness.flight.closed_loop import fly
from harness.run.scenario_flight import flight_limits, make_loop
from harness.scenario.scenario import Scenario, scenario_of

LAWS: Final = ("preview", "npfg")
WIND_SHARES: Final = (0.0, 0.3)
SEEDS: Final = (1, 2, 3)
WIDE, HIGH, DISCS = 44.0, 24.0, 10
"""Size of the area and number of discs; all lengths are in turn radii."""
ROOM, GAP = 4.0, 5.5
"""No disc is nearer to start and goal, and to another disc, than this. A law that tracks worse has wider turns, and in
the wind they are 1.7 times as wide: every gap has room for them."""
CLEARANCE, RANGE = 0.5, 6.0
"""The sensing range is in turn radii that the aircraft has under the law."""


class Flown(NamedTuple):
    """What the table needs of a flight."""

    aircraft: str
    law: str
    wind_share: float
    seed: int
    outcome: str
    reason: str
    clearance_share: float
    cross_track_m: float
    altitude_error_m: float
    causes: str
    """Why legs were not trackable; empty where all were."""

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


def scaled(frame: Airframe, law: str, wind_share: float, seed: int, range_radii: float = RANGE) -> Scenario:
    """A world at the scale of an aircraft, the wind from the left of the way.

    Raises:
        InputError: the aircraft cannot fly it; the message says why.
    """
    radius_m = performance(frame, frame.cruise_mps).turn_radius_m
    card = law_card(frame, guidance_kinds()[law], guidance_kinds()[law].config())
    with_law_m = performance(frame, frame.cruise_mps, law=card).turn_radius_m
    wind = {"wind": {"speed_mps": wind_share * frame.cruise_mps, "from_deg": 0.0}} if wind_share else {}

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
        "mission": {
            "start_m": at(2.0, 0.5 * HIGH),
            "course_deg": 90.0,
            "goal_m": at(WIDE - 2.0, 0.5 * HIGH),
        },
        "aircraft": {"model": frame.name, "airspeed_mps": frame.cruise_mps},
        "sensor": {"range_m": round(range_radii * with_law_m, 2)},
        "planner": {"clearance_m": metres(CLEARANCE)[0]},
        "guidance": {"kind": law},
        "environment": wind,
    }
    return scenario_of(keys)


def flown(name: str, law: str, wind_share: float, seed: int, range_radii: float = RANGE) -> Flown:
    """A world flown; what an aircraft cannot fly ends as `refused`."""
    try:
        scenario = scaled(airframe(name), law, wind_share, seed, range_radii)
        loop = make_loop(scenario)
    except (InputError, AircraftError) as error:
        return Flown(name, law, wind_share, seed, "refused", str(error), math.nan, math.nan, math.nan, "")
    flight = fly(loop)
    track, told = flight.track, metrics(flight, flight_limits(scenario))
    share = min(float(track.clearance_m.min()), flight.contact_m) / float(scenario.planner.clearance_m or 0.0)
    followed = track.plan_index >= 0
    causes = {leg["cause"] for leg in told["trackability"] if not leg["trackable"]}
    return Flown(
        name,
        law,
        wind_share,
        seed,
        flight.outcome.value,
        flight.reason,
        share,
        float(np.abs(track.cross_track_m[followed]).max(initial=0.0)),
        float(np.abs(track.up_m - scenario.mission.altitude_m).max()),
        ", ".join(sorted(causes)),
    )


def cell(flights: list[Flown]) -> str:
    """Reached of how many, collisions, least clearance over the wanted one, largest cross-track error (m)."""
    ends = [flight.outcome for flight in flights]
    least = min(flight.clearance_share for flight in flights)
    off_m = max(flight.cross_track_m for flight in flights)
    return f"{ends.count('reached')}/{len(ends)}, {ends.count('collision')}, {least:.2f}, {off_m:.2g}"


def main(log: Path | None, names: list[str]) -> int:
    lines = log.read_text().splitlines() if log and log.exists() else []
    known = {(each := Flown(**json.loads(line)))[:4]: each for line in lines}

    def once(*key: Any) -> Flown:
        if key not in known:
            known[key] = flown(*key)
            if log:
                with log.open("a") as file:
                    file.write(json.dumps(known[key]._asdict()) + "\n")
        return known[key]

    cases = [(law, share) for law in LAWS for share in WIND_SHARES]
    heads = [f"`{law}`, {f'wind {share:.0%}' if share else 'calm'}" for law, share in cases]
    print(f"| aircraft | turn radius m | {' | '.join(heads)} |", flush=True)
    bad = []
    for name in names or aircraft_names():
        radius_m = performance(airframe(name), airframe(name).cruise_mps).turn_radius_m
        cells = [[once(name, law, share, seed) for seed in SEEDS] for law, share in cases]
        print(f"| {name} | {radius_m:,.0f} | {' | '.join(map(cell, cells))} |", flush=True)
        bad += [flight for flights in cells for flight in flights if not flight.good]
    for each in bad:
        print(
            f"  {each.aircraft}, {each.law}, wind {each.wind_share:g}, world {each.seed}: {each.outcome}: ",
            end="",
        )
        print(f"{each.reason}; clearance {each.clearance_share:.2f}; not tracked: {each.causes or 'none'}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else None, sys.argv[2:]))
