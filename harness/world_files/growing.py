"""Simpler outlines that only grow: notches are filled, nothing solid is ever cut away."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from harness.world_files.parts import BoolArray, FloatArray

MOST_GROWTH: Final = 0.005
"""Share of a polygon's area that filling its notches may add."""
PASSES: Final = 3
STRAIGHT_M: Final = 1e-9
"""A corner so near to the line through its neighbours is none."""


def simplified(polygons: Sequence[Any], tolerance_m: float) -> list[Any]:
    """Polygons with fewer corners that cover the given ones.

    A corner that points into the solid is left out where the notch that it makes is not deeper than the tolerance,
    small notches first, until `MOST_GROWTH` of the polygon's area has been added; corners on a straight line are
    left out as well. Each of at most `PASSES` passes moves an edge by no more than the tolerance.

    Args:
        polygons: valid shapely polygons.
        tolerance_m: at least 0.
    """
    import shapely

    given = shapely.orient_polygons(np.array(polygons, dtype=object))
    convex = shapely.area(shapely.convex_hull(given)) <= shapely.area(given) * (1.0 + 1e-12)
    result = list(given[convex])
    for polygon in given[~convex]:
        budget = MOST_GROWTH * polygon.area / PASSES
        rings = [shapely.get_coordinates(ring) for ring in (polygon.exterior, *polygon.interiors)]
        corners = sum(map(len, rings))
        for _ in range(PASSES):
            rings, before = [_filled(ring, tolerance_m, budget) for ring in rings], sum(map(len, rings))
            if sum(map(len, rings)) == before:
                break
        if before == corners:
            result.append(polygon)
            continue
        grown = shapely.Polygon(rings[0], [ring for ring in rings[1:] if len(ring) >= 4])
        if not grown.is_valid:
            grown = shapely.make_valid(grown, method="structure", keep_collapsed=False)
        if not shapely.covers(grown, polygon):  # rounding, or a notch with something in it
            grown = shapely.union(grown, polygon)
        result += [each for each in shapely.get_parts(grown) if each.geom_type == "Polygon" and each.area > 0]
    return result


def _filled(ring: FloatArray, tolerance_m: float, budget_m2: float) -> FloatArray:
    """One pass over a closed ring with the solid on its left; corners next to one another are not both left out."""
    points = ring[:-1]
    turn, base, on, forward = _bends(points)
    straight = forward & (np.abs(turn) <= STRAIGHT_M * on)
    if 3 <= len(points) - straight.sum() < len(points):
        points = points[~straight]
        turn, base, on, forward = _bends(points)
    if len(points) <= 4:
        return np.vstack((points, points[:1]))
    notch = (turn < 0) & (np.abs(turn) / np.maximum(base, 1e-12) <= tolerance_m)
    kept = points[~_apart(np.where(notch, 0.5 * np.abs(turn), np.inf), budget_m2)]
    return np.vstack((kept, kept[:1])) if len(kept) >= 3 else ring


def _bends(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Of each corner of a closed ring: twice the area that it adds, the base from neighbour to neighbour, the edge on.

    The area is negative in a notch; the last is whether the ring goes on forwards.
    """
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    into, on, base = points - before, after - points, after - before
    turn = into[:, 0] * on[:, 1] - into[:, 1] * on[:, 0]
    return turn, np.hypot(base[:, 0], base[:, 1]), np.hypot(on[:, 0], on[:, 1]), (into * on).sum(axis=1) > 0


def _apart(cost: FloatArray, budget: float) -> BoolArray:
    """Which to leave out: the cheapest first, never two neighbours, until the budget is used up."""
    drop = np.zeros(len(cost), dtype=np.bool_)
    spent = 0.0
    for index in np.argsort(cost, kind="stable").tolist():
        price = float(cost[index])
        if not np.isfinite(price) or spent + price > budget:
            break
        if not (drop[index - 1] or drop[(index + 1) % len(cost)]):
            drop[index] = True
            spent += price
    return drop
