"""The paper's route optimisation: shortcuts between track points, under the minimum turn radius."""

from __future__ import annotations

from collections.abc import Sequence

from planner.clearance import first_breach, inside_bounds, line_is_clear
from planner.curves import Point, Pose, fillet
from planner.interface import FloatArray, Path


def shortcut(nodes: Sequence[Point], points_m: FloatArray, keep_m: float | FloatArray) -> list[Point]:
    """Drops the track points between each one and the furthest that it sees.

    Args:
        nodes: w_s1 ... w_sn; the first and the last are always kept.
        points_m: (m, 2) edge points.
        keep_m: distance that a connection has to keep from them, one for all or one for each.
    """
    kept = [nodes[0]]
    i = 0
    while i < len(nodes) - 1:
        i = next(
            (
                k
                for k in range(len(nodes) - 1, i + 1, -1)
                if line_is_clear(nodes[i], nodes[k], points_m, keep_m)
            ),
            i + 1,
        )
        kept.append(nodes[i])
    return kept


def flyable(
    start: Pose,
    nodes: Sequence[Point],
    radius_m: float,
    cut_m: float,
    points_m: FloatArray,
    keep_m: float | FloatArray,
    bounds_m: tuple[float, float, float, float],
) -> Path | None:
    """The curve through some track points at the minimum turn radius, if it keeps its distance and the bounds.

    Args:
        start: pose at which the curve begins.
        nodes: track points after `start`, the end last.
        radius_m: minimum turn radius.
        cut_m: how far from a track point a wider turn may pass it.
        points_m: (m, 2) edge points.
        keep_m: distance to be kept from them, one for all or one for each.
        bounds_m: area that must not be left.
    """
    path = fillet(start, nodes, radius_m, cut_m)
    if path is None or not inside_bounds(path, bounds_m):
        return None
    return path if first_breach(path, points_m, keep_m) == float("inf") else None


def optimise(
    start: Pose,
    nodes: Sequence[Point],
    radius_m: float,
    cut_m: float,
    points_m: FloatArray,
    keep_m: float | FloatArray,
    bounds_m: tuple[float, float, float, float],
) -> tuple[list[Point], Path] | None:
    """The shortest flyable curve that shortcuts of a track give.

    All shortcuts are tried first. Where their corners leave no room for the turns, track points are dropped one
    by one from those that are left, and then the track is tried as it came.

    Returns:
        Track points after the start, and the curve; None where no choice can be flown.
    """
    short = shortcut(nodes, points_m, keep_m)[1:]
    choices = [short, *([*short[:i], *short[i + 1 :]] for i in range(len(short) - 1)), list(nodes[1:])]
    for choice in choices:
        path = flyable(start, choice, radius_m, cut_m, points_m, keep_m, bounds_m)
        if path is not None:
            return choice, path
    return None
