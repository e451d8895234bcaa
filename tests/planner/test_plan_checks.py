"""What is asked of a planner's answer before anything is flown by it."""

import math
import os
import tracemalloc
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from planner import plan_checks
from planner.contract import MISSION
from planner.interface import Mission, Path, Plan, PlanPicture, PlanStatus
from planner.plan_checks import WrongAnswerError, checked_plan

RADIUS_M = 200.0
EAST = (0.0, 0.0, 1.0, 0.0, 0.0, 1000.0)
LEFT = (1000.0, 0.0, 1.0, 0.0, 1.0 / RADIUS_M, RADIUS_M * math.pi / 2)
NORTH = (1000.0 + RADIUS_M, RADIUS_M, 0.0, 1.0, 0.0, 500.0)
TURN = (1000.0 + RADIUS_M, RADIUS_M + 500.0, 0.0, 1.0, -1.0 / RADIUS_M, RADIUS_M * math.tau)
WHOLE = (EAST, LEFT, NORTH, TURN)


def found(rows: Any, *, loiter: bool = False, **keys: Any) -> Plan:
    array = np.array(rows, dtype=np.float64)
    return Plan(PlanStatus.FOUND, "a way", array[:, :2], Path(array, loiter), **keys)


def said_of(answer: object, position_m: tuple[float, float] = (0.0, 0.0)) -> str:
    with pytest.raises(WrongAnswerError) as refusal:
        checked_plan(answer, position_m, MISSION)
    told = str(refusal.value)
    assert "\n" not in told
    assert len(told) < 400
    return told


def spoilt(plan: Plan, **keys: Any) -> Plan:
    """A plan with attributes that its constructor would have refused or made right."""
    for name, value in keys.items():
        object.__setattr__(plan, name, value)
    return plan


def test_a_path_of_lines_arcs_and_a_loiter_is_taken_and_copied() -> None:
    given = found(WHOLE, loiter=True)
    plan = checked_plan(given, (0.0, 0.0), MISSION)
    assert given.path is not None
    assert plan.path is not None
    assert (plan.status, plan.reason, plan.path.loiter) == (PlanStatus.FOUND, "a way", True)
    np.testing.assert_array_equal(plan.path.segments, WHOLE)
    np.testing.assert_array_equal(plan.waypoints_m, given.waypoints_m)
    assert not np.shares_memory(plan.path.segments, given.path.segments)
    assert not np.shares_memory(plan.waypoints_m, given.waypoints_m)
    assert not plan.path.segments.flags.writeable


@pytest.mark.parametrize("status", [each for each in PlanStatus if each is not PlanStatus.FOUND])
def test_an_answer_without_a_new_path_is_handed_on_as_it_is(status: PlanStatus) -> None:
    answer = Plan(status, "why")
    assert checked_plan(answer, (0.0, 0.0), MISSION) is answer


@pytest.mark.parametrize("points", [[(0, 0, 300), (1000, 0, 300)], [0, 0, 1000, 0], [], [(1, 2)], [(1, 2), (1, 2)]])
def test_points_with_altitudes_flat_lists_and_single_points_are_no_path(points: Any) -> None:
    with pytest.raises(ValueError, match=r"must be \(n, 2\)|at least two points, each different"):
        Path.through(points)


def test_a_kink_in_direction_is_allowed() -> None:
    corner = (EAST, (1000.0, 0.0, 0.0, 1.0, 0.0, 500.0), (1000.0, 500.0, 0.0, -1.0, 0.0, 500.0))
    assert checked_plan(found(corner), (0.0, 0.0), MISSION).path is not None


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (None, "answered with None; an answer must be a Plan"),
        ({"status": "found"}, "answered with an object of type dict; an answer must be a Plan"),
        (SimpleNamespace(status=PlanStatus.KEPT, reason=""), "an object of type SimpleNamespace"),
        (Plan, "an object of type type"),
        (spoilt(found([EAST]), status="found"), "an object of type str as its status; it must be a PlanStatus"),
        (spoilt(found([EAST]), status=None), "has None as its status"),
        (spoilt(found([EAST]), reason=3), "an object of type int as its reason; it must be a str"),
        (spoilt(Plan(PlanStatus.KEPT, ""), reason=b"x"), "an object of type bytes as its reason"),
        (spoilt(found([EAST]), wants_more_time="yes"), "wants_more_time; it must be True or False"),
        (spoilt(found([EAST]), path=None), "a path that cannot be flown: it is none"),
        (spoilt(found([EAST]), path=[EAST]), "it is an object of type list; it must be a Path"),
        (spoilt(found([EAST]), waypoints_m=np.zeros((4, 3))), "waypoints with shape (4, 3); they must be an array of"),
        (spoilt(found([EAST]), waypoints_m=np.zeros(4)), "waypoints with shape (4,)"),
        (spoilt(found([EAST]), waypoints_m=[(0, 0)]), "waypoints with an object of type list"),
        (spoilt(found([EAST]), waypoints_m=np.array([(0, 0), (1, math.nan)])), "a waypoint 1 at (1, nan) m"),
        (spoilt(found([EAST]), waypoints_m=np.array([(1e300, 0)])), "a waypoint 0 at (1e+300, 0) m"),
        (Plan(PlanStatus.FOUND, "", path=Path(np.zeros((0, 6)))), "must have shape (n, 6), n > 0; got (0, 6)"),
        (spoilt(found([EAST]), path=Path(np.array([(0.0, 0.0, 0.9, 0.0, 0.0, 5.0)]))),
            "segment 0 begins with a tangent of length 0.9; it must be a unit vector"),
        (found([EAST], picture=lambda: None), "picture of its plan is None; it must be a PlanPicture"),
    ],
)  # fmt: skip
def test_what_is_no_plan_is_refused(answer: object, told: str) -> None:
    assert told in said_of(answer)


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ([EAST, (1300.0, 0.0, 1.0, 0.0, 0.0, 9.0)], "segment 1 begins 300 m from where segment 0 ends"),
        ([EAST, LEFT, (*EAST[:2], *NORTH[2:])], "segment 2 begins 1216.55 m from where segment 1 ends"),
        ([EAST, LEFT, NORTH, (1200.0, 3700.0, 0, 1, 0, 9)], "segment 3 begins 3000 m from where segment 2 ends"),
        ([(3000.0, 0.0, 1.0, 0.0, 0.0, 10.0)], "segment 0 begins 3000 m from the aircraft; it must begin at most 37 m"),
        ([EAST, (1000.0, 0.0, 1.0, 0.0, math.nan, 9.0)], "segment 1 is not finite: 1000, 0, 1, 0, nan, 9"),
        ([(0.0, 0.0, 1.0, 0.0, math.inf, 9.0)], "segment 0 is not finite"),
        ([EAST, (1000.0, 0.0, 1.0, 0.0, 0.0, 0.0)], "segment 1 is 0 m long; it must be longer than 0 m"),
        ([EAST, (1000.0, 0.0, 1.0, 0.0, 0.0, -5.0)], "segment 1 is -5 m long"),
        ([(0.0, 0.0, 1.0, 0.0, 1e3, 1e6)], "it turns by 1e+09 rad up to the end of segment 0"),
        ([(0.0, 0.0, 1.0, 0.0, 1e308, 500.0)], "it turns by inf rad up to the end of segment 0"),
        ([EAST, (1000.0, 0.0, 1.0, 0.0, 0.0, 1e300)], "it is 1e+300 m long up to the end of segment 1"),
        ([(0.0, 0.0, 1.0, 0.0, 0.0, 1e308)] * 2, "it is 1e+308 m long up to the end of segment 0"),
    ],
)  # fmt: skip
def test_a_path_that_cannot_be_flown_is_refused_with_segment_and_figure(rows: Any, told: str) -> None:
    assert told in said_of(found(rows))


@pytest.mark.parametrize(
    ("turn", "told"),
    [
        ((*TURN[:5], 0.5 * TURN[5]), "turns by 180 deg and ends 400 m from where it begins; it must be a full circle"),
        ((*TURN[:5], 2.0 * TURN[5]), "turns by 720 deg"),
        ((*TURN[:4], 0.0, 0.05), "turns by 0 deg"),
    ],
)  # fmt: skip
def test_a_loiter_that_does_not_close_is_refused(turn: tuple[float, ...], told: str) -> None:
    said = said_of(found((EAST, LEFT, NORTH, turn), loiter=True))
    assert "segment 3, its loiter, " in said
    assert told in said


@pytest.mark.parametrize("error", [-1.0, 1.0])
def test_a_joint_may_be_off_by_the_stated_tolerance(error: float) -> None:
    joined, torn = (found([EAST, (1000.0, error * off_m, 1.0, 0.0, 0.0, 9.0)]) for off_m in (0.099, 0.101))
    assert checked_plan(joined, (0.0, 0.0), MISSION).path is not None
    assert "segment 1 begins 0.101 m from where segment 0 ends; they must meet within 0.1 m" in said_of(torn)


@pytest.mark.parametrize("latency_s", [0.0, 3.0])
def test_a_path_may_begin_as_far_off_as_the_aircraft_flies_meanwhile(latency_s: float) -> None:
    mission = Mission(**{**vars(MISSION), "compute_latency_s": latency_s})
    most = plan_checks.start_tolerance_m(mission)
    assert most == pytest.approx(MISSION.off_path_m + 25.0 * (latency_s + plan_checks.START_S))
    assert checked_plan(found([EAST]), (-0.999 * most, 0.0), mission).path is not None
    with pytest.raises(WrongAnswerError, match="from the aircraft"):
        checked_plan(found([EAST]), (-1.001 * most, 0.0), mission)


def test_what_is_too_large_is_refused_without_being_worked_through() -> None:
    """A million segments, a reason of 50 MB: the figure alone is looked at."""
    many = found([EAST])
    rows = np.zeros((1_000_000, 6))
    rows[:, 2] = rows[:, 5] = 1.0
    rows[:, 0] = np.arange(1_000_000)
    spoilt(many, path=Path(rows))
    waypoints = spoilt(found([EAST]), waypoints_m=np.zeros((1_000_000, 2)))
    talks = Plan(PlanStatus.NO_PATH, "x" * 50_000_000)
    coils = found([(0.0, 0.0, 1.0, 0.0, 1e3, 1e6)])
    tracemalloc.start()
    try:
        said = [said_of(each) for each in (many, waypoints, talks, coils)]
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()
    assert "it has 1,000,000 segments; it must have at most 100,000" in said[0]
    assert "gave 1,000,000 waypoints; a plan must have at most 100,000" in said[1]
    assert "a reason of 50,000,000 characters; it must have at most 2,000" in said[2]


def test_a_long_path_within_the_bounds_is_taken() -> None:
    rows = np.zeros((plan_checks.MOST_SEGMENTS, 6))
    rows[:, 0], rows[:, 2], rows[:, 5] = np.arange(plan_checks.MOST_SEGMENTS), 1.0, 1.0
    plan = checked_plan(found(rows), (0.0, 0.0), MISSION)
    assert plan.path is not None
    assert len(plan.path.segments) == plan_checks.MOST_SEGMENTS
    assert checked_plan(Plan(PlanStatus.KEPT, "x" * plan_checks.MOST_REASON_LETTERS), (0.0, 0.0), MISSION)


class Talkative(str):
    def __len__(self) -> int:
        return 0


class Own(Plan):
    """A plan with something more."""


def test_a_class_of_the_planners_own_is_read_once_and_left_behind() -> None:
    own = Own(PlanStatus.FOUND, Talkative("a way"), np.zeros((1, 2)), Path(np.array([EAST])))
    plan = checked_plan(own, (0.0, 0.0), MISSION)
    assert type(plan) is Plan
    assert type(plan.reason) is str
    assert type(checked_plan(Own(PlanStatus.KEPT, "goes on"), (0.0, 0.0), MISSION)) is Plan
    assert "has a reason of 5,000 characters" in said_of(Own(PlanStatus.KEPT, Talkative("x" * 5000)))


@pytest.mark.parametrize("status", [PlanStatus.FOUND, PlanStatus.NO_PATH])
def test_a_reason_can_be_written(status: PlanStatus) -> None:
    """A file name that is not UTF-8, as Python gives it, has letters that UTF-8 has no bytes for."""
    plan = Plan(status, os.fsdecode(b"no way: caf\xe9.csv"), np.zeros((1, 2)), Path(np.array([EAST])))
    assert checked_plan(plan, (0.0, 0.0), MISSION).reason == "no way: caf?.csv"


def picture(**keys: Any) -> PlanPicture:
    return PlanPicture(**{"guide_m": np.zeros((2, 2)), "window_m": 100.0, "sectors": np.zeros((1, 4)), **keys})


def test_a_picture_is_made_once_when_the_plan_is_taken() -> None:
    made = []

    def make() -> PlanPicture:
        made.append(1)
        return picture()

    plan = checked_plan(found([EAST], picture=make), (0.0, 0.0), MISSION)
    assert made == [1]
    assert plan.picture is not None
    assert plan.picture() is plan.picture()
    assert made == [1]


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"guide_m": np.zeros((3, 2))}, "a guide vector of 2 points"),
        ({"sectors": np.zeros((3, 2))}, r"sectors of a picture has the shape \(3, 2\); .* of shape \(n, 4\)"),
        ({"candidates": (np.zeros((3, 2)), np.zeros(3))},
            r"candidates\[1\] of a picture has the shape \(3,\)"),
        ({"met_m": np.full((1, 2), math.nan)}, "met_m of a picture .* must be finite"),
        ({"window_m": math.inf}, "a finite window"),
    ],
)  # fmt: skip
def test_a_picture_that_cannot_be_drawn_is_refused(keys: Any, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        checked_plan(found([EAST], picture=lambda: picture(**keys)), (0.0, 0.0), MISSION)


def test_what_the_making_of_a_picture_raises_is_raised() -> None:
    def breaks() -> PlanPicture:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        checked_plan(found([EAST], picture=breaks), (0.0, 0.0), MISSION)


def test_the_segments_of_a_path_are_those_that_were_checked() -> None:
    """A path whose attribute is another each time that it is read."""

    class Changing(Path):
        reads = 0

        def __getattribute__(self, name: str) -> Any:
            if name == "segments":
                type(self).reads += 1
                if type(self).reads > 1:
                    return np.full((1, 6), math.nan)
            return super().__getattribute__(name)

    changing = Changing(np.array([EAST]))
    Changing.reads = 0
    plan = checked_plan(spoilt(found([EAST]), path=changing), (0.0, 0.0), MISSION)
    assert plan.path is not None
    np.testing.assert_array_equal(plan.path.segments, [EAST])
