"""A planner that is not done is asked between scans, and what it finds there is flown at once."""

from collections.abc import Callable

import numpy as np
import pytest

from harness.flight.closed_loop import fly
from harness.flight.observer import Observer
from harness.flight.record import Flight, Outcome
from harness.run.scenario_flight import make_loop
from tests.closed_loop.small import small_world
from tests.point_mass import PointMass
from wayproof import Mission, Path, Plan, PlanRequest, PlanStatus

Install = Callable[[Callable[[Mission, PlanRequest], Plan]], None]

SCAN_S, STEP_S = 0.5, 0.1


class Events(Observer):
    def __init__(self) -> None:
        self.told: list[tuple[float, str]] = []

    def on_event(self, time_s: float, text: str) -> None:
        self.told.append((time_s, text))


@pytest.fixture
def thinking(answering: Install) -> Callable[..., tuple[Flight, list[float], Events]]:
    """Flies ten seconds with a planner that goes on from one time to another, at which it finds a plan."""

    def flown(
        begins_s: float, found_s: float, latency_s: float = 0.0, rate_hz: float = 1.0 / SCAN_S
    ) -> tuple[Flight, list[float], Events]:
        asked: list[float] = []

        def answer(mission: Mission, request: PlanRequest) -> Plan:
            asked.append(round(request.time_s, 6))
            if not latency_s:
                assert request.scanned is (abs(request.time_s * rate_hz % 1.0 - 0.5) > 0.499)
            row = (*request.position_m, *request.direction, 0.0, 5000.0)
            found = Plan(PlanStatus.FOUND, "found", np.array([row[:2]]), Path(np.array([row])))
            if request.flown is None:
                return found
            if begins_s <= request.time_s < found_s - 1e-6:
                return Plan(PlanStatus.NO_PATH, "looks for a way", wants_more_time=True)
            first = all(time_s < found_s - 1e-6 for time_s in asked[:-1])
            return found if first and request.time_s >= begins_s else Plan(PlanStatus.KEPT, "serves")

        answering(answer)
        keys = {"kind": "stand_in", "compute_latency_s": latency_s}
        events = Events()
        scenario = small_world(planner=keys, mission={"time_limit_s": 10.0}, sensor={"rate_hz": rate_hz})
        return fly(make_loop(scenario, PointMass), [events]), asked, events

    return flown


@pytest.mark.parametrize("rate_hz", [1.0 / SCAN_S, 3.0, 12.0, 60.0])
def test_it_is_asked_twice_a_step_of_guidance_for_as_long_as_it_goes_on(
    rate_hz: float, thinking: Callable[..., tuple[Flight, list[float], Events]]
) -> None:
    _, asked, events = thinking(2.0, 4.0, rate_hz=rate_hz)
    scans = np.arange(round(10.0 * rate_hz)) / rate_hz
    between = np.arange(2.0, 4.0 + 1e-6, STEP_S / 2)
    assert asked == pytest.approx(sorted({*np.round(scans, 6).tolist(), *np.round(between, 6).tolist()}))
    assert [each for each in events.told if each[1] == "looks for a way"] == [(2.0, "looks for a way")]


@pytest.mark.parametrize(("found_s", "flown_s"), [(3.2, 3.2), (3.25, 3.3)])
def test_what_is_found_is_flown_from_the_next_step_of_guidance_on(
    found_s: float, flown_s: float, thinking: Callable[..., tuple[Flight, list[float], Events]]
) -> None:
    flight, _, _ = thinking(2.0, found_s)
    assert [each.time_s for each in flight.plans] == pytest.approx([0.0, flown_s])
    assert np.abs(flight.track.cross_track_m).max() < 1e-6


def test_a_plan_that_is_on_its_way_is_waited_for(
    thinking: Callable[..., tuple[Flight, list[float], Events]],
) -> None:
    flight, asked, _ = thinking(2.0, 3.25, latency_s=1.0)
    assert [each.time_s for each in flight.plans] == pytest.approx([1.0, 4.3])
    assert [each.delay_s for each in flight.plans] == pytest.approx([1.0, 4.3 - SCAN_S * (3.25 // SCAN_S)])
    assert not [time_s for time_s in asked if 3.25 < time_s < 4.3]


@pytest.mark.parametrize(("fails", "outcome"), [(False, Outcome.UNREACHABLE), (True, Outcome.PLANNER_FAILED)])
def test_what_it_says_between_steps_ends_the_flight_there(fails: bool, outcome: Outcome, answering: Install) -> None:
    def answer(mission: Mission, request: PlanRequest) -> Plan:
        if request.time_s < 1.0 + 0.4 * STEP_S:
            return Plan(PlanStatus.NO_PATH, "looks for a way", wants_more_time=request.time_s >= 1.0)
        if fails:
            raise ArithmeticError
        # What it said once it does not say again.
        return Plan(PlanStatus.UNREACHABLE if request.time_s < 1.0 + 0.6 * STEP_S else PlanStatus.KEPT, "none")

    answering(answer)
    flight = fly(make_loop(small_world(planner={"kind": "stand_in"}), PointMass))
    assert flight.outcome is outcome
    assert flight.sim_s == pytest.approx(1.0 + 0.5 * STEP_S)
