"""The paper's route optimisation: shortcuts between track points, under the minimum turn radius."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.geometry.course import Route
from planner.geometry.curves import Limits, Point, Pose, fillet
from planner.geometry.terrain import POINT_WORK, Terrain
from planner.kernels.fans import shortcuts

MOST_LEFT_OUT = 6
"""Most corners, from the first on, that are left out one at a time, or are passed in the turn at the start."""


def shortcut(nodes: Sequence[Point], terrain: Terrain) -> list[Point]:
    """Drops the track points between each one and the furthest that it sees; the first and the last stay."""
    indices, lines = shortcuts(terrain.squares, np.array(nodes))
    terrain.work_count.add(lines, POINT_WORK, lines * len(terrain.points_m))
    return [nodes[i] for i in indices.tolist()]


def optimise(
    start: Pose,
    start_curvature: float,
    nodes: Sequence[Point],
    limits: Limits,
    cut_m: float,
    terrain: Terrain,
) -> Route | None:
    """The curve through the shortcuts of a track that `terrain` admits, no tighter than the limits; None: none does.

    All shortcuts are taken first. Where their corners leave no room for the turns, or the curve comes too near
    to something, the turn that is being flown at the start is flown on, past the first corners; then the first turn
    is flown the other way round, then one corner after the other is left out, then corners are rounded as tightly
    as may be, and then the track is tried as it came.
    """
    if len(nodes) < 2:
        return None
    short = shortcut(nodes, terrain)[1:]
    tightest = limits.radius_m
    choices = [(short, cut_m, False, tightest)]
    if start_curvature:
        flown = max(1.0 / abs(start_curvature), tightest)
        choices += [(short[i:], cut_m, False, flown) for i in range(min(len(short), MOST_LEFT_OUT))]
    choices += [(short, cut_m, True, tightest)]
    left_out = range(min(len(short) - 1, MOST_LEFT_OUT))
    choices += [([*short[:i], *short[i + 1 :]], cut_m, False, tightest) for i in left_out]
    uncut = ((short, False), (short, True), (list(nodes[1:]), False))
    choices += [(way, 0.0, longer, tightest) for way, longer in uncut]
    for choice, cut, longer_turn, first_radius in choices:
        path = fillet(start, choice, limits, cut, start_curvature, longer_turn, first_radius)
        if path is not None and terrain.admits(path):
            return Route(tuple(choice), path)
    return None
