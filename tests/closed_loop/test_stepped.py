"""The loop stepped from outside: the same flight as `fly` flies, and misuse is told."""

from __future__ import annotations

import math

import numpy as np
import pytest

from harness.flight.closed_loop import ClosedLoop, fly
from harness.flight.record import Outcome, digest
from harness.flight.stepped import Status, SteppedLoop
from harness.run.scenario_flight import make_loop
from tests.closed_loop.conftest import SmallWorld
from tests.point_mass import PointMass

TREE = {"circle": {"center_m": [3000.0, 3100.0], "radius_m": 300.0}}


def test_steps_are_the_flight(small_world: SmallWorld) -> None:
    scenario = small_world(TREE, sensor={"rate_hz": 4.0})
    flight = fly(make_loop(scenario, PointMass))
    loop = SteppedLoop(lambda: make_loop(scenario, PointMass))
    seen: list[Status] = [loop.reset()]
    while not loop.done:
        seen.append(loop.step())
    assert digest(loop.flight().track) == digest(flight.track)
    assert (seen[-1].outcome, seen[-1].reason) == (Outcome.REACHED, flight.reason)
    assert [status.done for status in seen] == [False] * (len(seen) - 1) + [True]
    np.testing.assert_array_equal([status.time_s for status in seen], flight.track.time_s)
    np.testing.assert_array_equal([status.state.east_m for status in seen], flight.track.east_m)
    assert seen[0].to_go_m == pytest.approx(5400.0 * math.sqrt(2.0))
    assert seen[-1].to_go_m <= scenario.mission.goal_radius_m
    assert seen[0].plan_index == -1
    assert math.isnan(seen[0].cross_track_m)
    assert seen[-1].plan_index == len(flight.plans) - 1
    assert abs(seen[-2].cross_track_m) < 5.0


def test_a_reset_begins_the_same_flight_again(small_world: SmallWorld) -> None:
    loop = SteppedLoop(lambda: make_loop(small_world(TREE), PointMass))
    states = []
    for _ in range(2):
        first = loop.reset()
        states.append((first, *(loop.step() for _ in range(300))))
    before, after = ([status.state for status in each] for each in states)
    np.testing.assert_array_equal(before, after)


def test_a_step_before_the_first_reset_or_after_the_end_is_told(small_world: SmallWorld) -> None:
    loop = SteppedLoop(lambda: make_loop(small_world(mission={"time_limit_s": 0.25}), PointMass))
    with pytest.raises(RuntimeError, match=r"reset\(\) before step\(\)"):
        loop.step()
    loop.reset()
    with pytest.raises(RuntimeError, match=r"the flight is not over; it has come to 0 s"):
        loop.flight()
    while not loop.done:
        loop.step()
    with pytest.raises(RuntimeError, match=r"step\(\) after the end: .* 0\.3 s \(timeout: .*\); reset\(\)"):
        loop.step()
    assert not loop.reset().done


def test_a_loop_is_flown_once(small_world: SmallWorld) -> None:
    loop = make_loop(small_world(mission={"time_limit_s": 1.0}), PointMass)
    fly(loop)
    for again in (fly, ClosedLoop):
        with pytest.raises(
            RuntimeError, match="has been flown for 1 s already; every flight needs a loop of its own"
        ):
            again(loop)
