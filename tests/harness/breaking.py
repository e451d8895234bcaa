"""A scenario to be broken, and flights whose end is known."""

from functools import partial
from pathlib import Path
from typing import Any

from harness.falsify.breaking_point import Breaking, falsify, vary_of
from wayproof import load_scenario

SCENARIO = """
schema: wayproof/scenario/1
name: straight
seed: 4
area: {bounds_m: [0, 0, 3000, 3000]}
obstacles: [{circle: {center_m: [1500, 2700], radius_m: 100}}]
mission: {start_m: [500, 1500], goal_m: [2000, 1500], goal_radius_m: 100, time_limit_s: 300}
aircraft: {model: aerosonde, airspeed_mps: 25}
sensor: {range_m: 1500, rays: 90}
planner: {kind: bug2, clearance_m: 100}
"""
WAY_M = 1400.0  # from the start to the goal circle


def broken(file: Path, *ranges: tuple[str, float, float], **other: Any) -> Breaking:
    load = partial(load_scenario, file)
    out = other.pop("out", file.parent / "out")
    return falsify(load, vary_of(load, ranges, other.get("tolerance", 0.01)), out, **other)


def stand_in(outcome: str = "reached", /, **other: Any) -> dict[str, Any]:
    plain = {"outcome": outcome, "reason": "as told", "trackable": True, "min_clearance_m": 100.0}
    return plain | {"flight_time_s": 60.0, "cross_track_m": {"max": 0.5}, "digest": "0"} | other
