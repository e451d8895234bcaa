"""A goal beside the border, where the area ends before there is room for a turn: it is flown to all the same."""

import math
from typing import Any

import pytest

from harness.analysis.smoothness import flown_lengths
from harness.flight.closed_loop import fly
from harness.flight.record import Outcome
from harness.run.scenario_flight import make_loop
from planner.geometry.clearance import inside_bounds
from planner.geometry.curves import end_of
from tests.closed_loop.small import small_world
from tests.point_mass import PointMass

SIDE_M, START, ROUNDING_M = 4000.0, (600.0, 600.0), 1e-6
BLUR = 0.25
"""What the clearance may lack beside a corner, as a share of it: the spacing of the points that the map keeps."""


def circle(x: float, y: float, radius: float) -> dict[str, Any]:
    return {"circle": {"center_m": [x, y], "radius_m": radius}}


CORNER, IN_IT, EAST = (3990.0, 3990.0), (4000.0, 4000.0), (3990.0, 2000.0)
WIND = {"wind": {"from_deg": 225.0, "speed_mps": 8.0}}


@pytest.mark.parametrize(
    ("goal_m", "radius_m", "clearance_m", "obstacles", "air"),
    [
        (CORNER, 40.0, 150.0, [], {}),
        (CORNER, 15.0, 40.0, [], {}),
        (IN_IT, 40.0, 150.0, [], {}),
        (CORNER, 40.0, 150.0, [], WIND),
        (CORNER, 40.0, 150.0, [circle(3500.0, 3500.0, 100.0)], {}),
        (CORNER, 40.0, 40.0, [circle(3600.0, 3600.0, 100.0)], {}),
        (EAST, 15.0, 150.0, [], {}),
    ],
)
def test_it_is_reached_by_the_shortest_way(
    goal_m: tuple[float, float],
    radius_m: float,
    clearance_m: float,
    obstacles: list[dict[str, Any]],
    air: dict[str, Any],
) -> None:
    scenario = small_world(
        *obstacles,
        area={"bounds_m": [0.0, 0.0, SIDE_M, SIDE_M]},
        mission={"start_m": list(START), "goal_m": list(goal_m), "goal_radius_m": radius_m},
        sensor={"range_m": 1000.0, "rays": 360, "rate_hz": 1.0},
        planner={"clearance_m": clearance_m},
        environment=air,
    )
    flight = fly(make_loop(scenario, lambda start, wind: PointMass(start, wind, step_rate_hz=20)))
    assert flight.outcome is Outcome.REACHED, flight.reason
    assert flown_lengths(flight.track).sum() < 1.05 * math.dist(START, goal_m)
    assert flight.track.clearance_m.min() >= (1.0 - BLUR) * clearance_m
    paths = [each.plan.path for each in flight.plans]
    for path in paths:
        assert path is not None
        assert inside_bounds(path, (-ROUNDING_M, -ROUNDING_M, SIDE_M + ROUNDING_M, SIDE_M + ROUNDING_M))
    first, last = paths[0], paths[-1]
    assert first is not None
    assert last is not None
    assert first.loiter
    assert not last.loiter
    assert end_of(last)[:2] == pytest.approx(goal_m)
