"""The multi-step search finds tracks just where plane geometry has a way."""

import math
from collections.abc import Iterable
from itertools import islice

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.geometry.curves import Point
from planner.geometry.terrain import WorkCount
from planner.interface import FloatArray
from planner.memory import ObstacleMemory
from planner.rolling_window.cost_to_go import CostToGo
from planner.rolling_window.multi_step_search import Candidate, Width, search_candidates
from planner.rolling_window.window import Window
from tests.examples import examples
from tests.planner.rolling_window.test_rolling_window import seen_at_once
from tests.planner.walls_and_paths import wall

SPACING, KEEP, OUTER = 50.0, 212.0, 220.0
START, GOAL = (0.0, 0.0), (20_000.0, 0.0)
BOUNDS = (-15_000.0, -15_000.0, 35_000.0, 15_000.0)


def window_of(*obstacles: FloatArray) -> Window:
    points = np.concatenate((np.zeros((0, 2)), *obstacles))
    memory = ObstacleMemory(200.0)
    memory.take_in(seen_at_once(points))
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
    found = search_candidates(window, goal, bounds, Width(steps, keep_best, 1200, wide), OUTER, around, to_go)
    tracks = list(islice((track for track in found if track is not None), 12))
    points = shapely.points(window.points_m)
    for track in tracks:
        assert track.nodes[0] == START
        assert track.nodes[-1] == goal
        line = shapely.LineString(track.nodes)
        assert track.cost_m == pytest.approx(line.length, rel=1e-9)
        assert len(track.nodes) <= steps + 2
        assert shapely.distance(line, points).min(initial=math.inf) > KEEP * (1.0 - 1e-6)
        assert shapely.box(*bounds).covers(line)
    if to_go is None:
        assert [track.cost_m for track in tracks] == sorted(track.cost_m for track in tracks)
    return tracks


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
def test_in_a_maze_there_are_tracks_just_where_there_is_a_way(walls: list[bool], led: bool) -> None:
    lines: list[tuple[Point, Point]] = []
    for line in range(CELLS - 1):
        for row in range(CELLS):
            at, low = (line + 0.5) * CELL, (row - 0.5) * CELL
            lines += [((at, low), (at, low + CELL)), ((low, at), (low + CELL, at))]
    window = window_of(*[wall(a, b, SPACING) for (a, b), there in zip(lines, walls, strict=True) if there])
    to_go = None
    if led and len(window.points_m):
        to_go = CostToGo(START, CORNER, WITHIN, window.points_m, window.keep_m, WorkCount())
        for _ in to_go.spread():
            pass
    tracks = tracks_in(window, steps=64, keep_best=48, bounds=WITHIN, goal=CORNER, wide=True, to_go=to_go)
    if connected(window.points_m, 1.1 * KEEP):
        assert tracks
        assert tracks[0].cost_m >= math.dist(START, CORNER) * (1.0 - 1e-9)
    elif not connected(window.points_m, 0.97 * KEEP):
        assert not tracks
