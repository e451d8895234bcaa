"""The tables of courses of 14 turns in aircraft/MEASURED.md: `python -m tests.harness.bench.courses_table`.

It takes [TABLE] [SEEDS]. TABLE is `laws`, `servos` or `aircraft`; all three without one. Each cell is the worst of
SEEDS courses, flown with the default step rate.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final

from aircraft.actuators import Actuator, Actuators
from aircraft.interface import STEP_RATE_HZ
from harness.bench.tracking import CASES, Tracking, tracked
from tests.closed_loop.laws_table import LAWS

BY_NAME: Final = {case.name: case for case in CASES}
AIRCRAFT: Final = ("aerosonde", "c172p", "T38")
IN_AIRS: Final = ("calm", "wind 30 %", "moderate Tustin")
SERVOS: Final = {
    "0.05 s, 600 deg/s (0.10 s / 60 deg), 0.2 deg": Actuator(0.05, 600.0, 0.2),
    "0.1 s, 600 deg/s, 0.2 deg": Actuator(0.1, 600.0, 0.2),
    "0.02 s, 60 deg/s": Actuator(0.02, 60.0),
    "0.1 s, 60 deg/s": Actuator(0.1, 60.0),
    "0.5 s": Actuator(0.5),
}


def laws(seeds: range) -> None:
    """A row for each air and aircraft, a column for each law: the true error."""
    print(f"| air | aircraft | {' | '.join(f'`{law}`' for law in LAWS)} |", flush=True)
    for name in ("aerosonde", "c172p"):
        for case in IN_AIRS:
            print(f"| {case} | {name} ", end="", flush=True)
            for law in LAWS:
                print(f"| {_across(tracked(name, BY_NAME[case], seeds, guidance=law))} ", end="", flush=True)
            print("|", flush=True)


def servos(seeds: range) -> None:
    """A row for each servo of the Aerosonde, a column for each air."""
    print(f"| servo: lag, rate, deadband | {' | '.join(IN_AIRS)} |", flush=True)
    for name, servo in SERVOS.items():
        cells = [
            _whole(tracked("aerosonde", BY_NAME[case], seeds, actuators=Actuators.alike(servo)))
            for case in IN_AIRS
        ]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def aircraft(seeds: range) -> None:
    """A row for each air, a column for each of three aircraft."""
    print(f"| air | {' | '.join(AIRCRAFT)} |", flush=True)
    for case in CASES:
        cells = [_whole(tracked(name, case, seeds)) for name in AIRCRAFT]
        print(f"| {case.name} | {' | '.join(cells)} |", flush=True)


def _across(flown: Tracking) -> str:
    return f"{_short(flown.cross_track_p95_m)} / {_short(flown.cross_track_max_m)}"


def _whole(flown: Tracking) -> str:
    return f"{_across(flown)}, {_short(flown.altitude_p95_m)}"


def _short(metres: float) -> str:
    return f"{metres:.2f}" if metres < 1.0 else f"{metres:.1f}"


TABLES: Final[dict[str, tuple[Callable[[range], None], int]]] = {
    "laws": (laws, 4),
    "servos": (servos, 3),
    "aircraft": (aircraft, 3),
}
"""What prints a table, and its number of courses."""


if __name__ == "__main__":
    chosen = sys.argv[1:2] or list(TABLES)
    for each in chosen:
        printed, most = TABLES[each]
        courses = int(sys.argv[2]) if len(sys.argv) > 2 else most
        print(f"\n{each}: worst of {courses} courses, {STEP_RATE_HZ} steps a second\n", flush=True)
        printed(range(1, courses + 1))
