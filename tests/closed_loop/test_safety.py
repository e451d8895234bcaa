"""The safety invariant while flying: every plan put into effect could be flown for ever.

Seen against the truth, which the planner does not have: in a world that stands still every accepted plan joins the
flight, ends in a full turn, hits no true obstacle and stays inside the area all along, the turn included; so the
aircraft is safe whatever it finds, and even if it were never asked again. What is flown keeps the clearance.
"""

import math
import re
from dataclasses import replace
from pathlib import Path as FilePath

import numpy as np
import pytest

from harness.cli.app import main
from harness.flight.closed_loop import fly
from harness.flight.observer import Observer
from harness.flight.record import AcceptedPlan, Outcome
from harness.flight.termination import MissionEnd
from harness.run.scenario_flight import make_loop
from harness.world.world import World
from planner.geometry.clearance import distances
from planner.geometry.curves import on_loiter, pose_at, sample
from tests.closed_loop.small import small_world
from tests.closed_loop.test_convergence import BLUR, CLEARANCE_M, drawn
from tests.point_mass import PointMass
from wayproof import AircraftState, Path, dump_scenario


class Invariant(Observer):
    """Looks at every plan that takes effect, and at every step of the flight."""

    def __init__(self, world: World, turn_radius_m: float, tracking_error_m: float) -> None:
        self._world, self._radius, self._off = world, turn_radius_m, tracking_error_m
        self._before: Path | None = None
        self.plans = 0
        self.least_m = math.inf
        """Smallest true clearance of an accepted plan."""

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        path = accepted.plan.path
        assert path is not None
        self.plans += 1
        begin = pose_at(path, 0.0)[:2]
        joins_aircraft = math.dist(begin, (state.east_m, state.north_m)) <= 1.0 + 4.0 * self._off
        joins_plan = self._before is not None and distances(self._before, np.array([begin]))[0][0] < 1e-3
        assert joins_aircraft or joins_plan
        self._before = path
        ends, begins = path.segments[:-1], path.segments[1:]
        for row, following in zip(ends, begins, strict=True):
            np.testing.assert_allclose(pose_at(Path(row[None]), math.inf), following[:4], atol=1e-3)
        assert np.abs(path.segments[:, 4]).max() <= 1.0 / self._radius + 1e-9
        assert path.loiter
        turn = path.segments[-1]
        assert abs(turn[4]) * turn[5] == pytest.approx(math.tau)
        # Once round and a little on: the path closes upon itself.
        on = pose_at(path, on_loiter(path, path.length_m + 10.0))
        assert math.dist(on[:2], pose_at(path, path.length_m - turn[5] + 10.0)[:2]) < 1e-6
        places = sample(path, 20.0, 0.2)
        assert self._world.inside_bounds(*places.min(axis=0))
        assert self._world.inside_bounds(*places.max(axis=0))
        clearance = [self._world.clearance_at(x, y, state.time_s) for x, y in places.tolist()]
        self.least_m = min(self.least_m, *clearance)
        # It touches nothing. The clearance is kept from what had been seen; the last of an edge may come into
        # sight later, and then the plan is replaced before it is flown that far.
        assert min(clearance) > 0.0, f"plan {accepted.plan_index}"


@pytest.mark.flights
@pytest.mark.parametrize("seed", range(100, 110))
def test_every_plan_in_effect_is_safe_for_ever(seed: int) -> None:
    """A world of each family, on any first course."""
    course_deg = float(np.random.default_rng(seed).integers(0, 360))
    scenario = drawn(seed).scenario.with_({"mission.time_limit_s": 500, "mission.course_deg": course_deg})
    loop = make_loop(scenario, lambda start, air: PointMass(start, air, step_rate_hz=20))
    invariant = Invariant(loop.world, loop.mission.hold_radius_m, loop.mission.tracking_error_m)
    flight = fly(loop, [invariant])
    assert flight.outcome in (Outcome.REACHED, Outcome.UNREACHABLE, Outcome.TIMEOUT), flight.reason
    assert invariant.plans == len(flight.plans)
    assert flight.track.clearance_m.min() >= (1.0 - BLUR) * CLEARANCE_M


def test_the_invariant_sees_a_plan_that_is_not_safe() -> None:
    # The same plans, but a world that has something the planner was never shown.
    hidden = {"circle": {"center_m": [2000.0, 2250.0], "radius_m": 100.0}}
    blind, truth = make_loop(small_world(), PointMass), make_loop(small_world(hidden), PointMass).world
    invariant = Invariant(truth, blind.mission.hold_radius_m, blind.mission.tracking_error_m)
    with pytest.raises(AssertionError, match="plan"):
        fly(replace(blind, termination=MissionEnd(blind.world, blind.mission, 120.0)), [invariant])


@pytest.mark.parametrize(("range_m", "status"), [(255.0, 2), (270.0, 0)])
def test_a_sensor_that_cannot_see_a_turn_is_refused_with_the_numbers(
    tmp_path: FilePath, capsys: pytest.CaptureFixture[str], range_m: float, status: int
) -> None:
    text = dump_scenario(small_world(sensor={"range_m": 1000.0, "rays": 360}))
    text = re.sub(r"rolling_step_m: [\d.]+,?\s*", "", text).replace(", }", "}")
    at = tmp_path / "short.yaml"
    at.write_text(text.replace("range_m: 1000.0", f"range_m: {range_m:g}"))
    assert main(["validate", str(at)]) == status
    said = capsys.readouterr().err
    assert ("too short for a turn radius of 91 m with a clearance of 40 m" in said) is (status == 2)
    assert ("sensor.range_m: is 255, too short" in said) is (status == 2)
    assert ("must be at least 263" in said) is (status == 2)
    if status == 2:
        assert main(["fly", str(at), "--out", str(tmp_path / "run")]) == 2
        assert not (tmp_path / "run").exists()
