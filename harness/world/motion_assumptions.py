"""Which moving obstacles of a world lie outside what the planner's promise of safety assumes of them.

The planner knows nothing of this: it sees what the sensor returns. This is for people, who want to know before a
flight whether its world is one that the promise covers. The assumptions stand in `planner/README.md`; that no two
obstacles touch is one of them and is not looked for here.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from harness.scenario.scenario import Scenario
from harness.world.obstacle import Circle, Obstacle
from harness.world.world import World

SLOWEST_MPS: Final = 0.5  # an obstacle slower than this is taken to stand still

FASTEST_MPS: Final = 30.0  # an obstacle faster than this is not followed from scan to scan

FASTEST_SHARE: Final = 0.8
"""The aircraft cannot fly aside from an obstacle faster than this share of its airspeed."""


def outside_assumptions(scenario: Scenario) -> tuple[str, ...]:
    """Returns one sentence for each assumption that a moving obstacle of a scenario breaks.

    Assumed are a speed from `SLOWEST_MPS` to `FASTEST_MPS` and to `FASTEST_SHARE` of the airspeed, and a width, across
    the velocity, of no more than the sensing range, so that an end comes into sight.
    """
    if not any(each.velocity_mps not in (None, (0.0, 0.0)) for each in scenario.obstacles):
        return ()  # no world is made of many buildings that stand
    fastest = min(FASTEST_MPS, FASTEST_SHARE * scenario.aircraft.airspeed_mps)
    range_m = scenario.sensor.range_m
    found = []
    for number, each in enumerate(World.from_scenario(scenario).obstacles):
        speed = math.hypot(*each.velocity_mps)
        if speed and not SLOWEST_MPS <= speed <= fastest:
            assumed = f"assumed are {SLOWEST_MPS:g} to {fastest:.3g} m/s"
            found.append(f"obstacles[{number}] moves at {speed:.3g} m/s; {assumed}")
        if speed and (width := _width_m(each)) > range_m:
            found.append(
                f"obstacles[{number}] is {width:,.0f} m wide across its motion; assumed is no more than the "
                f"sensing range, {range_m:,.0f} m"
            )
    return tuple(found)


def _width_m(obstacle: Obstacle) -> float:
    """Returns the extent of an obstacle across its velocity."""
    if isinstance(obstacle.shape, Circle):
        return 2.0 * obstacle.shape.radius_m
    east, north = np.array(obstacle.velocity_mps) / math.hypot(*obstacle.velocity_mps)
    return float(np.ptp(np.array(obstacle.shape.vertices_m) @ np.array((-north, east))))
