"""The clairvoyant optimum against closed forms, against the worlds' own figures, and against itself."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world.optimum import Optimum, shortest_path

WORLDS = Path(__file__).parents[4] / "shared" / "worlds"
FAMILIES = (
    *("barn", "circles_high", "ctu_dubins", "dead_ends", "enclosed_goal", "faster_forest", "maze5", "maze8"),
    *("mrpb", "ompl_circles", "paper_like", "polygon_field", "slots", "spiral", "u_trap", "wall_across"),
)
ROUNDING_M = 0.051  # the worlds' figures have one decimal

AREA = (-100.0, -100.0, 100.0, 100.0)
WEST, EAST = (-50.0, 0.0), (50.0, 0.0)


def disc(east: float, north: float, radius: float) -> Obstacle:
    return Obstacle(Circle((east, north), radius))


def block(west: float, south: float, east: float, north: float) -> Obstacle:
    return Obstacle(Polygon(((west, south), (east, south), (east, north), (west, north))))


def way(
    *obstacles: Obstacle,
    clearance: float = 0.0,
    start: tuple[float, float] = WEST,
    goal: tuple[float, float] = EAST,
) -> Optimum:
    return shortest_path(obstacles, AREA, start, goal, clearance)


def test_what_reaches_to_the_goal_circle_counts_as_far_as_it_lies_beyond() -> None:
    """A wall 10 m before the goal, in one piece or in two that touch: the way leads round its end, with 1 m to it."""
    whole = math.dist(WEST, (34.0, 60.0)) + 6.0 + math.dist((40.0, 60.0), EAST) - 10.0
    for blocks in [(34.0, -99.0, 40.0, 60.0)], [(34.0, -99.0, 40.0, -30.0), (34.0, -30.0, 40.0, 60.0)]:
        found = shortest_path([block(*each) for each in blocks], AREA, WEST, EAST, 1.0, 10.0)
        assert found.length_m == pytest.approx(whole, rel=0.02)


@pytest.mark.parametrize("reach", [0.0, 8.0, 25.0])
def test_the_goal_circle_ends_it_and_nothing_makes_it_longer_than_a_way_there(reach: float) -> None:
    """Round a disc of 20 m to a circle of 10 m. What stands in that circle never lengthens the bound."""
    radius, goal_radius = 20.0, 10.0
    whole = 2 * math.sqrt(50.0**2 - radius**2) + radius * (math.pi - 2 * math.acos(radius / 50.0))
    near = [disc(50.0, 0.0 + 5.0 + reach, 5.0)] if reach else []
    found = shortest_path([disc(0.0, 0.0, radius), *near], AREA, WEST, EAST, 0.0, goal_radius)
    assert found.length_m == pytest.approx(whole - goal_radius, rel=1e-12)
    assert math.dist(found.points_m[-1], EAST) == pytest.approx(goal_radius, abs=0.1)
    assert shortest_path([], AREA, WEST, EAST, 0.0, 200.0).length_m == 0.0


@pytest.mark.parametrize("clearance", [0.0, 5.0])
def test_round_a_square(clearance: float) -> None:
    to_corner = math.hypot(50.0 - 15.0, 15.0)
    bend = math.atan2(15.0, 35.0) + math.asin(clearance / to_corner)
    exact = 2 * math.sqrt(to_corner**2 - clearance**2) + 30.0 + 2 * clearance * bend
    assert way(block(-15.0, -15.0, 15.0, 15.0), clearance=clearance).length_m == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize(
    ("obstacles", "reason"),
    [
        ([block(-5.0, -100.0, 5.0, 100.0)], "there is no way"),
        ([disc(0.0, -60.0, 41.0), disc(0.0, 60.0, 41.0), disc(0.0, 0.0, 19.5)], "there is no way"),
        ([disc(-50.0, 10.0, 9.5)], "the start is outside the area or nearer than the clearance"),
        ([block(45.0, -5.0, 55.0, 5.0)], "the goal is outside the area or nearer than the clearance"),
        ([Obstacle(Circle((0.0, 0.0), 5.0), velocity_mps=(1.0, 0.0))], "an obstacle moves"),
        ([Obstacle(Circle((0.0, 0.0), 5.0), active_s=(0.0, 9.0))], "an obstacle moves, appears"),
    ],
)
def test_says_why_there_is_none(obstacles: list[Obstacle], reason: str) -> None:
    found = way(*obstacles, clearance=1.0)
    assert found.length_m is None
    assert found.reason.startswith(reason)
    assert found.points_m.shape == (0, 2)


coordinate = st.integers(-40, 40).map(float)
discs = st.builds(disc, coordinate, coordinate, st.integers(2, 15).map(float))
blocks = st.builds(
    lambda east, north, wide, high: block(east, north, east + wide, north + high),
    *(coordinate, coordinate, st.integers(1, 30), st.integers(1, 30)),
)
fields = st.lists(discs | blocks, max_size=7)
ENDS = {"start": (-90.0, -5.0), "goal": (90.0, 5.0)}


@given(field=fields, clearance=st.sampled_from([0.0, 3.0]))
@settings(max_examples=30, derandomize=True)
def test_the_drawn_path_keeps_clearance_and_has_the_length(field: list[Obstacle], clearance: float) -> None:
    found = way(*field, clearance=clearance, **ENDS)
    assert found.length_m is not None
    points = found.points_m
    drawn = float(np.hypot(*np.diff(points, axis=0).T).sum())
    assert drawn <= found.length_m * (1 + 1e-12)
    assert drawn == pytest.approx(found.length_m, rel=1e-4)
    steps = np.linspace(0.0, 1.0, 50)[:, None, None]
    between = (points[:-1] + steps * np.diff(points, axis=0)).reshape(-1, 2)
    for each in field:
        sagitta = (getattr(each.shape, "radius_m", 0.0) + clearance) * (1 - math.cos(math.radians(0.5)))
        assert each.distance(between, np.zeros(len(between))).min() >= clearance - sagitta - 1e-5


@pytest.mark.skipif(not WORLDS.is_dir(), reason="the shared worlds are not beside this checkout")
@pytest.mark.parametrize("family", FAMILIES)
def test_agrees_with_the_shared_worlds(family: str) -> None:
    world = json.loads(sorted((WORLDS / family).glob("*.json"))[0].read_text())
    field = [disc(*circle) for circle in world["circles_m"]]
    field += [Obstacle(Polygon(tuple(map(tuple, ring)))) for ring in world["polygons_m"]]
    start, goal = ((world[end][0], world[end][1]) for end in ("start_m", "goal_m"))
    found = shortest_path(field, tuple(world["bounds_m"]), start, goal, world["clearance_m"])
    if world["optimum_m"] is None:
        assert found.length_m is None
    else:
        assert found.length_m == pytest.approx(world["optimum_m"], rel=1e-6, abs=ROUNDING_M)
