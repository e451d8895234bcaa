"""What a safe plan promises in a still world, however thin its obstacles are.

A pole or a fence stands beside the straight way of 4 km to the goal; the real aircraft flies, in calm air or in wind,
with the default range and clearance, with few or many beams. `python -m tests.closed_loop.test_thin_obstacles` flies
1,000 of these (`FIRST COUNT` flies others) and prints what became of them, by kind and number of beams.
"""

import math
import sys
from collections import Counter
from typing import Any

import numpy as np
import pytest

from harness.flight.closed_loop import fly
from harness.flight.record import Flight, Outcome
from harness.run.scenario_flight import make_loop
from harness.scenario.scenario import scenario_of
from wayproof import Scenario

POLES_M = (0.01, 0.05, 0.3, 1.0)
THICK_M = (0.01, 0.02, 0.1, 0.3, 1.0, 3.0)
FENCE_M = 1200.0
KINDS = ("pole", "fence edge-on", "fence oblique")
RAYS = (720, 360, 180, 90)
START, WAY_M = complex(600.0, 2500.0), 4000.0
TURN_M = 110.0  # turn radius of the aircraft, about
BESIDE = 0.8  # so many of these from the straight line, at most
KEPT = 0.9  # share of the clearance that is kept throughout


def fence(middle: complex, turned_rad: float, thick_m: float) -> dict[str, Any]:
    corners = [
        middle + complex(math.cos(turned_rad), math.sin(turned_rad)) * complex(x, y) * 0.5
        for x, y in ((-FENCE_M, -thick_m), (FENCE_M, -thick_m), (FENCE_M, thick_m), (-FENCE_M, thick_m))
    ]
    return {"polygon": {"vertices_m": [[each.real, each.imag] for each in corners]}}


def pole(middle: complex, radius_m: float) -> dict[str, Any]:
    return {"circle": {"center_m": [middle.real, middle.imag], "radius_m": radius_m}}


def thin(seed: int, **sensor: Any) -> tuple[str, Scenario]:
    """What stands in the way, and the scenario: all drawn from the seed, kinds and beams in turn."""
    rng = np.random.default_rng([30, seed])
    kind, rays = KINDS[seed % len(KINDS)], RAYS[seed // len(KINDS) % len(RAYS)]
    beside = complex(rng.uniform(1100.0, 2600.0), rng.uniform(-BESIDE, BESIDE) * TURN_M)
    turned = rng.uniform(-math.pi / 2, math.pi / 2)
    if kind == "pole":
        obstacle = pole(START + beside, float(rng.choice(POLES_M)))
    else:
        if kind == "fence edge-on":
            turned = math.radians(rng.choice([0.0, 0.0, rng.uniform(-3.0, 3.0)]))
            beside += 400.0
        obstacle = fence(START + beside, turned, float(rng.choice(THICK_M)))
    wind = {"wind": {"speed_mps": 5.0, "from_deg": float(rng.integers(0, 360))}} if seed // 12 % 2 else {}
    keys = {
        "schema": "wayproof/scenario/1",
        "name": f"thin-{seed}",
        "seed": seed,
        "area": {"bounds_m": [0.0, 0.0, 5200.0, 5000.0]},
        "obstacles": [obstacle],
        "mission": {"start_m": [START.real, START.imag], "goal_m": [START.real + WAY_M, START.imag]},
        "aircraft": {"model": "aerosonde", "airspeed_mps": 25.0},
        "sensor": {"rays": rays} | sensor,
        "environment": wind,
    }
    return kind, scenario_of(keys)


def below_s(flight: Flight, scenario: Scenario) -> float:
    """For how long less than the share of the clearance was kept."""
    track = flight.track
    return float(np.diff(track.time_s)[track.clearance_m[1:] < KEPT * scenario.planner.clearance_m].sum())


@pytest.mark.parametrize("seed", range(0, 24, 5))
def test_thin_obstacles_are_kept_clear_of(seed: int) -> None:
    kind, scenario = thin(seed)
    flight = fly(make_loop(scenario))
    assert flight.outcome is Outcome.REACHED, f"{kind}: {flight.reason}"
    assert below_s(flight, scenario) == 0.0, f"{kind}: {flight.track.clearance_m.min():.1f} m"


def main(first: int, count: int) -> None:
    """Flies so many, and prints what became of them."""
    told: Counter[tuple[str, int, str]] = Counter()
    least: dict[tuple[str, int], float] = {}
    longest = 0.0
    for seed in range(first, first + count):
        kind, scenario = thin(seed)
        flight = fly(make_loop(scenario))
        group = kind, scenario.sensor.rays
        low_s = below_s(flight, scenario)
        share = float(flight.track.clearance_m.min()) / scenario.planner.clearance_m
        told[(*group, flight.outcome.value)] += 1
        told[(*group, "below")] += low_s > 0.0
        least[group] = min(least.get(group, math.inf), share)
        longest = max(longest, flight.track.time_s[-1])
        if flight.outcome is not Outcome.REACHED or low_s > 0.0:
            print(f"  seed {seed}: {kind}, {flight.outcome.value}, {share:.3f}, below {low_s:.1f} s", flush=True)
    print("kind, beams: flights, reached, collisions, below 0.9 of the clearance, least share of it")
    for group in sorted(least):
        flights = sum(told[(*group, outcome.value)] for outcome in Outcome)
        figures = [flights, *(told[(*group, name)] for name in ("reached", "collision", "below"))]
        print(f"{group[0]}, {group[1]}: {', '.join(map(str, figures))}, {least[group]:.3f}")


if __name__ == "__main__":
    main(*(int(each) for each in sys.argv[1:3])) if len(sys.argv) > 2 else main(0, 1000)
