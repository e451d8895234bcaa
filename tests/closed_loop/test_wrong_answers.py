"""Planners that answer wrongly: the flight ends as `planner_failed`, with a sentence and a whole run folder."""

import gc
import math
from collections.abc import Callable
from operator import methodcaller
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

from harness.flight.record import Outcome
from harness.run.scenario_flight import fly_to_folder, make_loop
from harness.run_files.run_folder import load_run
from tests.closed_loop.small import flown_by_point_mass, small_world
from tests.point_mass import PointMass
from wayproof import Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus

Install = Callable[[Callable[[Mission, PlanRequest], Any]], None]
Fails = Callable[[Callable[[Mission, PlanRequest], Any]], str]

WRONG_FROM_S = 2.0


def ahead(request: PlanRequest, *rows: tuple[float, ...], **keys: Any) -> Plan:
    """Straight on for 9 km, or whatever rows say."""
    segments = np.array(rows or [(*request.position_m, *request.direction, 0.0, 9000.0)])
    return Plan(PlanStatus.FOUND, "goes straight on", segments[:, :2], Path(segments), **keys)


@pytest.fixture
def fails(answering: Install, tmp_path: FilePath) -> Fails:
    """Flies with a planner that answers rightly at first, then wrongly; returns the reason with which it failed."""

    def flown(wrongly: Callable[[Mission, PlanRequest], Any], recording: bool = False) -> str:
        def answer(mission: Mission, request: PlanRequest) -> Any:
            if request.time_s >= WRONG_FROM_S:
                return wrongly(mission, request)
            return Plan(PlanStatus.KEPT, "goes on") if request.flown else ahead(request)

        answering(answer)
        fly_to_folder(
            small_world(planner={"kind": "stand_in"}),
            tmp_path / "run",
            recording,
            make=lambda scenario: make_loop(scenario, PointMass),
        )
        run = load_run(tmp_path / "run")
        assert run.manifest["complete"] is True
        assert run.metrics["outcome"] == "planner_failed"
        assert run.metrics["error"].startswith("Traceback")
        assert run.metrics["flight_time_s"] == WRONG_FROM_S
        reason: str = run.metrics["reason"]
        assert "\n" not in reason
        assert len(reason) < 2500
        return reason

    return flown


class Property(Plan):
    """A plan that cannot be read."""

    @property
    def wants_more_time(self) -> bool:
        raise LookupError("not today")

    @wants_more_time.setter
    def wants_more_time(self, value: bool) -> None:
        pass


def no_picture() -> PlanPicture:
    raise OverflowError("too much to see")


def leaves() -> PlanPicture:
    raise SystemExit(0)


def jumps(_: Mission, request: PlanRequest) -> Plan:
    (x, y), (u, v) = request.position_m, request.direction
    return ahead(request, (x, y, u, v, 0.0, 500.0), (x + 800.0 * u, y + 800.0 * v, u, v, 0.0, 500.0))


WRONG: dict[str, tuple[Callable[[Mission, PlanRequest], Any], str]] = {
    "None": (lambda *_: None, "the planner answered with None; an answer must be a Plan"),
    "waypoints": (
        lambda _, r: Plan(PlanStatus.FOUND, "", np.zeros((5, 3)), ahead(r).path),
        "waypoints with shape (5, 3)",
    ),
    "property": (lambda *_: Property(PlanStatus.KEPT, ""), "the planner raised LookupError: not today"),
    "picture": (
        lambda _, r: ahead(r, picture=no_picture),
        "the planner raised OverflowError: too much to see",
    ),
    "picture that exits": (lambda _, r: ahead(r, picture=leaves), "the planner raised SystemExit: 0"),
    "hole": (jumps, "segment 1 begins 300 m from where segment 0 ends"),
    "changes the map": (lambda _, r: setattr(r.seen, "revision", 7), "revision of the map cannot be set"),
    "removes from the map": (lambda _, r: delattr(r.seen, "moving"), "moving of the map cannot be deleted"),
    "updates the map": (lambda _, r: methodcaller("update", None)(r.seen), "AttributeError"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_answer_ends_the_flight_with_a_sentence_and_a_whole_folder(name: str, fails: Fails) -> None:
    wrongly, told = WRONG[name]
    assert told in fails(wrongly)


def test_edges_that_a_planner_is_handed_are_read_only(answering: Install) -> None:
    near = {"circle": {"center_m": [900.0, 900.0], "radius_m": 100.0}}

    def writes(_: Mission, request: PlanRequest) -> Plan:
        edges = request.seen.edges_since(-1)
        assert len(edges)
        edges[0] = 0.0
        return ahead(request)

    answering(writes)
    flight = flown_by_point_mass(small_world(near, planner={"kind": "stand_in"}))
    assert flight.outcome is Outcome.PLANNER_FAILED
    assert "read-only" in flight.reason


def test_a_planner_that_writes_into_its_mission_moves_no_goal(answering: Install) -> None:
    def here(mission: Mission, request: PlanRequest) -> Plan:
        object.__setattr__(mission, "goal_m", request.position_m)
        return ahead(request)

    answering(here)
    flight = flown_by_point_mass(small_world(planner={"kind": "stand_in"}, mission={"time_limit_s": 6.0}))
    assert flight.outcome is Outcome.TIMEOUT


def test_a_planner_gets_its_own_plan_back_and_cannot_change_the_one_that_is_flown(answering: Install) -> None:
    own: list[Plan] = []

    def answer(_: Mission, request: PlanRequest) -> Plan:
        if request.time_s not in (0.0, 3.0):
            assert request.flown is own[-1]
            assert own[-1].path is not None
            own[-1].path.segments.setflags(write=True)
            own[-1].path.segments[:] = math.nan
            return Plan(PlanStatus.KEPT, "goes on")
        own.append(ahead(request))
        return own[-1]

    answering(answer)
    flight = flown_by_point_mass(small_world(planner={"kind": "stand_in"}, mission={"time_limit_s": 6.0}))
    assert (flight.outcome, len(flight.plans), len(own)) == (Outcome.TIMEOUT, 2, 2)
    assert all(np.isfinite(plan.segments).all() for plan in flight.plans)
    assert np.isfinite(flight.track.cross_track_m[1:]).all()


class Endless(ValueError):
    def __str__(self) -> str:
        return "no end " * 5_000_000


def test_an_error_that_says_very_much_is_cut(fails: Fails, tmp_path: FilePath) -> None:
    def raises(*_: object) -> Plan:
        raise Endless

    assert fails(raises).startswith("the planner raised Endless: no end no end")
    assert len(load_run(tmp_path / "run").metrics["error"]) < 50_000


def test_a_planner_prints_to_standard_error_and_garbage_waits_for_its_answer(
    answering: Install, capsys: pytest.CaptureFixture[str]
) -> None:
    def talks(_: Mission, request: PlanRequest) -> Plan:
        print("a planner that talks", gc.isenabled())
        return Plan(PlanStatus.KEPT, "goes on") if request.flown else ahead(request)

    answering(talks)
    flown_by_point_mass(small_world(planner={"kind": "stand_in"}, mission={"time_limit_s": 2.0}))
    out, err = capsys.readouterr()
    assert (out, err.count("a planner that talks False\n"), gc.isenabled()) == ("", 4, True)
