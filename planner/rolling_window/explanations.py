"""What a person is told of a plan: a sentence, and what a picture of it needs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from planner.geometry.curves import Point
from planner.interface import FloatArray, PlanPicture
from planner.rolling_window.multi_step_search import Track
from planner.rolling_window.window import free_sectors, guide_vector


def sentence(position: Point, goal: Point, nodes: Sequence[Point]) -> str:
    """What is ahead of the aircraft, and on which side it is passed.

    Args:
        position: of the aircraft.
        goal: of the mission.
        nodes: track points of the course, the goal last.
    """
    ux, uy, left = guide_vector(position, goal)
    if len(nodes) < 2:
        return f"way to the goal in view, {left / 1000:.1f} km to go"
    x, y = nodes[0][0] - position[0], nodes[0][1] - position[1]
    side = "left" if ux * y - uy * x > 0.0 else "right"
    return f"obstacle ahead at {math.hypot(x, y) / 1000:.1f} km, passing {side}"


def no_way_through(gaps: str) -> str:
    """Why the goal cannot be reached; `gaps` says what is wrong with those in the chain."""
    return f"a closed chain of obstacles lies between the aircraft and the goal: {gaps}"


def picture(
    position: Point,
    goal: Point,
    nodes: Sequence[Point],
    tracks: Iterable[Track],
    window_m: float,
    points_m: FloatArray,
    keep_m: float,
    met_m: FloatArray,
) -> PlanPicture:
    """Guide vector, planning window with its free sectors, what was compared (the chosen course first), what is met."""
    return PlanPicture(
        guide_m=np.array([position, goal]),
        window_m=window_m,
        sectors=free_sectors(points_m, keep_m, position),
        candidates=(np.array([position, *nodes]), *(np.array(track.nodes) for track in tracks)),
        met_m=met_m,
    )
