"""Which moving obstacles lie outside the planner's assumptions, against positions at many times."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely

from harness.flight.record import FloatArray
from harness.scenario.scenario import Scenario, parse_scenario
from harness.world.motion_assumptions import outside_assumptions, scenario_outside_assumptions
from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world.world import World

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))


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


def apart_m(one: Obstacle, other: Obstacle, times_s: FloatArray) -> float:
    """The least distance at any of the times, 0 where they meet."""
    (here, reach_m), (there, their_reach_m) = at(one, times_s), at(other, times_s)
    return max(float(shapely.distance(here, there).min()) - reach_m - their_reach_m, 0.0)


def test_contacts_are_those_of_positions_at_many_times() -> None:
    rng = np.random.default_rng(5)
    seen = set()
    for _ in range(60):
        pair = []
        for _ in range(2):
            centre, size, speed = (
                rng.uniform(-400.0, 400.0, 2),
                rng.uniform(10.0, 60.0),
                rng.uniform(1.0, 15.0),
            )
            turn = rng.uniform(0.0, math.tau)
            velocity = (speed * math.cos(turn), speed * math.sin(turn))
            corners = [tuple(centre + size * np.array((math.cos(a), math.sin(a)))) for a in (0.2, 2.0, 4.5)]
            circle = rng.random() < 0.5
            begins = float(rng.uniform(0.0, 20.0))
            pair.append(
                Obstacle(
                    Circle((float(centre[0]), float(centre[1])), size) if circle else Polygon(tuple(corners)),
                    velocity,
                    (begins, begins + 60.0),
                )
            )
        first, last = max(each.epoch_s for each in pair), min(each.interval_s[1] for each in pair)
        apart = apart_m(pair[0], pair[1], np.linspace(first, last, 2000))
        if 0.0 < apart < 0.5:
            continue  # too near to be told by samples
        said = told(*pair)
        assert (len(said) == 1) is (apart == 0.0)
        seen.add(apart == 0.0)
    assert seen == {True, False}
