"""The paper's multi-step search: N steps deep, at every step the n best tracks are kept.

A step goes along the guide vector where nothing is in the way. Otherwise it goes along an edge of one of the free
sectors: by equation (4) the way that is left grows with the angle off the guide vector, so that in the
continuous plane the best direction in a sector is its edge nearest to the guide vector. The step along an edge is as long
as it hugs the obstacle; from there the guide vector may turn inwards.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass

import numpy as np

from planner.clearance import first_entry
from planner.curves import Point
from planner.step_model import distance_left_m
from planner.window import SectorEdge, Window, guide_vector

DETOUR = 1.03
"""Tracks this much longer than the best one are not worth keeping."""


@dataclass(frozen=True)
class Track:
    """A track of steps: a candidate or the beginning of one.

    Attributes:
        nodes: track points, from the present one on.
        flown_m: length of the steps.
        left_m: distance from the last track point to the goal.
    """

    nodes: tuple[Point, ...]
    flown_m: float
    left_m: float

    @property
    def cost_m(self) -> float:
        """C: the length of the whole track if nothing more is met."""
        return self.flown_m + self.left_m


def search(
    window: Window,
    goal: Point,
    bounds_m: tuple[float, float, float, float],
    *,
    steps: int,
    keep_best: int,
    outer_m: float,
) -> list[Track]:
    """Candidate tracks from the centre of the window to the goal, cheapest first.

    Args:
        window: the planning window; `window.keep_m` is kept from every point in it.
        goal: where the guide vector points.
        bounds_m: area that no track point may leave.
        steps: N, how many steps are looked ahead.
        keep_best: n: at every step so many tracks are kept, and so many are returned at most.
        outer_m: track points lie this far from the obstacle that they pass, a little more than `window.keep_m`, so
            that steps around a round obstacle are long.

    Returns:
        At most n tracks that see the goal from their last track point but one; none where n tracks at
        every one of N steps were not enough.
    """
    start = window.center_m
    queue = [(guide_vector(start, goal)[2], 0, 0, Track((start,), 0.0, guide_vector(start, goal)[2]))]
    kept_at = [0] * (steps + 1)
    reached: dict[tuple[int, int], float] = {}
    found: list[Track] = []
    count = 0
    while queue and len(found) < keep_best:
        cost, _, depth, track = heapq.heappop(queue)
        if found and cost > DETOUR * found[0].cost_m:
            break
        here = track.nodes[-1]
        place = (round(here[0] / (0.2 * outer_m)), round(here[1] / (0.2 * outer_m)))
        if reached.get(place, math.inf) <= track.flown_m or kept_at[depth] == keep_best:
            continue
        reached[place] = track.flown_m
        kept_at[depth] += 1
        _, hit = first_entry(here, goal, window.points_m, window.keep_m)
        if hit < 0:
            found.append(Track((*track.nodes, goal), track.cost_m, 0.0))
            continue
        if depth == steps:
            continue
        for edge in window.sector_edges(here, int(window.labels[hit])):
            child = _step(window, track, edge, goal, outer_m)
            if child is not None and _inside(child.nodes[-1], bounds_m):
                count += 1
                heapq.heappush(queue, (child.cost_m, count, depth + 1, child))
    return sorted(found, key=lambda track: track.cost_m)


def _step(window: Window, track: Track, edge: SectorEdge, goal: Point, outer_m: float) -> Track | None:
    """One step along the edge of a free sector."""
    here = track.nodes[-1]
    length = min(_hugged(window, here, edge, outer_m), edge.clear_m)
    if length < 1e-2 * outer_m:
        return None
    x, y = here[0] + edge.ux * length, here[1] + edge.uy * length
    gx, gy, left = guide_vector(here, goal)
    off_guide = math.atan2(gx * edge.uy - gy * edge.ux, gx * edge.ux + gy * edge.uy)
    return Track((*track.nodes, (x, y)), track.flown_m + length, distance_left_m(left, length, off_guide))


def _hugged(window: Window, origin: Point, edge: SectorEdge, outer_m: float) -> float:
    """How far along an edge the outer distance from what it touches is reached again."""
    dx, dy = window.points_m[:, 0] - origin[0], window.points_m[:, 1] - origin[1]
    ahead = dx * edge.ux + dy * edge.uy
    beside = dx * edge.uy - dy * edge.ux
    reach = outer_m * outer_m - beside * beside
    near = (reach > 0.0) & (ahead > -outer_m)
    ahead, reach = ahead[near], np.sqrt(reach[near])
    order = np.argsort(ahead - reach)
    begin, end = (ahead - reach)[order], np.maximum.accumulate((ahead + reach)[order])
    gap = np.flatnonzero((begin[1:] > end[:-1]) & (end[:-1] > edge.touch_m))
    return float(end[gap[0]] if len(gap) else end[-1])


def _inside(point: Point, bounds_m: tuple[float, float, float, float]) -> bool:
    xmin, ymin, xmax, ymax = bounds_m
    return xmin <= point[0] <= xmax and ymin <= point[1] <= ymax
