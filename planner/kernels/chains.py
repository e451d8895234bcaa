"""Chains of edge points by union-find with the parity of their crossings; compiled, see `planner.kernels`."""

from __future__ import annotations

import math

from planner.compiled import BOOL, BOOLS_OUT, COUNT, COUNTS_OUT, FLOAT, FLOATS, ROWS, compiled
from planner.interface import BoolArray, FloatArray, IntArray

OUTSIDE = 0  # number of the node that stands for the border and all outside of the area


@compiled(COUNTS_OUT, BOOLS_OUT, COUNT, inner=True)
def root_of(parent: IntArray, parity: BoolArray, node: int) -> tuple[int, bool]:
    """The root of a node's tree and the parity of crossings on the way there; shortens the way."""
    root, odd = node, False
    while parent[root] != root:
        odd ^= parity[root]
        root = parent[root]
    left = odd
    while parent[node] != root and node != root:
        after, crosses = parent[node], parity[node]
        parent[node], parity[node] = root, left
        node, left = after, left ^ crosses
    return root, odd


@compiled(FLOAT, FLOAT, FLOAT, FLOAT, ROWS, inner=True)
def crosses_line(ax: float, ay: float, bx: float, by: float, ends: FloatArray) -> bool:
    """Whether the line from a to b crosses that from start to goal."""
    sx, sy, dx, dy = ends[0, 0], ends[0, 1], ends[1, 0] - ends[0, 0], ends[1, 1] - ends[0, 1]
    side_a = dx * (ay - sy) - dy * (ax - sx)
    side_b = dx * (by - sy) - dy * (bx - sx)
    if (side_a > 0.0) == (side_b > 0.0):
        return False
    share = side_a / (side_a - side_b)
    x, y = ax + share * (bx - ax), ay + share * (by - ay)
    return bool(0.0 <= (x - sx) * dx + (y - sy) * dy < dx * dx + dy * dy)


@compiled(COUNTS_OUT, BOOLS_OUT, COUNT, COUNT, BOOL, inner=True)
def link(parent: IntArray, parity: BoolArray, a: int, b: int, crosses: bool) -> bool:
    """Links two nodes; returns whether that closes a chain that separates start and goal."""
    root_a, parity_a = root_of(parent, parity, a)
    root_b, parity_b = root_of(parent, parity, b)
    odd = parity_a ^ parity_b ^ crosses
    if root_a == root_b:
        return odd
    parent[root_a], parity[root_a] = root_b, odd
    return False


@compiled(ROWS, COUNT, COUNTS_OUT, BOOLS_OUT, COUNTS_OUT, COUNTS_OUT, ROWS, FLOATS, FLOAT, FLOAT)
def link_all(
    places: FloatArray,
    first: int,
    parent: IntArray,
    parity: BoolArray,
    last: IntArray,
    before: IntArray,
    ends: FloatArray,
    bounds: FloatArray,
    clearance: float,
    border: float,
) -> bool:
    """Links each node from `first` on with all nodes before it that are near; returns whether that closes a chain."""
    closed, reach = False, 2.0 * clearance
    for node in range(first, len(places)):
        x, y = places[node, 0], places[node, 1]
        parent[node] = node
        for side in range(4):
            border_x = bounds[2 * side] if side < 2 else x
            border_y = y if side < 2 else bounds[2 * side - 3]
            if math.hypot(border_x - x, border_y - y) >= clearance + border:
                continue
            from_start = math.hypot(border_x - ends[0, 0], border_y - ends[0, 1])
            from_goal = math.hypot(border_x - ends[1, 0], border_y - ends[1, 1])
            if min(from_start, from_goal) >= border:
                closed |= link(parent, parity, node, OUTSIDE, crosses_line(x, y, border_x, border_y, ends))
        column, row = math.floor(x / reach), math.floor(y / reach)
        for i in range(column - 1, column + 2):
            for j in range(row - 1, row + 2):
                other = last[(i * 7919 + j) % len(last)]
                while other > 0:
                    other_x, other_y = places[other, 0], places[other, 1]
                    if (other_x - x) * (other_x - x) + (other_y - y) * (other_y - y) < reach * reach:
                        closed |= link(parent, parity, node, other, crosses_line(x, y, other_x, other_y, ends))
                    other = before[other]
        square = (column * 7919 + row) % len(last)
        before[node], last[square] = last[square], node
    return closed
