"""The multi-step search against the exact shortest way."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable
from itertools import islice

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.geometry.curves import Point
from planner.geometry.terrain import Tally
from planner.interface import FloatArray, MovingEdges
from planner.memory import ObstacleMemory
from planner.rolling_window.cost_to_go import CostToGo
from planner.rolling_window.multi_step_search import Candidate, search_candidates
from planner.rolling_window.window import Window
from tests.examples import examples

MakePoints = Callable[..., FloatArray]
SPACING, KEEP, OUTER = 50.0, 212.0, 220.0
START, GOAL = (0.0, 0.0), (20_000.0, 0.0)
BOUNDS = (-15_000.0, -15_000.0, 35_000.0, 15_000.0)


class _Still:
    """Edge points that are all known from the start."""

    spacing_m, revision, last_removal_revision = SPACING, 1, 0
    moving: tuple[MovingEdges, ...] = ()
    last_contradiction_s = -math.inf

    def __init__(self, points: FloatArray) -> None:
        self._points = points

    def edges_since(self, revision: int) -> FloatArray:
        return self._points if revision < 1 else self._points[:0]

    def seen_free(self, points_m: FloatArray) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        return np.ones(len(points_m), dtype=np.bool_)


def window_of(*obstacles: FloatArray) -> Window:
    points = np.concatenate((np.zeros((0, 2)), *obstacles))
    memory = ObstacleMemory(200.0)
    memory.take_in(_Still(points))
    return Window(START, points, memory.labels.copy(), SPACING, np.full(len(points), KEEP))


def tracks_in(
    window: Window,
    steps: int = 16,
    keep_best: int = 6,
    bounds: tuple[float, float, float, float] = BOUNDS,
    goal: Point = GOAL,
    around: Iterable[int] = (),
    wide: bool = False,
    to_go: CostToGo | None = None,
) -> list[Candidate]:
    """The first dozen tracks, after a look at what is promised of each."""
    found = search_candidates(
        window,
        goal,
        bounds,
        steps=steps,
        keep_best=keep_best,
        outer_m=OUTER,
        most_tracks=1200,
        around=around,
        wide=wide,
        to_go=to_go,
    )
    tracks = list(islice((track for track in found if track is not None), 12))
    points = shapely.points(window.points_m)
    for track in tracks:
        assert track.nodes[0] == START
        assert track.nodes[-1] == goal
        line = shapely.LineString(track.nodes)
        assert track.cost_m == pytest.approx(line.length, rel=1e-9)
        assert len(track.nodes) <= steps + 2
        assert shapely.distance(line, points).min(initial=math.inf) > KEEP * (1.0 - 1e-6)
        for x, y in track.nodes:
            assert bounds[0] <= x <= bounds[2]
            assert bounds[1] <= y <= bounds[3]
    if to_go is None:
        assert [track.cost_m for track in tracks] == sorted(track.cost_m for track in tracks)
    return tracks


def shortest_m(window: Window, goal: Point = GOAL) -> float:
    """Length of the shortest way that keeps the distance: a visibility graph round the grown points."""
    # Corners lie a little outside and the core a little inside: lines along the edge count as clear.
    blocked = shapely.union_all(shapely.buffer(shapely.points(window.points_m), KEEP, quad_segs=4)).simplify(
        4.0
    )
    vertices = shapely.get_coordinates(blocked.buffer(10.0, quad_segs=4).simplify(8.0))
    core = blocked.buffer(-10.0).simplify(4.0)
    shapely.prepare(core)
    places = np.concatenate(([START, goal], vertices))
    i, j = np.triu_indices(len(places), 1)
    lines = shapely.linestrings(np.stack((places[i], places[j]), axis=1))
    clear = ~shapely.intersects(core, lines)
    ways: list[list[tuple[int, float]]] = [[] for _ in places]
    for a, b, length in zip(
        i[clear].tolist(), j[clear].tolist(), shapely.length(lines[clear]).tolist(), strict=True
    ):
        ways[a].append((b, length))
        ways[b].append((a, length))
    best, queue = {0: 0.0}, [(0.0, 0)]
    while queue:
        so_far, place = heapq.heappop(queue)
        if place == 1:
            return so_far
        for other, length in ways[place]:
            if so_far + length < best.get(other, math.inf):
                best[other] = so_far + length
                heapq.heappush(queue, (best[other], other))
    return math.inf


def assert_near_the_optimum(window: Window, share: float = 1.02) -> None:
    tracks, optimum = tracks_in(window), shortest_m(window)
    assert math.isfinite(optimum)
    assert tracks
    assert 0.995 * optimum < tracks[0].cost_m < share * optimum


def test_with_nothing_in_the_way_the_track_is_the_guide_vector() -> None:
    tracks = tracks_in(window_of())
    assert [track.nodes for track in tracks] == [(START, GOAL)]


def test_round_one_circle(ring: MakePoints) -> None:
    window = window_of(ring(9000.0, 800.0, 3000.0, SPACING))
    assert_near_the_optimum(window)
    # The exact length is that of two tangents and the arc between them.
    (x, y), r = (9000.0, 800.0), 3000.0 + KEEP
    near, far = math.hypot(x, y), math.hypot(GOAL[0] - x, y)
    seen = math.acos((x * (x - GOAL[0]) + y * y) / (near * far))
    arc = r * (seen - math.acos(r / near) - math.acos(r / far))
    exact = math.sqrt(near**2 - r**2) + math.sqrt(far**2 - r**2) + arc
    assert tracks_in(window)[0].cost_m == pytest.approx(exact, rel=0.005)


def test_through_the_gap_between_two_circles(ring: MakePoints) -> None:
    window = window_of(ring(8000.0, 2500.0, 2200.0, SPACING), ring(8500.0, -2600.0, 2300.0, SPACING))
    assert_near_the_optimum(window)
    crossing = shapely.LineString(tracks_in(window)[0].nodes).intersection(
        shapely.LineString([(8000.0, -15_000.0), (8000.0, 15_000.0)])
    )
    assert abs(crossing.y) < 400.0


def test_not_through_a_gap_that_is_too_narrow(ring: MakePoints) -> None:
    # 300 m are left between the circles, and twice 212 m have to be kept.
    window = window_of(ring(8000.0, 2350.0, 2200.0, SPACING), ring(8000.0, -2350.0, 2200.0, SPACING))
    assert_near_the_optimum(window)
    line = shapely.LineString(tracks_in(window)[0].nodes)
    assert line.distance(shapely.Point(8000.0, 0.0)) > 2200.0


def test_through_the_gap_in_a_wall(wall: MakePoints) -> None:
    window = window_of(
        wall((9000.0, -9000.0), (9000.0, 2000.0), SPACING), wall((9000.0, 3000.0), (9000.0, 9000.0), SPACING)
    )
    assert_near_the_optimum(window)


def test_two_circles_one_behind_the_other(ring: MakePoints) -> None:
    window = window_of(ring(6000.0, 700.0, 2000.0, SPACING), ring(13_000.0, -600.0, 2500.0, SPACING))
    assert_near_the_optimum(window)


@pytest.mark.flights
@settings(max_examples=examples(12))
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 4))
def test_fields_of_circles(seed: int, count: int, ring: MakePoints) -> None:
    rng = np.random.default_rng(seed)
    circles = np.column_stack(
        (
            rng.uniform(3500.0, 16_500.0, count),
            rng.uniform(-4000.0, 4000.0, count),
            rng.uniform(300, 2000.0, count),
        )
    )
    ends = np.hypot(circles[:, 0, None] - (0.0, 20_000.0), circles[:, 1, None]) - circles[:, 2, None]
    assume(ends.min() > OUTER + 200.0)
    window = window_of(*(ring(x, y, r, SPACING) for x, y, r in circles.tolist()))
    assert_near_the_optimum(window, 1.03)


def test_no_more_steps_than_asked_for(ring: MakePoints) -> None:
    window = window_of(ring(6000.0, 0.0, 2000.0, SPACING), ring(13_000.0, 0.0, 2500.0, SPACING))
    # A step round the first circle does not yet show the goal.
    assert tracks_in(window, steps=1) == []
    assert all(len(track.nodes) > 3 for track in tracks_in(window))


def test_so_many_tracks_are_kept_at_every_step(ring: MakePoints) -> None:
    window = window_of(ring(9000.0, 0.0, 3000.0, SPACING))
    # Left or right of one circle: with one track kept at every step, the worse of them is dropped.
    sides = {math.copysign(1.0, track.nodes[1][1]) for track in tracks_in(window, keep_best=6)}
    assert sides == {1.0, -1.0}
    assert len({math.copysign(1.0, track.nodes[1][1]) for track in tracks_in(window, keep_best=1)}) == 1
    assert len(tracks_in(window, keep_best=1)) == 1


def test_more_tracks_are_never_worse(ring: MakePoints) -> None:
    window = window_of(
        ring(6000.0, 300.0, 2000.0, SPACING),
        ring(13_000.0, -400.0, 2500.0, SPACING),
        ring(10_000.0, 4500.0, 2000.0, SPACING),
    )
    few, many = tracks_in(window, keep_best=2), tracks_in(window, keep_best=12)
    assert many[0].cost_m <= few[0].cost_m + 1e-6


def test_bounds_force_the_longer_way_round(ring: MakePoints) -> None:
    window = window_of(ring(9000.0, 800.0, 3000.0, SPACING))
    free = tracks_in(window)[0]
    assert min(y for _, y in free.nodes) < -2000.0
    # What passes south lies outside; the way round the north is left.
    bound = tracks_in(window, bounds=(-15_000.0, -1500.0, 35_000.0, 15_000.0))[0]
    assert max(y for _, y in bound.nodes) > 3500.0
    assert bound.cost_m > free.cost_m


def test_a_wall_across_the_bounds_has_no_way_round(wall: MakePoints) -> None:
    window = window_of(wall((9000.0, -1000.0), (9000.0, 1000.0), SPACING))
    assert tracks_in(window)
    assert tracks_in(window, bounds=(-1000.0, -1000.0, 35_000.0, 1000.0)) == []


CELL, CELLS = 1000.0, 4
WITHIN = (-0.5 * CELL, -0.5 * CELL, (CELLS - 0.5) * CELL, (CELLS - 0.5) * CELL)
CORNER = ((CELLS - 1) * CELL, (CELLS - 1) * CELL)


def connected(points: FloatArray, keep_m: float) -> bool:
    """Whether a point can get from corner to corner and keep a distance from all points."""
    discs = shapely.union_all(shapely.buffer(shapely.points(points), keep_m, quad_segs=32))
    parts = shapely.get_parts(shapely.box(*WITHIN).difference(discs))
    return any(all(part.contains(shapely.Point(end)) for end in (START, CORNER)) for part in parts)


@pytest.mark.flights
@settings(max_examples=examples(20))
@given(
    walls=st.lists(st.booleans(), min_size=2 * CELLS * (CELLS - 1), max_size=2 * CELLS * (CELLS - 1)),
    led=st.booleans(),
)
def test_in_a_maze_there_are_tracks_just_where_there_is_a_way(
    walls: list[bool], led: bool, wall: MakePoints
) -> None:
    lines: list[tuple[Point, Point]] = []
    for line in range(CELLS - 1):
        for row in range(CELLS):
            at, low = (line + 0.5) * CELL, (row - 0.5) * CELL
            lines += [((at, low), (at, low + CELL)), ((low, at), (low + CELL, at))]
    pieces = [wall(a, b, SPACING) for (a, b), there in zip(lines, walls, strict=True) if there]
    window = window_of(*pieces)
    to_go = None
    if led and len(window.points_m):
        to_go = CostToGo(START, CORNER, WITHIN, window.points_m, window.keep_m, Tally())
        for _ in to_go.spread():
            pass
    tracks = tracks_in(window, steps=64, keep_best=48, bounds=WITHIN, goal=CORNER, wide=True, to_go=to_go)
    if connected(window.points_m, 1.1 * KEEP):
        assert tracks
        assert tracks[0].cost_m >= math.dist(START, CORNER) * (1.0 - 1e-9)
    elif not connected(window.points_m, 0.97 * KEEP):
        assert not tracks


def test_the_first_step_may_lead_past_what_does_not_lie_towards_the_goal(
    ring: MakePoints, wall: MakePoints
) -> None:
    window = window_of(
        ring(6000.0, 0.0, 600.0, SPACING), wall((-3000.0, -2000.0), (3000.0, -2000.0), SPACING)
    )
    ahead, beside = window.labels[0], window.labels[-1]
    assert window.nearest_obstacles(1) == [beside]
    assert window.nearest_obstacles(5) == [beside, ahead]

    def passes_the_end_of_the_wall(tracks: list[Candidate]) -> bool:
        return any(math.dist(track.nodes[1], (-3000.0, -2000.0)) < 2.0 * OUTER for track in tracks)

    assert not passes_the_end_of_the_wall(tracks_in(window))
    assert passes_the_end_of_the_wall(tracks_in(window, around=[beside]))
