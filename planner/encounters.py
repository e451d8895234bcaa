"""Where obstacles that move will be met.

To an aircraft that flies at a steady speed, an obstacle that moves is in the way where both arrive at the same
time: its outline, moved on by the time that the aircraft needs to get there, is planned around as if it stood
still. (The collision cone of A. Chakravarthy and D. Ghose, "Obstacle avoidance in a dynamic environment", IEEE
Trans. SMC 28, 1998, seen from the place of the encounter.) A way round takes longer than the straight line, and wind
changes when one arrives: so the outline is drawn out over all the times in question. As the aircraft comes nearer
these draw together. Assumed: an obstacle keeps its velocity, and it is no faster than `FASTEST` of the aircraft.
"""

from __future__ import annotations

import math

import numpy as np

from planner.curves import Point
from planner.interface import FloatArray, Mission, MovingEdges, PlanRequest

FASTEST = 0.8
"""Share of the aircraft's speed: faster obstacles may be met anywhere."""
EARLIEST, LATEST = 0.85, 1.3
"""Shares of the time in a straight line at the aircraft's airspeed."""
LATER_S = 3.0
"""And so much later, to turn and pass by."""
ROUNDS = 12
"""Steps of the fixed-point iteration for the time; each leaves `FASTEST` of the error at most."""


def encounters(request: PlanRequest, mission: Mission) -> list[FloatArray]:
    """The outline of each obstacle that moves, (k, 2), drawn out over the places where it can be met."""
    here, spacing_m = request.position_m, 0.5 * mission.clearance_m
    return [met_at(each, here, request.time_s, mission.speed_mps, spacing_m) for each in request.seen.moving]


def met_at(
    moving: MovingEdges, position: Point, time_s: float, speed_mps: float, spacing_m: float
) -> FloatArray:
    """The outline of an obstacle, drawn out over the places where it can be met.

    Args:
        moving: the obstacle.
        position: (east, north) of the aircraft, m.
        time_s: time now.
        speed_mps: of the aircraft.
        spacing_m: the outline is drawn again and again no further apart than this.

    Returns:
        (k, 2) points, m.
    """
    velocity = np.array(moving.velocity_mps)
    pace = math.hypot(*moving.velocity_mps)
    now = moving.points_m + velocity * (time_s - moving.time_s)
    slowed = min(1.0, FASTEST * speed_mps / max(pace, 1e-9))
    after_s = 0.0
    for _ in range(ROUNDS):
        away = now + velocity * (slowed * after_s) - position
        after_s = float(np.hypot(away[:, 0], away[:, 1]).min()) / speed_mps
    first_s, last_s = EARLIEST * after_s, LATEST * after_s + LATER_S
    times = np.linspace(first_s, last_s, max(math.ceil(pace * (last_s - first_s) / spacing_m), 1) + 1)
    drawn = (now + times[:, None, None] * velocity).reshape(-1, 2)
    # One point a cell is enough.
    cells = np.floor(drawn / (0.5 * spacing_m)).astype(np.int64)
    _, chosen = np.unique(cells, axis=0, return_index=True)
    kept: FloatArray = drawn[np.sort(chosen)]
    return kept
