"""The paper's planner as it is asked: what bounds a plan, when the window rolls, what it says where it is caught."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.contract import MISSION, GivenMap, circle_outline
from planner.geometry.curves import pose_at, sample
from planner.interface import Mission, Path, Plan, PlanRequest, PlanStatus
from planner.paper.config import ImprovedBugConfig
from planner.paper.rolling import ImprovedBug

HERE = (9000.0, 7000.0)
EAST: Mission = replace(MISSION, goal_m=(19_000.0, 7000.0))
OBSTACLES = np.concatenate([circle_outline(x, 7000.0, 300.0) for x in (11_500.0, 14_000.0)])


def planner(**keys: float) -> ImprovedBug:
    return ImprovedBug(ImprovedBugConfig(**keys), EAST)  # type: ignore[arg-type]


def ask(arc_length_m: float = 0.0, position: tuple[float, float] = HERE, **fields: object) -> PlanRequest:
    seen = fields.pop("seen", GivenMap(OBSTACLES))
    return PlanRequest(0.0, position, (1.0, 0.0), seen, arc_length_m=arc_length_m, **fields)  # type: ignore[arg-type]


@pytest.mark.parametrize("r1", [2000.0, 3000.0, 6000.0])
def test_no_track_point_lies_beyond_the_planning_window(r1: float) -> None:
    plan = planner(planning_window_m=r1).plan(ask())
    assert plan.path is not None
    furthest = np.hypot(*(sample(plan.path, 10.0) - HERE).T).max()
    assert np.hypot(*(plan.waypoints_m - HERE).T).max() <= r1
    assert 0.8 * r1 < furthest <= r1, "it leads to the rim, and no further"


def test_obstacles_beyond_the_planning_window_do_not_matter() -> None:
    small = planner(planning_window_m=1900.0)
    plan, open_plan = small.plan(ask()), small.plan(ask(seen=GivenMap(OBSTACLES[:0])))
    assert plan.path is not None
    assert open_plan.path is not None
    assert plan.path.segments.tobytes() == open_plan.path.segments.tobytes()


def test_the_window_rolls_after_a_step_or_when_the_plan_is_cut() -> None:
    paper = planner(step_m=500.0)
    plan = paper.plan(ask())
    assert plan.path is not None
    for at, status in ((499.0, PlanStatus.KEPT), (501.0, PlanStatus.FOUND)):
        assert paper.plan(ask(at, pose_at(plan.path, at)[:2], flown=plan)).status is status
    wall = np.array([[10_500.0, y] for y in range(6600, 7400, 50)], dtype=float)
    seen = GivenMap(np.concatenate((OBSTACLES, wall)))
    seen.revision = 2
    cut = ask(100.0, pose_at(plan.path, 100.0)[:2], flown=plan, seen=seen)
    assert paper.plan(cut).status is PlanStatus.FOUND


def test_a_new_plan_goes_on_from_the_one_in_effect_without_a_kink() -> None:
    paper = planner()
    plan = paper.plan(ask())
    assert plan.path is not None
    again = paper.plan(ask(800.0, pose_at(plan.path, 800.0)[:2], flown=plan))
    assert again.path is not None
    np.testing.assert_allclose(again.path.segments[0, :4], pose_at(plan.path, 800.0), atol=1e-9)
    joints = np.array([pose_at(again.path, s) for s in np.cumsum(again.path.segments[:-1, 5])])
    np.testing.assert_allclose(joints, again.path.segments[1:, :4], atol=1e-6)


@pytest.mark.parametrize(
    ("half_m", "end_m", "status"),
    [
        # Round its end: 3,125 + 7,343 m, 1,268 m more; S_0 is 750 m.
        (2000.0, 15_000.0, PlanStatus.NO_BETTER),
        (1000.0, 15_000.0, PlanStatus.FOUND),  # 2,515 + 7,105 m, 420 m more
        (2000.0, 10_500.0, PlanStatus.FOUND),  # the last step of the plan in effect
    ],
)
def test_a_plan_is_flown_on_where_what_is_found_is_longer_by_more_than_a_step(
    half_m: float, end_m: float, status: PlanStatus
) -> None:
    """The plan in effect leads through a gap in a wall with 210 m on each side; candidates keep 220 m."""
    above = np.arange(210.0, half_m, 50.0)
    wall = np.array([(12_000.0, 7000.0 + y) for y in (*above, *-above)])
    flown = Plan(PlanStatus.FOUND, "", path=Path.through(np.array([HERE, (end_m, 7000.0)])))
    assert planner().plan(ask(800.0, (9800.0, 7000.0), flown=flown, seen=GivenMap(wall))).status is status


def test_where_it_is_caught_it_holds_and_says_so() -> None:
    angle = np.arange(0.0, math.tau, 0.01)
    ring = np.column_stack((HERE[0] + 800.0 * np.cos(angle), HERE[1] + 800.0 * np.sin(angle)))
    plan = planner().plan(ask(seen=GivenMap(ring)))
    assert plan.status is PlanStatus.FOUND
    assert plan.path is not None
    assert plan.path.loiter
    assert plan.reason == "no candidate in the window; holding"


def test_the_picture_has_what_was_searched() -> None:
    plan = planner(planning_window_m=5000.0).plan(ask())
    assert plan.picture is not None
    picture = plan.picture()
    assert picture.window_m == 5000.0
    assert 1 <= len(picture.candidates) <= 8
    np.testing.assert_array_equal(picture.candidates[0], plan.waypoints_m)
    # Both obstacles lie ahead, the further one in the shade: one free sector, from the left of them round to the right.
    assert len(picture.sectors) == 1
    assert picture.sectors[0, 1] > 0.0 > picture.sectors[0, 3]
    open_plan = planner().plan(ask(seen=GivenMap(OBSTACLES[:0])))
    assert open_plan.picture is not None
    assert open_plan.picture().sectors.shape == (0, 4)
