"""What the shield does with one answer of a planner."""

import math
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from planner import contract
from planner.contract import GivenMap
from planner.geometry.curves import Limits, Pose, along, sample
from planner.interface import MapView, NoWayToBegin, Path, Plan, PlanRequest, PlanStatus, Refused
from planner.plan_checks import WrongAnswerError, checked_plan
from planner.shield import shield as shield_module
from planner.shield.shield import Shield
from planner.shield.tracking import can_be_flown

MISSION = replace(
    contract.MISSION,
    goal_m=(3000.0, 0.0),
    clearance_m=40.0,
    turn_radius_m=100.0,
    tracking_error_m=1.0,
    bounds_m=(-500.0, -1000.0, 4000.0, 400.0),
)
FREE = GivenMap(np.zeros((0, 2)))
OUT_AND_BACK = ((0.0, 0.0), (600.0, 0.0), (600.0, 900.0), (1400.0, 900.0), (1400.0, -500.0))
"""North out of the area, and back in."""


class Once:
    """A planner with one path; remembers what it is told."""

    def __init__(self, *points_m: tuple[float, float]) -> None:
        self.points_m = points_m
        self.told: list[PlanRequest] = []

    def plan(self, request: PlanRequest) -> Plan:
        self.told.append(request)
        return Plan(PlanStatus.FOUND, "once", np.array(self.points_m), Path.through(self.points_m))


def asked(seen: MapView = FREE) -> PlanRequest:
    return PlanRequest(0.0, (0.0, 0.0), (1.0, 0.0), seen)


def begun(inner: Once, seen: MapView = FREE) -> tuple[Shield, PlanRequest, Plan, Path]:
    """A shield, its first request, what it answers and the path of that."""
    shield = Shield(inner, MISSION)
    flown = shield.plan(asked(seen))
    assert flown.path is not None
    return shield, asked(seen), flown, flown.path


def test_a_way_that_leaves_the_area_is_flown_only_as_far_as_a_turn_inside(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    *_, path = begun(Once(*OUT_AND_BACK))
    assert path.loiter
    assert sample(path, 5.0)[:, 1].max() <= 400.0
    monkeypatch.setattr(shield_module, "first_exit_m", lambda *_: math.inf)  # the turn alone does not tell
    *_, path = begun(Once(*OUT_AND_BACK))
    assert sample(path, 5.0)[:, 1].max() > 800.0


def test_a_refused_planner_is_told_where_and_why() -> None:
    wall = np.array([(100.0, y) for y in np.arange(-300.0, 301.0, 20.0)])
    inner = Once((0.0, 0.0), (3000.0, 0.0))
    shield = Shield(inner, MISSION)
    request = PlanRequest(0.0, (0.0, 0.0), (0.0, 1.0), GivenMap(wall))
    shield.plan(request)
    assert inner.told[0].refused is None
    shield.plan(request._replace(time_s=0.5))
    refused = inner.told[1].refused
    assert refused is not None
    assert "too near to something" in refused.reason
    assert math.hypot(*refused.place_m) < 300.0
    assert shield._log.refused_plans == 2


@pytest.mark.parametrize(
    ("status", "reason", "told"),
    [
        (PlanStatus.NO_PATH, "lost", "lost"),
        (PlanStatus.NO_PATH, "", "no reason given"),
        (PlanStatus.UNREACHABLE, "no", "no; that proves nothing, since the planner was refused a path"),
        (PlanStatus.KEPT, "goes on", "no turn off the path that gets on has been seen to be free"),
    ],
)
def test_the_reason_told_in_the_turn_is_that_of_now(status: PlanStatus, reason: str, told: str) -> None:
    """A refusal is told while the planner holds on to the path refused, not once it says something else."""
    inner = Once((0.0, 0.0), (3000.0, 0.0))
    shield = Shield(inner, MISSION)
    request = PlanRequest(0.0, (0.0, 0.0), (1.0, 0.0), GivenMap(np.zeros((0, 2))))
    path = (flown := shield.plan(request)).path
    assert path is not None
    east, north, ux, uy = path.segments[-1, :4].tolist()
    request = request._replace(position_m=(east, north), direction=(ux, uy), flown=flown, arc_length_m=path.length_m)
    shield.plan(request._replace(time_s=60.0))
    shield._refused = Refused((900.0, 0.0), "no turn off the path that gets on has been seen to be free")
    inner.plan = lambda _: Plan(status, reason)  # type: ignore[method-assign,assignment]
    answer = shield.plan(request._replace(time_s=70.0))
    assert answer.reason.removeprefix("stuck in the turn since 60 s: ") == told
    assert shield._log.report.time_on_backup_s == 10.0


MUTE = [  # errors that raise when they are told
    type("Mute", (kind,), {"__str__": lambda _: 1 / 0})() for kind in (OSError, NoWayToBegin, WrongAnswerError)
]


@pytest.mark.parametrize("error", [*MUTE, NoWayToBegin("x" * 9000)])
def test_whatever_a_planner_raises_the_certified_plan_goes_on(error: Exception) -> None:
    inner = Once((0.0, 0.0), (3000.0, 0.0))
    shield, request, flown, path = begun(inner)
    inner.plan = Mock(side_effect=error)  # type: ignore[method-assign]
    east, north, ux, uy = path.segments[-1, :4].tolist()
    request = request._replace(time_s=60.0, position_m=(east, north), direction=(ux, uy), flown=flown)
    told = shield.plan(request._replace(arc_length_m=path.length_m - 100.0))
    assert told.status is PlanStatus.NO_PATH
    assert checked_plan(told, (east, north), MISSION) is told


@pytest.mark.parametrize(
    ("radius_m", "chord_m", "flown"),
    [(40.0, 1.0, False), (98.0, 1.0, False), (101.0, 1.0, True), (101.0, 3.0, True), (300.0, 20.0, False)],
)
def test_a_circle_of_chords_is_flown_if_it_is_no_tighter_than_the_turn(
    radius_m: float, chord_m: float, flown: bool
) -> None:
    """The turn radius is 100 m; at chords of 20 m a joint turns by 3.8 degrees: that is a corner on any circle."""
    angle = 2.0 * math.asin(0.5 * chord_m / radius_m) * np.arange(int(math.tau * radius_m / chord_m))
    for side in (1.0, -1.0):
        path = Path.through(radius_m * np.column_stack((np.sin(angle), side * (1.0 - np.cos(angle)))))
        start = Pose(0.0, 0.0, *path.segments[0, 2:4].tolist())
        assert can_be_flown(path, start, 0.0, Limits(100.0, 15.0)) is flown
    slides = Path(np.array([(0.1 * i, 0.09 * i, 1.0, 0.0, 0.0, 0.1) for i in range(100)]))
    assert not can_be_flown(slides, Pose(0.0, 0.0, 1.0, 0.0), 0.0, Limits(100.0, 15.0))


@pytest.mark.parametrize(("before", "straight_m", "flown"), [(1, 15, True), (0, 14, False), (-1, 20, False)])
def test_from_turn_to_turn_a_path_has_the_room_to_roll(before: float, straight_m: float, flown: bool) -> None:
    """Turn radius 100 m, 15 m flown while rolling: to the left, straight, to the right, after a turn of `before`."""
    start, limits = Pose(0.0, 0.0, 1.0, 0.0), Limits(100.0, 15.0)
    rows = [(*start, 0.01, 50.0)]
    for curvature, length_m in ((0.0, straight_m), (-0.01, 50.0)):
        rows.append((*along(rows[-1], rows[-1][5]), curvature, length_m))
    assert can_be_flown(Path(np.array(rows)), start, 0.01 * before, limits) is flown


@pytest.mark.parametrize(("straight_m", "refused"), [(0.0, 0), (300.0, 1)])
def test_a_planner_that_asks_to_circle_where_the_shield_does_so_is_not_refused(straight_m: float, refused: int) -> None:
    """One that wants to circle somewhere else is: a wall stands in the way there."""
    wall = np.array([(x, y) for x in (3200.0, 3300.0) for y in np.arange(-700.0, 701.0, 20.0)])
    inner = Once((0.0, 0.0), (3100.0, 0.0))
    shield, request, flown, path = begun(inner, GivenMap(wall))
    assert path.loiter
    entry_m = path.length_m - math.tau * 100.0
    east, north, ux, uy = (float(each) for each in path.segments[-1, :4])
    other_way = -float(np.sign(path.segments[-1, 4])) / 100.0
    x, y = east + straight_m * ux, north + straight_m * uy
    ahead = [(east, north, ux, uy, 0.0, straight_m)] if straight_m else []
    circle = np.array([*ahead, (x, y, ux, uy, other_way, math.tau * 100.0)])
    wish = Plan(PlanStatus.FOUND, "holding", np.array([(east, north), (x, y)]), Path(circle, loiter=True))
    inner.plan = lambda _: wish  # type: ignore[method-assign,assignment]
    request = request._replace(time_s=60.0, position_m=(east, north), direction=(ux, uy), flown=flown)
    told = shield.plan(request._replace(arc_length_m=entry_m + 1.0))
    assert told.status is PlanStatus.NO_PATH
    assert shield._log.refused_plans == refused
    assert ("holding" in told.reason) is (refused == 0)


def test_a_planner_is_told_where_the_certified_plan_leads() -> None:
    inner = Once((0.0, 0.0), (3000.0, 0.0))
    shield, request, flown, path = begun(inner)
    shield.plan(request._replace(time_s=4.0, position_m=(100.0, 0.0), flown=flown, arc_length_m=100.0))
    before, after = (each.committed for each in inner.told)
    assert before is None
    assert after is not None
    assert after.loiter
    np.testing.assert_allclose(after.segments[0, :4], (100.0, 0.0, 1.0, 0.0), atol=1e-6)
    np.testing.assert_allclose(after.segments[-1], path.segments[-1])
    assert after.length_m == pytest.approx(path.length_m - 100.0)
