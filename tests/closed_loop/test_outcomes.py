"""Every way in which a flight can end: its outcome, its reason and what the command makes of it."""

import json
import math
import signal
from collections.abc import Callable
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

from aircraft.guidance.interface import UPDATE_RATE_HZ
from aircraft.start import Atmosphere, StartConditions
from harness.cli.app import main
from harness.run import scenario_flight as run
from tests.closed_loop.small import flown_by_point_mass, small_world
from tests.point_mass import PointMass
from wayproof import AircraftState, Mission, Path, Plan, PlanRequest, PlanStatus, Scenario, dump_scenario

Answer = Callable[[Mission, PlanRequest], Plan]
Install = Callable[[Answer], None]
Fly = Callable[[Scenario], tuple[int, dict[str, Any]]]

IN_THE_WAY = {"circle": {"center_m": [3000.0, 3000.0], "radius_m": 300.0}}


def straight_on(mission: Mission, request: PlanRequest) -> Plan:
    if request.flown is not None:
        return Plan(PlanStatus.KEPT, "goes straight on")
    row = (*request.position_m, *request.direction, 0.0, 20_000.0)
    return Plan(PlanStatus.FOUND, "goes straight on", np.array([row[:2]]), Path(np.array([row])))


def breaks(mission: Mission, request: PlanRequest) -> Plan:
    if request.time_s < 5.0:
        return straight_on(mission, request)
    raise ZeroDivisionError("no room between\ntwo walls")


class Failing(PointMass):
    """Loses control after three seconds."""

    def fault(self) -> str | None:
        return "stalled, angle of attack 31 deg" if self.state().time_s >= 3.0 else super().fault()


class Diverging(Failing):
    """Loses control after three seconds, with a state that is not finite."""

    def state(self) -> AircraftState:
        state = super().state()
        return state if state.time_s < 3.0 else AircraftState(state.time_s, *[math.nan] * (len(state) - 1))


@pytest.fixture
def fly(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> Fly:
    """Flies a scenario through the command, on the point mass; returns exit status and metrics."""

    def point_mass(_: Scenario, start: StartConditions, air: Atmosphere) -> PointMass:
        return PointMass(start, air)

    monkeypatch.setattr(run, "jsbsim_aircraft", point_mass)

    def command(scenario: Scenario) -> tuple[int, dict[str, Any]]:
        (tmp_path / "small.yaml").write_text(dump_scenario(scenario))
        out = tmp_path / "run"
        status = main(["fly", str(tmp_path / "small.yaml"), "--out", str(out), "--no-recording", "--quiet"])
        return status, json.loads((out / "metrics.json").read_text())

    return command


def test_reached(fly: Fly) -> None:
    status, metrics = fly(small_world(IN_THE_WAY))
    assert (status, metrics["outcome"]) == (0, "reached")
    assert metrics["reason"].startswith("inside the goal circle after ")


def test_collision_ends_the_flight_at_the_edge(fly: Fly, answering: Install) -> None:
    answering(straight_on)
    scenario = small_world(IN_THE_WAY, planner={"kind": "stand_in"})
    status, metrics = fly(scenario)
    assert (status, metrics["outcome"]) == (1, "collision")
    assert metrics["reason"].startswith("inside an obstacle by ")
    track = flown_by_point_mass(scenario).track
    assert (track.clearance_m[:-1] >= 0.0).all()
    assert -25.0 / UPDATE_RATE_HZ - 0.1 <= track.clearance_m[-1] < 0.0


@pytest.mark.parametrize("east_m", [3000.0, 3000.4, 3000.8, 3001.2, 3001.6])
@pytest.mark.parametrize("velocity_mps", [None, [-20.0, 0.0]])
def test_a_wall_thinner_than_a_step_is_not_flown_through_unnoticed(
    fly: Fly, answering: Install, east_m: float, velocity_mps: list[float] | None
) -> None:
    answering(straight_on)
    corners = [[east_m, 900.0], [east_m + 0.3, 900.0], [east_m + 0.3, 5900.0], [east_m, 5900.0]]
    wall = {"polygon": {"vertices_m": corners}} | ({"velocity_mps": velocity_mps} if velocity_mps else {})
    status, metrics = fly(small_world(wall, planner={"kind": "stand_in"}))
    assert (status, metrics["outcome"]) == (1, "collision")
    assert -0.15 <= metrics["min_clearance_m"] < 0.0


def test_an_obstacle_that_pops_up_around_the_aircraft_is_hit_at_once(answering: Install) -> None:
    answering(straight_on)
    pops_up = {"circle": {"center_m": [1800.0, 1800.0], "radius_m": 200.0}, "active_s": [84.0, 90.0]}
    flight = flown_by_point_mass(small_world(pops_up, planner={"kind": "stand_in"}))
    assert flight.outcome.value == "collision"
    assert 84.0 <= flight.sim_s <= 84.05


def test_a_flight_without_any_plan_says_so(fly: Fly, answering: Install) -> None:
    answering(lambda *_: Plan(PlanStatus.NO_PATH, "there is no room\nfor a turn"))
    status, metrics = fly(small_world(IN_THE_WAY, planner={"kind": "stand_in"}))
    assert (status, metrics["outcome"]) == (1, "collision")
    assert metrics["reason"].endswith("; no plan was ever found: there is no room for a turn")


@pytest.mark.parametrize(
    ("course_deg", "left_at"),
    [(270.0, "(2998, 0)"), (90.0, "(4002, 0)"), (180.0, "(3600, -400)"), (0.0, "(3600, 602)")],
)
def test_leaving_the_area(course_deg: float, left_at: str, fly: Fly, answering: Install) -> None:
    answering(straight_on)
    status, metrics = fly(
        small_world(
            planner={"kind": "stand_in"},
            area={"bounds_m": [3000.0, -400.0, 4000.0, 600.0]},
            mission={"start_m": [3600.0, -0.2], "goal_m": [3100.0, 500.0], "course_deg": course_deg},
        )
    )
    assert (status, metrics["outcome"]) == (1, "out_of_bounds")
    assert metrics["reason"] == f"left the area at {left_at} m"


def test_timeout(fly: Fly) -> None:
    status, metrics = fly(small_world(mission={"time_limit_s": 60.0}))
    assert (status, metrics["outcome"]) == (1, "timeout")
    left_m = math.hypot(5400.0, 5400.0) - 60.0 * 25.0
    assert metrics["reason"] == f"time limit 60 s, {left_m:.0f} m from the goal"
    assert metrics["flight_time_s"] == 60.0


def test_planner_that_raises(fly: Fly, answering: Install) -> None:
    answering(breaks)
    status, metrics = fly(small_world(planner={"kind": "stand_in"}))
    assert (status, metrics["outcome"]) == (1, "planner_failed")
    assert metrics["reason"].startswith("the planner raised ZeroDivisionError: no room between")
    assert metrics["flight_time_s"] == 5.0
    assert metrics["error"].startswith("Traceback")
    assert "ZeroDivisionError" in metrics["error"]


class Unspeakable(BaseException):
    """As a panic of compiled code or a cancelled task: no Exception; and it cannot say what it is."""

    def __str__(self) -> str:
        raise RuntimeError("no words")


@pytest.mark.parametrize("error", [Unspeakable(), GeneratorExit(), BaseExceptionGroup("g", [Unspeakable()])])
def test_whatever_a_planner_raises_is_its_failure(fly: Fly, answering: Install, error: BaseException) -> None:
    def panics(mission: Mission, request: PlanRequest) -> Plan:
        raise error

    answering(panics)
    status, metrics = fly(small_world(planner={"kind": "stand_in"}))
    assert (status, metrics["outcome"]) == (1, "planner_failed")
    assert metrics["reason"].startswith(f"the planner raised {type(error).__name__}")
    assert metrics["error"].rstrip().splitlines()


def test_an_interrupt_lets_the_planner_finish_first(answering: Install) -> None:
    """Machine code in its first calls does not stand one."""
    asked, answered = [], []

    def answers(mission: Mission, request: PlanRequest) -> Plan:
        asked.append(request.time_s)
        if request.time_s >= 5.0:
            signal.raise_signal(signal.SIGINT)
        answered.append(request.time_s)
        return straight_on(mission, request)

    answering(answers)
    with pytest.raises(KeyboardInterrupt):
        flown_by_point_mass(small_world(planner={"kind": "stand_in"}))
    assert asked == answered
    assert asked[-1] == 5.0


@pytest.mark.parametrize("reason", ["a closed wall lies round the goal", " \n"])
def test_unreachable(reason: str, fly: Fly, answering: Install) -> None:
    answering(lambda *_: Plan(PlanStatus.UNREACHABLE, reason))
    status, metrics = fly(small_world(planner={"kind": "stand_in"}))
    assert (status, metrics["outcome"]) == (3, "unreachable")
    assert metrics["reason"] == (reason.strip() or "the planner gives no reason")
    assert metrics["min_clearance_m"] is None


def test_lost_control(fly: Fly, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "jsbsim_aircraft", lambda _, start, air: Failing(start, air))
    status, metrics = fly(small_world())
    assert (status, metrics["outcome"]) == (1, "lost_control")
    assert metrics["reason"] == "stalled, angle of attack 31 deg"
    assert metrics["flight_time_s"] == pytest.approx(3.0, abs=1 / 120)
    assert metrics["trackable"] is False


def test_a_state_that_is_not_finite_is_no_row(fly: Fly, tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "jsbsim_aircraft", lambda _, start, air: Diverging(start, air))
    status, metrics = fly(small_world())
    assert (status, metrics["outcome"], metrics["trackable"]) == (1, "lost_control", False)
    assert metrics["flight_time_s"] == pytest.approx(3.0, abs=0.11)
    assert metrics["flown_length_m"] > 0.0
    for command in (["report"], ["export", "--format", "geojson"]):
        assert main([command[0], str(tmp_path / "run"), *command[1:]]) == 0
