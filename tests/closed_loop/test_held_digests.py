"""Short flights whose tracks are known bit for bit: a change that should not change a flight must leave them alone.

A change that should, prints the new digests with `python -m tests.closed_loop.test_held_digests`.
"""

from __future__ import annotations

import hashlib
import math

import numpy as np
import pytest

from harness.flight.closed_loop import fly
from harness.flight.record import digest
from harness.run.scenario_flight import make_loop
from harness.scenario.scenario import load_scenario
from harness.scenario.shipped import scenario_path

HELD = {
    "aerosonde_forest": "f22ac2370b37a011f8057e1469936008a8df3f399dec19711e60cb3a75c10c8d",
    "polygon_town": "cc9a18f79433c057b63a719a07ce2adeb5601f74c5d7ff783a9f2006afee39c1",
    "one_of_everything": "bcc918ca0e2bcd7e3948a215cf08a236bea66f1628dc13003333d6936ffa4b09",
}
"""SHA-256 of the first minute of each."""

ARITHMETIC = "d689307d6406f60428aca0b78f1cefba7e92878c8d8ead14210fd6ef8db731be"
"""SHA-256 of elementary functions where `HELD` was made: numpy takes other code on other processors."""


def flown(name: str) -> str:
    scenario = load_scenario(scenario_path(name), [("mission.time_limit_s", "60")])
    return digest(fly(make_loop(scenario)).track)


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
