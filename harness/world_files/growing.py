"""Simpler outlines that only grow: notches are filled, nothing solid is ever cut away."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

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
    worth = _improvable(given, tolerance_m)
    result = list(given[~worth])
    for polygon in given[worth]:
        budget = MOST_GROWTH * polygon.area / PASSES
        shell = shapely.get_coordinates(polygon.exterior)
        rings = [shapely.get_coordinates(ring) for ring in polygon.interiors]
        for _ in range(PASSES if tolerance_m > 0 else 1):
            shell, rings = (
                _filled(shell, tolerance_m, budget),
                [_filled(r, tolerance_m, budget) for r in rings],
            )
        grown = shapely.Polygon(shell, [ring for ring in rings if len(ring) >= 4])
        if not grown.is_valid:
            grown = shapely.make_valid(grown, method="structure", keep_collapsed=False)
        if not shapely.covers(grown, polygon):  # rounding, or a notch with something in it
            grown = shapely.union(grown, polygon)
        result += [each for each in shapely.get_parts(grown) if each.geom_type == "Polygon" and each.area > 0]
    return result


def _improvable(polygons: NDArray[np.object_], tolerance_m: float) -> BoolArray:
    """Which of many polygons, their solid on the left, have a corner that could be left out."""
    import shapely

    found = np.zeros(len(polygons), dtype=np.bool_)
    if not len(polygons):
        return found
    rings, of = shapely.get_rings(polygons, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    # Of a closed ring its last point is its first: each corner is looked at once, between its neighbours.
    inner = np.flatnonzero(ring[1:] == ring[:-1])
    starts = np.append(True, ring[1:] != ring[:-1])
    last = np.append(np.flatnonzero(starts)[1:], len(points)) - 1
    before = np.where(starts[inner], last[ring[inner]] - 1, inner - 1)
    into, on = points[inner] - points[before], points[inner + 1] - points[inner]
    base = points[inner + 1] - points[before]
    turn = into[:, 0] * on[:, 1] - into[:, 1] * on[:, 0]
    depth = np.abs(turn) / np.maximum(np.hypot(base[:, 0], base[:, 1]), 1e-12)
    straight = ((into * on).sum(axis=1) > 0) & (np.abs(turn) <= STRAIGHT_M * np.hypot(on[:, 0], on[:, 1]))
    notch = (turn < 0) & (depth <= tolerance_m) if tolerance_m > 0 else np.zeros(len(inner), dtype=np.bool_)
    found[of[ring[inner[straight | notch]]]] = True
    return found


def _filled(ring: FloatArray, tolerance_m: float, budget_m2: float) -> FloatArray:
    """One pass over a closed ring with the solid on its left; corners next to one another are not both left out."""
    points = _without_straight(ring[:-1])
    if len(points) <= 4:
        return np.vstack((points, points[:1]))
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    into, on = points - before, after - points
    base = after - before
    turn = into[:, 0] * on[:, 1] - into[:, 1] * on[:, 0]
    length = np.hypot(base[:, 0], base[:, 1])
    depth = np.abs(turn) / np.maximum(length, 1e-12)
    notch = (turn < 0) & (depth <= tolerance_m)
    kept = points[~_apart(np.where(notch, 0.5 * np.abs(turn), np.inf), budget_m2)]
    return np.vstack((kept, kept[:1])) if len(kept) >= 3 else ring


def _without_straight(points: FloatArray) -> FloatArray:
    """Points of a ring without those between two others on one line."""
    into, on = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turn = np.abs(into[:, 0] * on[:, 1] - into[:, 1] * on[:, 0])
    forward = (into * on).sum(axis=1) > 0
    straight = forward & (turn <= STRAIGHT_M * np.hypot(on[:, 0], on[:, 1]))
    kept = points[~straight]
    return kept if len(kept) >= 3 else points


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
