"""The table of navigation in harness/flight/README.md: `python -m tests.closed_loop.navigation_table [MOST]`.

Public worlds in wind of 30 % and moderate turbulence, each flown with every kind of navigation. Prints a row for each
family; MOST is how many worlds of a family are flown.
"""

from __future__ import annotations

import math
import random
import subprocess
import sys
from pathlib import Path
from typing import Final

from harness.flight.closed_loop import fly
from harness.flight.record import Outcome
from harness.run.scenario_flight import make_loop
from harness.scenario.scenario import Scenario, parse_scenario
from tests.closed_loop.test_hard_conditions import FAMILIES, SPEED_MPS
from tests.closed_loop.worlds_table import SHARED

WIND: Final = ("--wind", "7.5", "270", "--turbulence", "moderate")
OUTAGE_S: Final = 60
KINDS: Final = ("rtk", "gnss", "gnss with outages", "dead_reckoning")


def scenario_of(world: Path, kind: str) -> Scenario:
    """The scenario of a world; outages begin after a quarter and after three fifths of the straight way."""
    convert = [sys.executable, str(SHARED / "tools" / "world_to_scenario.py"), str(world), *WIND]
    text = subprocess.run(convert, capture_output=True, text=True, check=True).stdout
    scenario = parse_scenario(text, world.name)
    way_s = math.dist(scenario.mission.start_m, scenario.mission.goal_m) / SPEED_MPS
    begins = (max(10, round(0.25 * way_s)), max(90, round(0.6 * way_s)))
    outages = {"outages_s": [[at, at + OUTAGE_S] for at in begins]} if "outages" in kind else {}
    return scenario.with_({"navigation": {"kind": kind.partition(" ")[0], **outages}})


def drawn(family: str, most: int) -> list[Path]:
    """Worlds of a family, the same ones each time."""
    every = sorted((SHARED / "worlds" / family).glob("*.json"))
    return sorted(random.Random(1).sample(every, most)) if len(every) > most else every


def cell(paths: list[Path], kind: str) -> str:
    """Goals reached of the worlds flown, collisions, least clearance over the wanted one."""
    reached, hit, least = 0, 0, math.inf
    for path in paths:
        scenario = scenario_of(path, kind)
        flight = fly(make_loop(scenario))
        reached += flight.outcome is Outcome.REACHED
        hit += flight.outcome is Outcome.COLLISION
        nearest_m = min(float(flight.track.clearance_m.min()), flight.contact_m)
        least = min(least, nearest_m / (scenario.planner.clearance_m or math.nan))
    return f"{reached}/{len(paths)}, {hit}, {least:.2f}"


if __name__ == "__main__":
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    print(f"| worlds | {' | '.join(KINDS)} |")
    for family in FAMILIES[::-1]:
        print(f"| {family} | {' | '.join(cell(drawn(family, most), kind) for kind in KINDS)} |", flush=True)
