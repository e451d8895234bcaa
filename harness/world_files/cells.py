"""Cells of a raster as polygons, in columns and rows and in the local plane; and simpler outlines that only grow.

Notches of outlines are filled, nothing solid is ever cut away.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import shapely

from harness.world_files.height_field import window_of
from harness.world_files.parts import BoolArray, Box, FloatArray, Raster
from harness.world_files.plane import Mapping

MAX_RUNS: Final = 100_000
"""Cells of a mask with more runs along its rows are taken together two by two first."""
LONGEST_EDGE_CELLS: Final = 64
"""Outlines of cells are bent into the plane with a point at least this often: to a hundredth of a cell."""
MOST_GROWTH: Final = 0.005
"""Share of a polygon's area that filling its notches may add."""
PASSES: Final = 3
STRAIGHT_M: Final = 1e-9
"""A corner so near to the line through its neighbours is none."""


def outlines(mask: BoolArray) -> tuple[list[Any], int]:
    """Polygons (with holes) round the cells that are set, and how many cells a side were taken together.

    The cell in column i and row j of a (rows, columns) mask covers i to i + 1 and j to j + 1. Of a mask so ragged that
    nobody could fly with its outlines, coarser cells are taken, each set if any of its cells is.
    """
    factor = 1
    rows, begins, ends = _runs(mask)
    while len(rows) > MAX_RUNS:
        even = np.pad(mask, [(0, size % 2) for size in mask.shape])
        factor, mask = 2 * factor, even[::2, ::2] | even[1::2, ::2] | even[::2, 1::2] | even[1::2, 1::2]
        rows, begins, ends = _runs(mask)
    if not len(rows):
        return [], factor
    # Runs of the same columns in rows that follow each other are one box.
    order = np.lexsort((rows, ends, begins))
    rows, begins, ends = rows[order], begins[order], ends[order]
    goes_on = (np.diff(rows) == 1) & (np.diff(begins) == 0) & (np.diff(ends) == 0)
    first = np.flatnonzero(np.append(True, ~goes_on))
    last = np.append(first[1:], len(rows)) - 1
    boxes = shapely.box(begins[first], rows[first], ends[first], rows[last] + 1)
    whole = shapely.simplify(shapely.union_all(boxes), 0.0)
    return list(shapely.transform(shapely.get_parts(whole), lambda places: factor * places)), factor


def _runs(mask: BoolArray) -> tuple[Any, Any, Any]:
    """Row, first column and column behind the last of each run of set cells along a row."""
    change = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, begins = np.nonzero(change == 1)
    return rows, begins, np.nonzero(change == -1)[1]


def placed_cells(raster: Raster, solid: BoolArray, mapping: Mapping, box: Box) -> tuple[list[Any], int]:
    """Outlines in the plane of the cells of a raster that are solid, (rows, columns), those outside of a box left out.

    Also how many cells a side were taken together.
    """
    rows, columns = window_of(raster, mapping, box)
    polygons, factor = outlines(solid[rows, columns])

    def place(points: FloatArray) -> FloatArray:
        x, y = raster.places(points[:, 0] + columns.start, points[:, 1] + rows.start)
        return np.column_stack(mapping.to_plane(x, y))

    shapes = np.array(polygons, dtype=object)
    dense = shapely.segmentize(shapes, LONGEST_EDGE_CELLS) if mapping.crs else shapes
    return list(shapely.transform(dense, place)), factor


def simplified(polygons: Sequence[Any], tolerance_m: float) -> list[Any]:
    """Polygons with fewer corners that cover the given ones, which are valid.

    A corner that points into the solid is left out where the notch that it makes is not deeper than the tolerance,
    small notches first, until `MOST_GROWTH` of the polygon's area has been added; corners on a straight line are
    left out as well. Each of at most `PASSES` passes moves an edge by no more than the tolerance.
    """
    given = shapely.orient_polygons(np.array(polygons, dtype=object))
    convex = shapely.area(shapely.convex_hull(given)) <= shapely.area(given) * (1.0 + 1e-12)
    grown = [_grown(polygon, tolerance_m) for polygon in given[~convex]]
    pieces = shapely.get_parts(np.concatenate((given[convex], np.array(grown, dtype=object))))
    return [each for each in pieces if each.geom_type == "Polygon" and each.area > 0]


def _grown(polygon: Any, tolerance_m: float) -> Any:
    """A polygon with its notches filled."""
    budget = MOST_GROWTH * polygon.area / PASSES
    before = rings = [shapely.get_coordinates(ring) for ring in (polygon.exterior, *polygon.interiors)]
    for _ in range(PASSES):
        rings = [_filled(ring, tolerance_m, budget) for ring in rings]
    if sum(map(len, rings)) == sum(map(len, before)):
        return polygon
    grown = shapely.Polygon(rings[0], [ring for ring in rings[1:] if len(ring) >= 4])
    if not grown.is_valid:
        grown = shapely.make_valid(grown, method="structure", keep_collapsed=False)
    # By rounding, or for what stands in a notch, it may not cover the polygon.
    return grown if shapely.covers(grown, polygon) else shapely.union(grown, polygon)


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
