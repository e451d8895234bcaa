"""The table of guidance laws in wind in aircraft/README.md: `python -m tests.closed_loop.laws_table [MOST]`.

Each law flies the Aerosonde through public worlds in wind of 30 % of the airspeed. Prints a row for each law, with the
collisions and the least clearance of each family, then every flight that did not reach the goal, and exits with 1
where one collided. MOST is how many worlds of a family are flown.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, Final, NamedTuple

from harness.flight.closed_loop import fly
from harness.flight.record import Outcome
from harness.run.scenario_flight import make_loop
from tests.closed_loop.test_hard_conditions import WIND, WORLDS, hard, worlds

LAWS: Final = ("preview", "npfg", "l1", "vector_field", "pure_pursuit")
FAMILIES: Final = ("faster_forest", "circles_mid", "paper_like")


class Flown(NamedTuple):
    """What a row needs of a flight."""

    world: str
    outcome: Outcome
    reason: str
    clearance_share: float
    """The least distance from an obstacle over the wanted clearance."""


def condition(law: str) -> dict[str, Any]:
    """Steady wind, no turbulence, no flaws of the sensor; a law at its defaults."""
    return {"guidance": {"kind": law}, "environment": WIND}


def flown(path: Path, law: str) -> Flown:
    """A world flown under a law."""
    world = json.loads(path.read_text())
    flight = fly(make_loop(hard(world, condition(law))))
    share = float(flight.track.clearance_m.min()) / float(world["clearance_m"])
    return Flown(path.stem, flight.outcome, flight.reason, share)


def cell(flights: list[Flown]) -> str:
    """Reached of how many, collisions, and the least clearance over the wanted one."""
    ends = [flight.outcome for flight in flights]
    least = min(flight.clearance_share for flight in flights)
    return f"{ends.count(Outcome.REACHED)}/{len(ends)}, {ends.count(Outcome.COLLISION)}, {least:.2f}"


def main(most: int) -> int:
    if not WORLDS.is_dir():
        print(f"{WORLDS}: the shared worlds are not beside this checkout", file=sys.stderr)
        return 2
    collisions = 0
    print(f"| law | {' | '.join(f'`{family}`' for family in FAMILIES)} |", flush=True)
    for law in LAWS:
        flights = {family: [flown(path, law) for path in worlds(family, most)] for family in FAMILIES}
        print(f"| `{law}` | {' | '.join(cell(some) for some in flights.values())} |", flush=True)
        for family, some in flights.items():
            for flight in (each for each in some if each.outcome is not Outcome.REACHED):
                collisions += flight.outcome is Outcome.COLLISION
                print(
                    f"  {family}/{flight.world}, {law}: {flight.outcome.value}: {flight.reason}", flush=True
                )
    return 1 if collisions else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000))
