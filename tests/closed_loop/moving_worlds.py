"""Obstacles that move or appear, drawn at random, for the small world of `conftest`: a flight from corner to corner."""

import cmath
import math
from typing import Any

import numpy as np

START, GOAL = 300.0 + 300.0j, 5700.0 + 5700.0j
SPEED_MPS = 25.0
COURSE = (GOAL - START) / abs(GOAL - START)
TURNED_DEG = {"crossing": (60.0, 120.0), "head_on": (150.0, 180.0), "overtaken": (0.0, 30.0)}
"""Between the courses of obstacle and aircraft."""


def _shape(rng: np.random.Generator, centre: complex, radius_m: float) -> dict[str, Any]:
    if rng.random() < 0.5:
        return {"circle": {"center_m": [centre.real, centre.imag], "radius_m": radius_m}}
    corners, turn = int(rng.integers(3, 7)), rng.uniform(0.0, math.tau)
    places = [centre + cmath.rect(radius_m, turn + math.tau * i / corners) for i in range(corners)]
    return {"polygon": {"vertices_m": [[place.real, place.imag] for place in places]}}


def moving(seed: int, kind: str) -> dict[str, Any]:
    """An obstacle that is about where the aircraft is, on its straight line to the goal, at the same time."""
    rng = np.random.default_rng([seed, sorted(TURNED_DEG).index(kind)])
    met_s = rng.uniform(0.35, 0.7) * abs(GOAL - START) / SPEED_MPS
    turned = math.radians(rng.uniform(*TURNED_DEG[kind])) * rng.choice([-1.0, 1.0])
    velocity = COURSE * cmath.rect(rng.uniform(3.0, 10.0), turned)
    meets = START + COURSE * SPEED_MPS * met_s + complex(*rng.normal(0.0, 30.0, 2))
    shape = _shape(rng, meets - velocity * met_s, rng.uniform(40.0, 150.0))
    return {**shape, "velocity_mps": [velocity.real, velocity.imag]}


def popping_up(seed: int) -> dict[str, Any]:
    """An obstacle that appears right ahead, with room to turn away: 700 to 1200 m before the aircraft is there."""
    rng = np.random.default_rng([seed, 9])
    met_m = rng.uniform(0.35, 0.7) * abs(GOAL - START)
    ahead_m = rng.uniform(700.0, 1200.0)
    centre = START + COURSE * met_m + complex(*rng.normal(0.0, 30.0, 2))
    return {
        **_shape(rng, centre, rng.uniform(40.0, 150.0)),
        "active_s": [(met_m - ahead_m) / SPEED_MPS, 3000.0],
    }
