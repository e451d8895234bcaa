"""Updates that the flight model flies by itself: the same flight, to the last bit, as one update at a time."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from aircraft import guidance_law as law
from aircraft.guidance import PathFollower
from aircraft.interface import Route
from aircraft.jsbsim_model import JsbsimModel
from harness.flight import closed_loop
from harness.flight.closed_loop import fly
from harness.flight.record import Flight, Outcome, TrackLog, digest
from harness.run.compiled_guidance import path_follower
from harness.run.scenario_flight import atmosphere, jsbsim_aircraft, make_loop, start_conditions
from harness.scenario.scenario import Scenario, load_scenario
from harness.scenario.shipped import scenario_path
from tests.closed_loop.conftest import SmallWorld

TREE = {"circle": {"center_m": [3000.0, 3100.0], "radius_m": 300.0}}
MOVER = {"circle": {"center_m": [3000.0, 1500.0], "radius_m": 100.0}, "velocity_mps": [0.0, 6.0]}
POPS_UP = {"circle": {"center_m": [2500.0, 2500.0], "radius_m": 120.0}, "active_s": [30.0, 90.0]}
WIND = {"wind": {"speed_mps": 7.0, "from_deg": 250.0}}
STIRRED = {**WIND, "turbulence": {"model": "tustin", "intensity": "moderate"}}


class Counted:
    """How many updates were flown in a row."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.flown = self.asked = 0
        fly_on = JsbsimModel.fly_on

        def counted(*given: Any) -> int:
            flown = fly_on(*given)
            self.asked += 1
            self.flown += flown
            return flown

        monkeypatch.setattr(JsbsimModel, "fly_on", counted)


def one_by_one(scenario: Scenario, monkeypatch: pytest.MonkeyPatch) -> Flight:
    with monkeypatch.context() as patch:
        patch.setattr(JsbsimModel, "fly_on", lambda *_: 0)
        return fly(make_loop(scenario))


def same(flight: Flight, other: Flight) -> bool:
    """Whether two flights are the same, but for the time that they took."""
    return (
        digest(flight.track) == digest(other.track)
        and np.array_equal(flight.track.arc_length_m, other.track.arc_length_m, equal_nan=True)
        and np.array_equal(flight.track.throttle, other.track.throttle)
        and (flight.outcome, flight.reason) == (other.outcome, other.reason)
        and [plan.time_s for plan in flight.plans] == [plan.time_s for plan in other.plans]
    )


@pytest.mark.parametrize(
    "sections",
    [
        {},
        {"environment": WIND},
        {"environment": STIRRED},
        {"sensor": {"rate_hz": 4.0}},  # between two updates, too
        {"sensor": {"rate_hz": 0.5, "latency_s": 1.2}},
        {"sensor": {"rate_hz": 10.0}, "planner": {"compute_latency_s": 0.3}},
        {"sensor": {"range_noise_m": 10.0, "dropout": 0.1, "false_return": 0.01, "latency_s": 0.7}},
        {"mission": {"time_limit_s": 55.55}},
        {"area": {"origin": {"latitude_deg": -60.0, "longitude_deg": 179.98}}},  # the date line among patches
    ],
)
@pytest.mark.parametrize("obstacle", [TREE, MOVER, POPS_UP])
def test_they_are_the_same_flight(
    small_world: SmallWorld,
    sections: dict[str, Any],
    obstacle: dict[str, Any],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario = small_world(obstacle, **sections)
    single = one_by_one(scenario, monkeypatch)
    counted = Counted(monkeypatch)
    flight = fly(make_loop(scenario))
    assert same(flight, single)
    assert counted.flown > 0.5 * len(flight.track)


def test_most_of_a_flight_is_flown_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else nothing is gained: five updates come between two scans."""
    counted = Counted(monkeypatch)
    flight = fly(make_loop(load_scenario(scenario_path("aerosonde_forest"))))
    assert counted.flown > 0.95 * len(flight.track)
    assert counted.asked < 0.3 * len(flight.track)


def test_progress_and_blocks_come_when_they_would(
    small_world: SmallWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = small_world(TREE)
    told: list[list[tuple[float, float, str]]] = [[], []]
    single = one_by_one(scenario, monkeypatch)
    monkeypatch.setattr(closed_loop, "TrackLog", partial(TrackLog, block_rows=7))
    flight = fly(make_loop(scenario), (), lambda *words: told[0].append(words))
    with monkeypatch.context() as patch:
        patch.setattr(JsbsimModel, "fly_on", lambda *_: 0)
        fly(make_loop(scenario), (), lambda *words: told[1].append(words))
    assert same(flight, single)
    assert told[0] == told[1]
    assert len(told[0]) > flight.sim_s / 5.0


def test_control_is_lost_at_the_same_update(small_world: SmallWorld, monkeypatch: pytest.MonkeyPatch) -> None:
    """An aircraft that counts as rolled over at 25 degrees: it does so in its first turn."""
    scenario, flights = small_world(TREE), []
    fly_on = JsbsimModel.fly_on
    for each in (fly_on, lambda *_: 0):
        monkeypatch.setattr(JsbsimModel, "fly_on", each)
        loop = make_loop(scenario)
        assert isinstance(loop.model, JsbsimModel)
        loop.model._sheet[law.LIMITS + 3] = math.radians(25.0)
        flights.append(fly(loop))
    assert same(*flights)
    assert flights[0].outcome is Outcome.LOST_CONTROL
    assert 20.0 < abs(flights[0].track.roll_deg[-2]) <= 25.0 < abs(flights[0].track.roll_deg[-1])


def on_a_line(scenario: Scenario) -> tuple[JsbsimModel, PathFollower]:
    follower = path_follower(make_loop(scenario).model.airframe.guidance_limits)  # type: ignore[attr-defined]
    model = jsbsim_aircraft(scenario, start_conditions(scenario), atmosphere(scenario))
    assert isinstance(model, JsbsimModel)
    here = model.state()
    course = here.course_rad
    line = (here.east_m, here.north_m, math.sin(course), math.cos(course), 0.0, 50_000.0)
    follower.follow(Route(np.array([line])))
    return model, follower


def test_it_stops_in_time_and_fills_the_rows_that_it_is_given(small_world: SmallWorld) -> None:
    model, follower = on_a_line(small_world())
    track = np.full((20, 17), -1.0)
    assert model.fly_on(follower, track, 3, 5, 4, 12, math.inf) == 4
    assert model.state().time_s == 4 * 12 / 120
    assert (track[:3] == -1.0).all()
    assert (track[7:] == -1.0).all()
    assert track[3:7, 0].tolist() == [0.0, 0.1, 0.2, 0.3]
    assert (track[3:7, 16] == 5.0).all()
    # None begins at the time that is given, or later.
    assert model.fly_on(follower, track, 0, 5, 10, 12, 0.6) == 2
    assert model.fly_on(follower, track, 0, 5, 10, 12, 0.6) == 0
    assert model.state().time_s == 0.6


def test_none_are_flown_in_gusts_off_a_route_or_by_a_stranger(small_world: SmallWorld) -> None:
    track = np.zeros((20, 17))
    gusty = small_world(
        environment={"gust": {"shape": "step", "speed_mps": 3.0, "from_deg": 0.0, "start_s": 5.0}}
    )
    model, follower = on_a_line(gusty)
    assert model.fly_on(follower, track, 0, 0, 5, 12, math.inf) == 0
    model, follower = on_a_line(small_world())

    class Stranger(PathFollower):
        """May steer as it likes."""

    stranger = Stranger(model.airframe.guidance_limits)
    stranger.route = follower.route
    assert model.fly_on(stranger, track, 0, 0, 5, 12, math.inf) == 0
    assert model.fly_on(path_follower(model.airframe.guidance_limits), track, 0, 0, 5, 12, math.inf) == 0
    assert model.fly_on(follower, track, 0, 0, 5, 12, math.inf) == 5


def test_a_loop_whose_guidance_is_watched_has_it_asked_every_time(small_world: SmallWorld) -> None:
    loop = make_loop(small_world())
    asked: list[float] = []

    class Watched(PathFollower):
        def update(self, state: Any) -> Any:
            asked.append(state.time_s)
            return super().update(state)

    watched = Watched(loop.model.airframe.guidance_limits)  # type: ignore[attr-defined]
    flight = fly(replace(loop, follower=watched))
    assert flight.outcome is Outcome.REACHED
    assert asked == flight.track.time_s[flight.track.plan_index >= 0][:-1].tolist()
