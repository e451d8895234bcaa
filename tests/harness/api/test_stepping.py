"""Flights that are stepped from Python."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

import wayproof
from harness.flight.observer import Observer
from harness.flight.record import AcceptedPlan
from harness.mapping.scan import RangeScan
from tests.harness.api.worlds import Beeline, small
from wayproof import AircraftState, Path, Plan, PlanRequest, PlanStatus


def flown(flight: wayproof.SteppedFlight) -> wayproof.FlightResult:
    status = flight.reset()
    while not status.done:
        status = flight.step()
    return flight.result()


def test_a_stepped_flight_is_the_flight_that_fly_flies() -> None:
    flight = wayproof.make(small())
    stepped, run = flown(flight), wayproof.fly(small())
    assert stepped.digest == run.digest
    assert (stepped.outcome, stepped.reason, stepped.scenario) == (run.outcome, run.reason, run.scenario)
    for name in run.track.column_names:
        np.testing.assert_array_equal(stepped.track[name].to_numpy(), run.track[name].to_numpy())
    assert stepped.plans["path"].equals(run.plans["path"])
    assert flown(flight).digest == run.digest


def test_it_takes_what_fly_takes() -> None:
    stepped = flown(wayproof.make(small(), planner=Beeline))
    assert stepped.digest == wayproof.fly(small(), planner=Beeline).digest
    assert wayproof.make("aerosonde_forest", guidance="npfg").scenario.guidance.kind == "npfg"
    with pytest.raises(wayproof.InputError, match=r"planner\.kind: is 'nix'; must be one of"):
        wayproof.make(small(), planner="nix")
    with pytest.raises(wayproof.InputError, match=r"guidance law: .* int"):
        wayproof.make(small(), guidance=3)
    with pytest.raises(wayproof.InputError, match="no_such_world"):
        wayproof.make("no_such_world.yaml")


def test_a_caller_steers_by_roll_commands_step_by_step() -> None:
    flight = wayproof.make(small())
    flight.reset()
    given = [math.radians(10.0 * math.sin(0.1 * step)) for step in range(100)]
    for roll_rad in given:
        status = flight.step(roll_command_rad=roll_rad)
    assert math.degrees(abs(status.state.roll_rad)) > 1.0
    for wrong in (math.nan, math.inf):
        with pytest.raises(ValueError, match=r"roll_command_rad is .*; must be finite"):
            flight.step(roll_command_rad=wrong)
    while not flight.done:
        status = flight.step()  # the law takes over again
    rolls = flight.result().track["roll_command_deg"].to_numpy()
    np.testing.assert_allclose(rolls[:100], np.degrees(given), rtol=0, atol=1e-12)
    assert status.outcome is not None
    assert status.outcome.value == "reached"


class Steered:
    """A planner that flies straight to where its owner says, from the next scan on."""

    def __init__(self) -> None:
        self.waypoint_m: tuple[float, float] | None = None

    def plan(self, request: PlanRequest) -> Plan:
        if self.waypoint_m is None:
            return Plan(PlanStatus.KEPT, "no new waypoint")
        print("on to", self.waypoint_m)
        line, self.waypoint_m = np.array([request.position_m, self.waypoint_m]), None
        return Plan(PlanStatus.FOUND, "to the waypoint", line, Path.through(line))


class Scans(Observer):
    """An observer that counts."""

    def __init__(self) -> None:
        self.scans = self.plans = 0

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        self.scans += 1

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        self.plans += 1
        print("a plan")


def test_a_caller_is_the_planner_waypoint_by_waypoint(capsys: pytest.CaptureFixture[str]) -> None:
    planner, seen, second = Steered(), Scans(), False
    flight = wayproof.make(small(), planner=planner, observers=[seen])
    waypoints: Sequence[tuple[float, float]] = ((700.0, 950.0), (1200.0, 1000.0))
    status = flight.reset()
    planner.waypoint_m = waypoints[0]
    while not status.done:
        status = flight.step()
        if not second and status.plan_index == 0 and status.arc_length_m > 380.0:
            planner.waypoint_m, second = waypoints[1], True
    run = flight.result()
    assert run.outcome == "reached"
    assert [path[-1] for path in run.plans["path"].to_pylist()][:2] == [list(each) for each in waypoints]
    assert seen.plans == run.plans.num_rows
    assert capsys.readouterr() == ("a plan\n" * 2, "on to (700.0, 950.0)\non to (1200.0, 1000.0)\n")
    assert seen.scans == pytest.approx(2.0 * run.metrics.flight_time_s, abs=1.5)


def test_a_flight_whose_step_was_broken_off_is_not_gone_on_with() -> None:
    flight = wayproof.make(small(), observers=[seen := Scans()])
    flight.reset()
    del seen.scans  # so that the next scan raises
    with pytest.raises(AttributeError, match="scans"):
        flight.step()
    with pytest.raises(RuntimeError, match="its last step was broken off"):
        flight.step()
    seen.scans = 0
    assert flown(flight).digest == wayproof.fly(small()).digest


def test_misuse_is_told() -> None:
    flight = wayproof.make(small().with_({"mission.time_limit_s": 0.25}))
    with pytest.raises(RuntimeError, match=r"reset\(\) before step\(\)"):
        flight.step()
    with pytest.raises(RuntimeError, match="no flight has begun"):
        flight.result()
    flight.reset()
    with pytest.raises(RuntimeError, match="the flight is not over"):
        flight.result()
    for _ in range(3):
        flight.step()
    with pytest.raises(RuntimeError, match=r"step\(\) after the end"):
        flight.step()
