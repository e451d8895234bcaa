"""The paper's multi-step search: N steps deep, at every step the n best candidates are kept.

A step goes along the guide vector where nothing is in the way. Otherwise it goes along an edge of one of the
free sectors: by equation (4) the way that is left grows with the angle off the guide vector, so that in the
continuous plane the best direction in a sector is its edge nearest to the guide vector. The step along an edge
is as long as it hugs the obstacle; from there the guide vector may turn inwards.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from planner.geometry.curves import Point
from planner.paper.sectors import distance_left_m
from planner.rolling_window.cost_to_go import CostToGo
from planner.rolling_window.window import SectorEdge, Window, guide_vector

SHORT_OF_SHARE, LEAST_STEP_SHARE = 0.005, 0.01
"""Shares of the kept distance: a step ends so far short of what it meets, to see its edges from there; least length."""

MOST_TURN_RAD, MOST_AWAY_RAD = 2.1, 0.8
"""Largest turn from one step to the next, and largest turn away from the obstacle that the last step hugged; rad."""

APART_SHARE, WIDE_APART_SHARE = 0.06, 0.25
"""Track points nearer to each other than the first share of the distance kept count as one; in a wide search the second
share of the shortest step about a corner counts instead: that step has to lead on."""


class Candidate(NamedTuple):
    """A candidate of the search, or the beginning of one: a polyline, and the edge that the last step hugged."""

    nodes: tuple[Point, ...]
    flown_m: float
    left_m: float
    last: SectorEdge | None = None

    @property
    def cost_m(self) -> float:
        """C: the length (m) of the whole candidate if it meets nothing more."""
        return self.flown_m + self.left_m

    @property
    def hugged(self) -> list[int]:
        """Label of the obstacle that the last step hugged; empty if it hugged none."""
        return [] if self.last is None else [self.last.obstacle]


class Width(NamedTuple):
    """How many steps deep a search goes, how many candidates it keeps at every step, and track points it looks at.

    A `wide` one also takes steps back, and looks at all that lies towards the goal.
    """

    steps: int
    keep_best: int
    most_tracks: int
    wide: bool = False


def search_candidates(
    window: Window,
    goal: Point,
    bounds_m: tuple[float, float, float, float],
    width: Width,
    outer_m: float,
    around: Iterable[int] = (),
    to_go: CostToGo | None = None,
) -> Iterator[Candidate | None]:
    """Searches for ways from the centre of the window to the goal, the least length, or cost `to_go`, first.

    Edges of obstacles are passed at `outer_m`; from the centre those of the obstacles `around` are tried as well.

    Yields:
        Complete candidates, cheapest first, none if the `width` does not suffice; None before each place looked at.
    """
    start, (steps, keep_best, most_tracks, wide) = window.center_m, width
    begin = Candidate((start,), 0.0, guide_vector(start, goal)[2])
    queue = [(_priority_m(begin, to_go), 0, 0, begin)]
    apart_m = _apart_m(window, outer_m, wide)
    kept_at = [0] * (steps + 1)
    visited: set[tuple[int, int]] = set()
    count = 0
    while queue:
        cost, _, depth, candidate = heapq.heappop(queue)
        if not candidate.left_m:
            yield candidate
            continue
        if cost == math.inf:
            return
        here = candidate.nodes[-1]
        place = (round(here[0] / apart_m), round(here[1] / apart_m))
        if place in visited or kept_at[depth] == keep_best:
            continue
        visited.add(place)
        kept_at[depth] += 1
        if len(visited) > most_tracks:
            return
        yield None
        entry_m, labels = window.entered(here, goal)
        count += 1
        if not len(labels):
            whole = Candidate((*candidate.nodes, goal), candidate.cost_m, 0.0)
            heapq.heappush(queue, (candidate.cost_m, count, depth, whole))
            continue
        if depth == steps:
            continue
        beside = [int(labels[entry_m.argmin()]), *(around if not depth else ())]
        if wide:  # whatever lies towards the goal, not only what comes first; and on round what it hugs
            beside += sorted(set(labels.tolist())) + candidate.hugged
        edges = window.sector_edges(here, beside, outer_m)
        for child in _steps(candidate, edges, goal, bounds_m, outer_m, wide):
            count += 1
            heapq.heappush(queue, (_priority_m(child, to_go), count, depth + 1, child))


def _priority_m(begun: Candidate, to_go: CostToGo | None) -> float:
    """Returns the length of the beginning of a candidate with what is left, by the cost to go where that is given."""
    return begun.cost_m if to_go is None else begun.flown_m + to_go(begun.nodes[-1])


def _apart_m(window: Window, outer_m: float, wide: bool) -> float:
    """Returns how far apart track points are that do not count as one, m."""
    if not wide:
        return APART_SHARE * outer_m
    kept_m = float(window.keep_m.max(initial=0.0))
    shortest_m = 2.0 * math.sqrt(outer_m * outer_m - kept_m * kept_m)  # of the steps about a corner
    return max(APART_SHARE * outer_m, WIDE_APART_SHARE * shortest_m)


def _steps(
    candidate: Candidate,
    edges: Iterable[SectorEdge],
    goal: Point,
    bounds_m: tuple[float, float, float, float],
    outer_m: float,
    back_too: bool,
) -> Iterator[Candidate]:
    """Yields the candidate lengthened by a step along each edge, inside the area; those away or back only if wanted."""
    (x, y), last, (xmin, ymin, xmax, ymax) = candidate.nodes[-1], candidate.last, bounds_m
    gx, gy, left_m = guide_vector((x, y), goal)
    for edge in edges:
        if last is not None and not back_too:
            turn = math.atan2(last.ux * edge.uy - last.uy * edge.ux, last.ux * edge.ux + last.uy * edge.uy)
            if abs(turn) > MOST_TURN_RAD or turn * last.side > MOST_AWAY_RAD:
                continue  # shortest ways bend round what they hug
        length_m = min(edge.hugged_m, edge.clear_m - SHORT_OF_SHARE * outer_m)
        east, north = x + edge.ux * length_m, y + edge.uy * length_m
        if length_m < LEAST_STEP_SHARE * outer_m or not (xmin <= east <= xmax and ymin <= north <= ymax):
            continue
        off_guide = math.atan2(gx * edge.uy - gy * edge.ux, gx * edge.ux + gy * edge.uy)
        after_m = distance_left_m(left_m, length_m, off_guide)
        hugged = edge if length_m == edge.hugged_m else None
        yield Candidate((*candidate.nodes, (east, north)), candidate.flown_m + length_m, after_m, hugged)
