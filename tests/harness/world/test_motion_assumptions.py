"""Which moving obstacles lie outside the planner's assumptions, against positions at many times."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely

from harness.flight.record import FloatArray
from harness.scenario.scenario import Scenario, parse_scenario
from harness.world.motion_assumptions import outside_assumptions, scenario_outside_assumptions
from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world.world import World


def told(*obstacles: Obstacle, until_s: float = 100.0) -> tuple[str, ...]:
    return outside_assumptions(obstacles, 25.0, 1000.0, until_s)


@pytest.mark.parametrize(
    ("speed_mps", "airspeed_mps", "inside"),
    [(0.4, 25.0, False), (0.5, 25.0, True), (19.9, 25.0, True), (20.1, 25.0, False), (30.1, 60.0, False)],
)
def test_speeds(speed_mps: float, airspeed_mps: float, inside: bool) -> None:
    obstacle = Obstacle(Circle((0.0, 0.0), 10.0), (0.0, -speed_mps))
    assert (outside_assumptions([obstacle], airspeed_mps, 1000.0, 100.0) == ()) is inside


def test_the_width_is_that_across_the_motion() -> None:
    wall = Polygon(((0.0, 0.0), (50.0, 0.0), (50.0, 3000.0), (0.0, 3000.0)))
    (said,) = told(Obstacle(wall, (10.0, 0.0)))
    assert said == (
        "obstacles[0] is 3,000 m wide across its motion; assumed is no more than the sensing range, 1,000 m"
    )
    assert told(Obstacle(wall, (0.0, 10.0))) == ()
    assert told(Obstacle(Circle((0.0, 0.0), 501.0), (0.0, 10.0))) != ()


def test_where_nothing_moves_no_world_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 100,000 buildings it took as long to make as the file to read."""
    text = (
        "schema: wayproof/scenario/1\nname: a\narea: {bounds_m: [0, 0, 9000, 9000]}\n"
        "mission: {start_m: [500, 500], goal_m: [8000, 8000]}\nobstacles:\n"
        "  - circle: {center_m: [4000, 4000], radius_m: 100}\n"
    )
    fast = parse_scenario(f"{text}    velocity_mps: [40, 0]\n")
    assert scenario_outside_assumptions(fast) == ("obstacles[0] moves at 40 m/s; assumed are 0.5 to 20 m/s",)
    made: list[Scenario] = []
    monkeypatch.setattr(World, "from_scenario", made.append)
    for standing in (text, f"{text}    velocity_mps: [0, 0]\n    active_s: [5, 9]\n"):
        assert scenario_outside_assumptions(parse_scenario(standing)) == ()
    assert made == []


def at(obstacle: Obstacle, times_s: FloatArray) -> tuple[Any, float]:
    """The obstacle at each time: points or polygons, and how far about them it reaches."""
    shifts = np.array([obstacle.displacement_m(float(time_s)) for time_s in times_s])
    if isinstance(obstacle.shape, Circle):
        return shapely.points(shifts + obstacle.shape.center_m), obstacle.shape.radius_m
    return shapely.polygons(shifts[:, None, :] + np.array(obstacle.shape.vertices_m)), 0.0
