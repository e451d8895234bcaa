"""The table of guidance laws in wind in aircraft/MEASURED.md: `python -m tests.closed_loop.laws_table [MOST]`.

Each law flies the Aerosonde through public worlds in wind of 30 % of the airspeed: the plan itself, and for npfg and L1
the plan as a mission of waypoints too. Prints a row for each, with the collisions and the least clearance of each
family, then every flight that did not reach the goal, and exits with 1 where one collided. MOST is how many worlds of a
family are flown.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, Final, NamedTuple

from harness.flight.closed_loop import fly
from harness.flight.record import Outcome, digest
from harness.run.scenario_flight import make_loop
from tests.closed_loop.test_hard_conditions import WIND, WORLDS, hard, worlds

LAWS: Final = ("preview", "npfg", "l1", "vector_field", "pure_pursuit")
FLOWN: Final = (*((law, "path") for law in LAWS), ("npfg", "waypoints"), ("l1", "waypoints"))
"""What is flown: a law, and what it follows."""
FAMILIES: Final = ("faster_forest", "circles_mid", "paper_like")


class Flown(NamedTuple):
    """What a row needs of a flight."""

    family: str
    world: str
    law: str
    follow: str
    outcome: str
    reason: str
    clearance_share: float
    """The least distance from an obstacle over the wanted clearance."""
    cross_track_m: float
    """The largest distance from the plan."""
    digest: str


def condition(law: str, follow: str = "path") -> dict[str, Any]:
    """Steady wind, no turbulence, no flaws of the sensor; a law at its defaults."""
    return {"guidance": {"kind": law, "follow": follow}, "environment": WIND}


def flown(path: Path, law: str, follow: str) -> Flown:
    """A world flown under a law."""
    world = json.loads(path.read_text())
    flight = fly(make_loop(hard(world, condition(law, follow))))
    track = flight.track
    share = min(float(track.clearance_m.min()), flight.contact_m) / float(world["clearance_m"])
    off_m = float(abs(track.cross_track_m[track.plan_index >= 0]).max(initial=0.0))
    end = flight.outcome.value
    return Flown(path.parent.name, path.stem, law, follow, end, flight.reason, share, off_m, digest(track))


def cell(flights: list[Flown]) -> str:
    """Reached of how many, collisions, and the least clearance over the wanted one."""
    ends = [flight.outcome for flight in flights]
    least = min(flight.clearance_share for flight in flights)
    reached, hit = ends.count(Outcome.REACHED.value), ends.count(Outcome.COLLISION.value)
    return f"{reached}/{len(ends)}, {hit}, {least:.2f}"


def main(most: int) -> int:
    if not WORLDS.is_dir():
        print(f"{WORLDS}: the shared worlds are not beside this checkout", file=sys.stderr)
        return 2
    collisions = 0
    print(f"| law | {' | '.join(f'`{family}`' for family in FAMILIES)} |", flush=True)
    for law, follow in FLOWN:
        flights = [[flown(path, law, follow) for path in worlds(family, most)] for family in FAMILIES]
        name = f"`{law}`" if follow == "path" else f"`{law}`, {follow}"
        print(f"| {name} | {' | '.join(map(cell, flights))} |", flush=True)
        for each in (flight for some in flights for flight in some):
            if each.outcome != Outcome.REACHED.value:
                collisions += each.outcome == Outcome.COLLISION.value
                print(f"  {each.family}/{each.world}, {name}: {each.outcome}: {each.reason}", flush=True)
    return 1 if collisions else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000))
