"""Short flights whose tracks are known bit for bit: a change that should not change a flight must leave them alone.

A change that should, prints the new digests with `python -m tests.closed_loop.test_held_digests`.
"""

import hashlib
import math

import numpy as np
import pytest

from harness.flight.closed_loop import fly
from harness.flight.record import digest
from harness.run.scenario_flight import make_loop
from harness.scenario.shipped import scenario_path
from wayproof import load_scenario

HELD = {
    "aerosonde_forest": "0ca7df4598c874b63c63a47fe7b8b7b381107b7092acc205e886d632502b5ffc",
    "polygon_town": "23138a094b3e0d27062318fe98118f868a184d323b18a940987e0406c2aa38ed",
    "one_of_everything": "f8432ed34bc7ff9862567bffc8f25ad99bf817582325b15ed45842340ad23ea9",
}
"""SHA-256 of the first minute of each."""

ARITHMETIC = "a336800c643015dd88fc6aa2a107f48501e914891e430e92af09c966a8d7bf6b"
"""SHA-256 of elementary functions where `HELD` was made: numpy takes other code on other processors."""


def flown(name: str) -> str:
    return digest(fly(make_loop(load_scenario(scenario_path(name), [("mission.time_limit_s", "60")]))).track)


def arithmetic() -> str:
    numbers = np.linspace(0.001, 3.0, 1001)
    functions = (np.sin, np.cos, np.tan, np.exp, np.log, np.sqrt, np.arctan, np.degrees)
    results = [function(numbers).tobytes() for function in functions]
    results += [np.hypot(numbers, numbers[::-1]).tobytes(), np.arctan2(numbers, numbers[::-1]).tobytes()]
    results += [b"".join(float(math.atan2(x, 1.5)).hex().encode() for x in numbers)]
    return hashlib.sha256(b"".join(results)).hexdigest()


@pytest.mark.parametrize("name", HELD)
def test_a_flight_is_what_it_was(name: str) -> None:
    if arithmetic() != ARITHMETIC:
        pytest.skip("this processor rounds elementary functions differently")
    assert flown(name) == HELD[name], "new ones: python -m tests.closed_loop.test_held_digests"


if __name__ == "__main__":
    print(f'ARITHMETIC = "{arithmetic()}"')
    for each in HELD:
        print(f'    "{each}": "{flown(each)}",')
