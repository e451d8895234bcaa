"""Where moving obstacles will be met.

An obstacle that moves is in the way where it and the aircraft arrive at the same time: its outline, moved on by the
time that the aircraft needs to get there, is planned around as if it stood still. (The collision cone of A.
Chakravarthy and D. Ghose, "Obstacle avoidance in a dynamic environment", IEEE Trans. SMC 28, 1998.) Ways round take
longer and wind changes when one arrives: so each point of it is drawn out over all the times in question. Assumed: an
obstacle keeps its velocity, and it is no faster than `FASTEST_SHARE` of the aircraft.
"""

from __future__ import annotations

import math

import numpy as np

from planner.geometry.curves import Point
from planner.interface import FloatArray, MovingEdges

FASTEST_SHARE = 0.8
"""Share of the aircraft's airspeed. An obstacle that is faster may be met anywhere; it is taken to be this fast."""
EARLIEST, LATEST = 0.85, 1.3
"""The aircraft may be at a place between these shares of the time that a straight line there takes at its airspeed."""
PASSING_S = 3.0  # time that the aircraft may be later than the latest, to turn and pass by


def met_at(moving: MovingEdges, position: Point, time_s: float, speed_mps: float, spacing_m: float) -> FloatArray:
    """(k, 2) the outline of an obstacle, drawn out over where it can be met, every `spacing_m` or more often; m.

    The aircraft is at `position` at `time_s`. No two points lie in one cell of half the spacing.
    """
    velocity = np.array(moving.velocity_mps)
    now = moving.points_m + velocity * (time_s - moving.time_s)
    after_s = meeting_s(now - position, velocity, speed_mps)
    first_s, last_s = EARLIEST * after_s, LATEST * after_s + PASSING_S
    longest_m = math.hypot(*moving.velocity_mps) * float((last_s - first_s).max())
    share = np.linspace(0.0, 1.0, max(math.ceil(longest_m / spacing_m), 1) + 1)
    drawn = (now + (first_s + share[:, None] * (last_s - first_s))[..., None] * velocity).reshape(-1, 2)
    _, chosen = np.unique(np.floor(drawn / (0.5 * spacing_m)), axis=0, return_index=True)
    return np.asarray(drawn[np.sort(chosen)])


def meeting_s(offsets_m: FloatArray, velocity_mps: FloatArray, speed_mps: float) -> FloatArray:
    """(k,) time (s) that an aircraft takes straight to moving points: |offset + velocity t| = speed t.

    `offsets_m` are (k, 2) from the aircraft; an obstacle faster than `FASTEST_SHARE` of it is taken to be that fast.
    """
    velocity = velocity_mps * min(1.0, FASTEST_SHARE * speed_mps / max(float(np.hypot(*velocity_mps)), 1e-9))
    along = offsets_m @ velocity
    gain = speed_mps * speed_mps - float(velocity @ velocity)
    return np.asarray((along + np.sqrt(along * along + gain * (offsets_m**2).sum(axis=1))) / gain)
