"""Hard conditions, each alone and all together, in public worlds: 30 % wind, moderate turbulence, the real aircraft.

Besides the sensor's flaws: obstacles that appear ahead, and obstacles that come to the straight line to the goal
when the aircraft does. `python -m tests.closed_loop.test_hard_conditions [--most N] [--day typical|rough] [FAMILY...]`
flies N worlds of each family, has each flight judged by the independent referee, and prints the table of
planner/MEASURED.md: in the air above, or each world on a day of its own, whose table `--write` puts there. `--table
laws` flies every guidance law in steady wind (aircraft/MEASURED.md), `--table navigation` every kind of navigation
(harness/flight/README.md).
"""

import argparse
import json
import math
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from harness.flight.closed_loop import fly
from harness.flight.record import Flight, Outcome
from harness.run.scenario_flight import fly_to_folder, make_loop
from harness.scenario.scenario import scenario_of
from tests.closed_loop.tables import fill, head, line, upper
from tests.closed_loop.worlds_table import SHARED, referee_faults
from wayproof import Scenario

WORLDS = SHARED / "worlds"
FAMILIES = ("circles_mid", "paper_like", "faster_forest", "barn")
SPEED_MPS, TURN_M = 25.0, 230.0
WIND_MPS = 0.3 * SPEED_MPS
WIND = {"wind": {"speed_mps": WIND_MPS, "from_deg": 270.0}}
TURBULENCE = {"turbulence": {"model": "tustin", "intensity": "moderate"}}
OUTAGES = ((0.25, 10), (0.6, 90))
"""Share of the straight way after which an outage begins, and the least time, s."""
FLAWS: dict[str, dict[str, Any]] = {
    "noise, 1 % of range": {"sensor": {"range_noise_m": 0.01}},
    "10 % lost returns": {"sensor": {"dropout": 0.1}},
    "1 % false returns": {"sensor": {"false_return": 0.01}},
    "scans 2 s late": {"sensor": {"latency_s": 2.0}},
    "plans 2 s late": {"planner": {"compute_latency_s": 2.0}},
    "field of view 180 deg": {"sensor": {"field_of_view_deg": 180.0}},
}
ALL_FLAWS: dict[str, dict[str, Any]] = {
    "sensor": {key: value for flaw in FLAWS.values() for key, value in flaw.get("sensor", {}).items()},
    "planner": {"compute_latency_s": 1.0},
}
CONDITIONS: dict[str, dict[str, Any]] = {
    **FLAWS,
    "6 obstacles appear": {"appear": 6},
    "6 obstacles move": {"move": 6},
    "all flaws together": ALL_FLAWS,
    "all of it together": {**ALL_FLAWS, "appear": 3, "move": 3},
}
LAWS: dict[str, dict[str, Any]] = {
    " ".join(guidance.values()): {"guidance": guidance, "environment": WIND}
    for guidance in (
        *({"kind": law} for law in ("preview", "npfg", "l1", "vector_field", "pure_pursuit")),
        *({"kind": law, "follow": "waypoints"} for law in ("npfg", "l1")),
    )
}
NAVIGATION: dict[str, dict[str, Any]] = {
    **{kind: {"navigation": {"kind": kind}} for kind in ("rtk", "gnss", "dead_reckoning")},
    "gnss with outages": {"navigation": {"kind": "gnss"}, "outages": True},
}
TABLES = {"hard": CONDITIONS, "laws": LAWS, "navigation": NAVIGATION}


def hard(world: dict[str, Any], condition: dict[str, Any], seed: int = 1, day: str | None = None) -> Scenario:
    """A world under one of `CONDITIONS`, or a `day`; what appears and moves is drawn from the world's name."""
    air = condition.get("environment", WIND | TURBULENCE)
    range_m, clearance = float(world["sensor_range_m"]), float(world["clearance_m"])
    sensor, navigation = {"range_m": range_m} | condition.get("sensor", {}), condition.get("navigation", {})
    if "range_noise_m" in sensor:
        sensor["range_noise_m"] *= range_m
    rng = np.random.default_rng([seed, *world["name"].encode()])
    start, goal = complex(*world["start_m"]), complex(*world["goal_m"])
    obstacles = [{"circle": {"center_m": each[:2], "radius_m": each[2]}} for each in world["circles_m"]]
    obstacles += [{"polygon": {"vertices_m": each}} for each in world["polygons_m"]]
    for _ in range(condition.get("appear", 0)):
        obstacles += _appearing(rng, start, goal, clearance, range_m)
    for _ in range(condition.get("move", 0)):
        obstacles += _moving(rng, start, goal, clearance, range_m)
    way_m = max(world["optimum_m"] or 0.0, abs(goal - start), 10_000.0)
    if condition.get("outages"):  # two of a minute, after a quarter and three fifths of the straight way
        begins = (max(least_s, round(share * abs(goal - start) / SPEED_MPS)) for share, least_s in OUTAGES)
        navigation = navigation | {"outages_s": [[begin, begin + 60] for begin in begins]}
    return scenario_of(
        {
            "schema": "wayproof/scenario/1",
            "name": world["name"],
            "seed": seed,
            "area": {"bounds_m": world["bounds_m"]},
            "obstacles": obstacles,
            "mission": {
                **{key: world[key] for key in ("start_m", "course_deg", "goal_m", "goal_radius_m")},
                "altitude_m": 300.0,
                "time_limit_s": float(round(20.0 * way_m / SPEED_MPS)),
            },
            "aircraft": {"model": "aerosonde", "airspeed_mps": SPEED_MPS},
            "sensor": sensor,
            "planner": {"clearance_m": clearance} | condition.get("planner", {}),
            "guidance": condition.get("guidance", {}),
            **({"navigation": navigation} if navigation else {}),
            **({"environment": air} if day is None else {"conditions": day}),
        }
    )


def _appearing(
    rng: np.random.Generator, start: complex, goal: complex, clearance: float, range_m: float
) -> list[dict[str, Any]]:
    """A circle about the straight line that appears with room to turn away, and goes again later."""
    along, distance = (goal - start) / abs(goal - start), abs(goal - start)
    share = rng.uniform(0.15, 0.85)
    radius = rng.uniform(0.3, 1.0) * min(0.15 * range_m, 600.0) + 0.3 * clearance
    place = start + along * (share * distance + 1j * rng.normal() * radius)
    lead = rng.uniform(4.0 * TURN_M + clearance + radius, max(0.8 * range_m, 6.0 * TURN_M + clearance + radius))
    pace = _pace_mps(along)
    begin = max(0.0, (share * distance - lead) / pace)
    end = begin + rng.uniform(0.3, 1.0) * 4.0 * lead / pace
    if min(abs(place - start), abs(place - goal)) < radius + 2.0 * clearance + 3.0 * TURN_M:
        return []
    return [{**_circle(place, radius), "active_s": [round(begin, 1), round(end, 1)]}]


def _moving(
    rng: np.random.Generator, start: complex, goal: complex, clearance: float, range_m: float
) -> list[dict[str, Any]]:
    """A circle of a tenth to four tenths of the aircraft's speed that is on the straight line when that is."""
    along, distance = (goal - start) / abs(goal - start), abs(goal - start)
    share = rng.uniform(0.25, 0.85)
    radius = rng.uniform(0.3, 1.0) * min(0.1 * range_m, 400.0) + 0.2 * clearance
    course = rng.uniform(0.0, math.tau)
    velocity = rng.uniform(0.1, 0.4) * SPEED_MPS * complex(math.cos(course), math.sin(course))
    meets = start + along * (share * distance + 1j * rng.normal() * radius)
    place = meets - velocity * (share * distance / _pace_mps(along))
    if abs(place - start) < radius + 0.3 * range_m + 4.0 * TURN_M:
        return []
    return [{**_circle(place, radius), "velocity_mps": [round(velocity.real, 3), round(velocity.imag, 3)]}]


def _pace_mps(along: complex) -> float:
    """Speed over the ground along a course, in a wind that blows to the east."""
    ahead, across = WIND_MPS * along.real, WIND_MPS * along.imag
    return math.sqrt(SPEED_MPS**2 - across**2) + ahead


def _circle(place: complex, radius: float) -> dict[str, Any]:
    return {"circle": {"center_m": [round(place.real, 2), round(place.imag, 2)], "radius_m": round(radius, 2)}}


def flown(path: Path, condition: str) -> tuple[Flight, Scenario]:
    scenario = hard(json.loads(path.read_text()), CONDITIONS[condition])
    return fly(make_loop(scenario)), scenario


def worlds(family: str, most: int) -> list[Path]:
    every = sorted((WORLDS / family).glob("*.json"))
    reach = [path for path in every if json.loads(path.read_text())["expect"] == "reach"]
    return reach[:: max(1, len(reach) // most)][:most]


@pytest.mark.slow
@pytest.mark.skipif(not WORLDS.is_dir(), reason="the shared worlds are not beside this checkout")
@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("family", FAMILIES)
def test_is_reached_without_a_collision(family: str, condition: str) -> None:
    some = worlds(family, 2)
    assert some
    for path in some:
        flight, _ = flown(path, condition)
        assert flight.outcome is Outcome.REACHED, f"{path.name}: {flight.reason}"


@pytest.mark.flights
@pytest.mark.skipif(not WORLDS.is_dir(), reason="the shared worlds are not beside this checkout")
def test_a_way_without_room_to_turn_that_is_hard_to_see_is_found_in_the_end() -> None:
    flight, _ = flown(WORLDS / "barn" / "barn-world-265.json", "field of view 180 deg")
    assert flight.outcome is Outcome.REACHED, flight.reason


class Cell(NamedTuple):
    """A cell of the table."""

    ends: list[str]  # how each flight ended
    shares: list[float]  # least clearance of each over the wanted one
    faults: list[str]  # what the referee found wrong

    def __str__(self) -> str:
        """Goals reached, collisions and the bound of their share at 95 %, least clearance over the wanted one."""
        hit = self.ends.count("collision")
        reached = f"{self.ends.count('reached')}/{len(self.ends)}"
        return f"{reached}, {hit} (< {upper(hit, len(self.ends)):.0%}), {min(self.shares):.2f}"


def _cell(family: str, condition: dict[str, Any], most: int, folder: Path, day: str | None) -> Cell:
    cell = Cell([], [], [])
    for number, path in enumerate(worlds(family, most)):
        scenario = hard(json.loads(path.read_text()), condition, 1 + number * (day is not None), day)
        run = folder / path.stem
        metrics = fly_to_folder(scenario, run, recording=False)
        cell.ends.append(metrics["outcome"])
        cell.shares.append(metrics["min_clearance_m"] / (scenario.planner.clearance_m or math.nan))
        cell.faults.extend(f"{path.stem}, {condition}: {fault}" for fault in referee_faults(run))
        shutil.rmtree(run)
    return cell


def main(arguments: Sequence[str]) -> int:
    """Prints the table, a row as soon as it is flown, then what the referee found wrong."""
    parser = argparse.ArgumentParser()
    parser.add_argument("families", nargs="*", default=FAMILIES)
    parser.add_argument("--table", choices=TABLES, default="hard")
    parser.add_argument("--most", type=int, default=10_000)
    parser.add_argument("--day", choices=("typical", "rough"))
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args(arguments)
    cells: list[Cell] = []
    lines = head("condition", *asked.families)
    print(*lines, sep="\n", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, condition in TABLES[asked.table].items():
            row = [_cell(each, condition, asked.most, Path(folder), asked.day) for each in asked.families]
            cells += row
            lines.append(line(name, *map(str, row)))
            print(lines[-1], flush=True)
    ends = [end for cell in cells for end in cell.ends]
    hit, faults = ends.count("collision"), [fault for cell in cells for fault in cell.faults]
    below = f"{hit} hit (below {upper(hit, len(ends)):.2%} at 95 %)"
    judged = " ".join(faults) or "the referee has no fault to find"
    summary = f"{ends.count('reached')} of {len(ends)} flights reached the goal, {below}; {judged}."
    print(summary)
    if asked.write and asked.day:
        fill(f"hard conditions: {asked.day}", "\n".join([*lines, "", summary]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
