from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.baselines import dubins_tree
from planner.baselines.dubins_tree import ROLLS, DubinsTree, DubinsTreeConfig, dubins, is_free
from planner.geometry.curves import Pose, along
from planner.geometry.terrain import Terrain
from planner.interface import BoolArray, FloatArray, Mission, MovingEdges, Path, Plan, PlanRequest, PlanStatus
from planner.nearest_edge import distance_to_edges

MakePoints = Callable[..., FloatArray]

MISSION = Mission(
    goal_m=(15_000.0, 5000.0),
    goal_radius_m=300.0,
    bounds_m=(0.0, 0.0, 20_000.0, 10_000.0),
    clearance_m=200.0,
    turn_radius_m=150.0,
    speed_mps=25.0,
    roll_in_s=1.0,
    tracking_error_m=3.0,
    sensor_range_m=6000.0,
)
START = (2000.0, 5000.0)

poses = st.builds(
    lambda x, y, course: Pose(x, y, math.cos(course), math.sin(course)),
    st.floats(-6.0, 6.0),
    st.floats(-6.0, 6.0),
    st.floats(0.0, math.tau),
)


class Seen:
    spacing_m = 50.0
    revision = 1
    last_removal_revision = 0
    moving: tuple[MovingEdges, ...] = ()
    last_contradiction_s = -math.inf
    distance_m = distance_to_edges

    def __init__(self, points: FloatArray) -> None:
        self._points = self.fresh = points

    def edges_since(self, revision: int) -> FloatArray:
        return self._points if revision < 1 else self.fresh if revision < self.revision else self._points[:0]

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        return np.zeros(len(points_m), dtype=np.bool_)


@settings(max_examples=75, derandomize=True)
@given(start=poses, end=poses)
def test_a_dubins_curve_joins_its_poses(start: Pose, end: Pose) -> None:
    way = dubins(start, end, 1.0)
    pose = start
    for segment in way:
        np.testing.assert_allclose(segment[:4], pose, atol=1e-6)
        assert abs(segment[4]) in (0.0, 1.0)
        pose = along(segment, segment[5])
    np.testing.assert_allclose(pose, end, atol=1e-5)
    assert len(way) <= 3
    # The same curve flown backwards joins the poses turned round.
    turned = [Pose(p.east_m, p.north_m, -p.tangent_east, -p.tangent_north) for p in (end, start)]
    back = dubins(turned[0], turned[1], 1.0)
    assert sum(s[5] for s in back) == pytest.approx(sum(s[5] for s in way), abs=1e-5)


@pytest.mark.parametrize(
    ("end", "length"),
    [
        (Pose(10.0, 0.0, 1.0, 0.0), 10.0),  # straight on
        (Pose(0.0, 2.0, -1.0, 0.0), math.pi),  # half a turn
        (Pose(5.0, 2.0, -1.0, 0.0), 5.0 + math.pi),  # straight, half a turn; LSL
        (Pose(0.0, 0.0, -1.0, 0.0), 7.0 * math.pi / 3.0),  # back where it was: three arcs, RLR
    ],
)
def test_known_dubins_lengths(end: Pose, length: float) -> None:
    assert sum(s[5] for s in dubins(Pose(0.0, 0.0, 1.0, 0.0), end, 1.0)) == pytest.approx(length, abs=1e-6)


def test_without_ompl_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dubins_tree, "find_spec", lambda name: None)
    with pytest.raises(ValueError, match=r"dubins_tree needs OMPL.*pip install wayproof\[ompl\]"):
        DubinsTreeConfig().resolved(MISSION)


if find_spec("ompl") is not None:

    def first(points: FloatArray, mission: Mission = MISSION) -> Plan:
        planner = DubinsTree(DubinsTreeConfig(), mission)
        return planner.plan(PlanRequest(0.0, START, (1.0, 0.0), Seen(points)))

    def test_a_tree_finds_a_way_round_twice_the_same(ring: MakePoints) -> None:
        points = ring(5000.0, 5200.0, 1200.0, 50.0)
        plan, again = first(points), first(points)
        assert plan.status is PlanStatus.FOUND
        assert plan.path is not None
        assert again.path is not None
        np.testing.assert_array_equal(plan.path.segments, again.path.segments)
        assert plan.path.max_curvature_1pm <= 1.0 / MISSION.turn_radius_m + 1e-9
        assert keeps(plan.path, points) > MISSION.clearance_m
        assert plan.path.length_m < 1.3 * 13_000.0

    @pytest.mark.parametrize("north_m", [4000.0, 4600.0, 5000.0, 5400.0])
    def test_it_keeps_away_from_what_is_known_beyond_the_sensing_range(
        ring: MakePoints, north_m: float
    ) -> None:
        points = np.concatenate((ring(5000.0, 5200.0, 1200.0, 50.0), ring(11_500.0, north_m, 1500.0, 50.0)))
        path = first(points).path
        assert path is not None
        assert keeps(path, points) > MISSION.clearance_m

    def test_the_area_may_be_as_large_as_a_continent(ring: MakePoints) -> None:
        wide = replace(MISSION, bounds_m=(-3e6, -3e6, 3e6, 3e6), clearance_m=20.0)
        plan = first(ring(5000.0, 5200.0, 1200.0, 50.0), wide)
        assert plan.status is PlanStatus.FOUND

    def test_holding_it_searches_anew_when_something_changes_or_it_has_flown_on(ring: MakePoints) -> None:
        planner, around = DubinsTree(DubinsTreeConfig(), MISSION), ring(*START, 1500.0, 50.0)
        seen = Seen(around)
        hold = planner.plan(PlanRequest(0.0, START, (1.0, 0.0), seen))
        assert hold.path is not None

        def asked(arc_length_m: float) -> PlanStatus:
            return planner.plan(PlanRequest(1.0, START, (1.0, 0.0), seen, hold, arc_length_m)).status

        on_m = MISSION.sensor_range_m / ROLLS
        assert [asked(arc_length_m) for arc_length_m in (10.0, on_m - 1.0)] == [PlanStatus.KEPT] * 2
        assert asked(on_m) is PlanStatus.NO_PATH
        assert asked(on_m + 10.0) is PlanStatus.KEPT
        seen.revision, seen.fresh = 2, ring(12_000.0, 5000.0, 500.0, 50.0)
        assert asked(on_m + 20.0) is PlanStatus.NO_PATH
        assert asked(on_m + 30.0) is PlanStatus.KEPT
        seen.revision, seen.last_removal_revision, seen.fresh = 3, 3, around[:0]
        assert asked(on_m + 40.0) is PlanStatus.NO_PATH
        assert asked(on_m + 50.0) is PlanStatus.KEPT

    def test_an_enclosed_start_holds(ring: MakePoints) -> None:
        plan = first(ring(*START, 1500.0, 50.0))
        assert plan.path is None or plan.path.loiter


def keeps(path: Path, points: FloatArray) -> float:
    """Smallest distance between a path and points."""
    places = np.array(
        [along(row, s)[:2] for row in path.segments.tolist() for s in np.arange(0.0, row[5], 20.0)]
    )
    return float(np.hypot(*(places[:, None] - points).transpose(2, 0, 1)).min())


def test_what_lies_outside_the_area_is_not_free() -> None:
    """Curves between two places inside may leave it."""
    free = Terrain(np.zeros((0, 2)), np.zeros(0), MISSION.bounds_m)
    xmin, ymin, xmax, ymax = MISSION.bounds_m
    assert is_free(free, xmin, ymin)
    assert is_free(free, xmax, ymax)
    for x, y in (
        (xmin - 1.0, 5000.0),
        (xmax + 500.0, 5000.0),
        (9000.0, ymin - 500.0),
        (9000.0, ymax + 500.0),
    ):
        assert not is_free(free, x, y)


def test_what_is_too_near_is_not_free(ring: MakePoints) -> None:
    points = ring(5000.0, 5000.0, 1000.0, 50.0)
    free = Terrain(points, np.full(len(points), 220.0), MISSION.bounds_m)
    for x, y in np.random.default_rng(1).uniform(3500.0, 6500.0, (300, 2)).tolist():
        assert is_free(free, x, y) == (np.hypot(*(points - (x, y)).T).min() >= 220.0)
