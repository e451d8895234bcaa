"""Generated worlds: the same of the same seed, room about start and goal, gaps kept, ways where they are promised."""

from __future__ import annotations

import math
import time
from itertools import combinations
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from harness.files.strict_yaml import dump
from harness.scenario.generators import GENERATORS, GeneratedWorld, WorldSpec, generated
from harness.scenario.scenario import parse_scenario

ROUNDING_M = 0.2
BOUNDED = settings(derandomize=True, max_examples=12, suppress_health_check=[HealthCheck.too_slow])

rooms = st.floats(100.0, 500.0)
spans = st.tuples(st.floats(30.0, 150.0), st.floats(150.0, 400.0))


def scattered(**own: st.SearchStrategy[Any]) -> st.SearchStrategy[dict[str, Any]]:
    sides = st.floats(2000.0, 6000.0)
    return st.fixed_dictionaries(
        {
            "size_m": st.tuples(sides, sides),
            "room_m": rooms,
            "gap_m": st.floats(0.0, 600.0),
            "density_1pkm2": st.floats(0.0, 4.0),
            **own,
        }
    )


cells = st.tuples(st.integers(2, 6), st.integers(1, 6))
corridors = st.floats(200.0, 1500.0)
walls = st.floats(10.0, 90.0)
KEYS = {
    "circles": scattered(radius_m=spans),
    "forest": scattered(radius_m=spans, trunks=st.tuples(st.integers(1, 2), st.integers(2, 5))),
    "u_traps": scattered(wall_m=walls, turned_deg=st.floats(0.0, 180.0)),
    "maze": st.fixed_dictionaries(
        {"cells": cells, "corridor_m": corridors, "wall_m": walls, "loops": st.floats(0, 1)}
    ),
}
worlds = st.sampled_from(sorted(GENERATORS)).flatmap(
    lambda name: st.tuples(st.just(name), KEYS[name], st.integers(0, 2**53))
)


def shape(obstacle: dict[str, Any]) -> shapely.Geometry:
    if "circle" in obstacle:
        return shapely.Point(obstacle["circle"]["center_m"]).buffer(obstacle["circle"]["radius_m"], 64)
    return shapely.Polygon(obstacle["polygon"]["vertices_m"])


def world(name: str, seed: int, **keys: Any) -> GeneratedWorld:
    return generated(WorldSpec.model_validate({name: keys}), seed)


@BOUNDED
@given(worlds)
def test_a_world_is_a_function_of_its_seed_and_has_room_about_start_and_goal(
    drawn: tuple[str, dict[str, Any], int],
) -> None:
    name, keys, seed = drawn
    made = world(name, seed, **keys)
    assert made == world(name, seed, **keys)
    room = keys["room_m"] if "room_m" in keys else keys["corridor_m"] / 2
    xmin, ymin, xmax, ymax = made.bounds_m
    shapes = [shape(each) for each in made.obstacles]
    for x, y in (made.start_m, made.goal_m):
        assert min(x - xmin, xmax - x, y - ymin, ymax - y) >= room - ROUNDING_M
        assert all(each.distance(shapely.Point(x, y)) >= room - ROUNDING_M for each in shapes)
    assert all(each.is_valid and each.area > 0 for each in shapes)


@pytest.mark.flights
@BOUNDED
@given(st.sampled_from(("circles", "forest", "u_traps")), st.integers(0, 2**53), st.data())
def test_the_gap_is_kept_between_all_that_lies_about(name: str, seed: int, data: st.DataObject) -> None:
    keys = data.draw(KEYS[name])
    shapes = [shape(each) for each in world(name, seed, **keys).obstacles]
    # The trunks of a copse overlap: a copse is one.
    apart = list(shapely.get_parts(shapely.union_all(shapes))) if name == "forest" else shapes
    for one, other in combinations(apart, 2):
        assert one.distance(other) >= keys["gap_m"] - 2 * ROUNDING_M


def test_density_is_the_number_a_square_kilometre_where_there_is_room() -> None:
    made = world("circles", 1, size_m=(10000, 5000), density_1pkm2=1.0, radius_m=(50, 60), gap_m=100)
    assert len(made.obstacles) == 50
    crowded = world("circles", 1, size_m=(2000, 2000), density_1pkm2=100.0, radius_m=(90, 100), gap_m=300)
    assert 5 < len(crowded.obstacles) < 40


@pytest.mark.parametrize(
    "keys",
    [
        {"size_m": (50_000, 50_000), "density_1pkm2": 10.0, "radius_m": (5, 10), "gap_m": 0},
        {"density_1pkm2": 4000.0},
        {"density_1pkm2": 4000.0, "radius_m": (1, 1000), "gap_m": 0},
    ],
    ids=["many", "no place", "small ones between large ones"],
)
def test_what_is_asked_for_takes_no_longer_than_it_takes_to_place(keys: dict[str, Any]) -> None:
    begun = time.process_time()
    made = world("circles", 1, **keys)
    assert time.process_time() - begun < 8.0
    assert 10 < len(made.obstacles) <= 25_000


@pytest.mark.parametrize(
    ("name", "keys", "sentence"),
    [
        ("circles", {"density_1pkm2": 4001}, "asks for 100025 obstacles; must be at most 100000"),
        ("forest", {"density_1pkm2": 50, "trunks": (1, 100)}, "asks for 125000 obstacles"),
    ],
)
def test_more_than_a_world_can_hold_is_refused(name: str, keys: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        WorldSpec.model_validate({name: keys})


def reachable(made: GeneratedWorld, step_m: float) -> bool:
    """Whether a point that moves on a grid gets from start to goal."""
    area = shapely.union_all([shape(each) for each in made.obstacles])
    xs, ys = (np.arange(made.bounds_m[i] + step_m / 2, made.bounds_m[i + 2], step_m) for i in (0, 1))
    grid = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1)
    free = ~shapely.contains_xy(area, grid[..., 0], grid[..., 1])
    parts = {tuple(cell) for cell in np.argwhere(free).tolist()}
    begin, end = ((int(x / step_m), int(y / step_m)) for x, y in (made.start_m, made.goal_m))
    way = [begin]
    while way:
        i, j = way.pop()
        for cell in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
            if cell in parts:
                parts.remove(cell)
                way.append(cell)
    return end not in parts


@pytest.mark.parametrize("seed", range(4))
def test_a_maze_has_one_way_and_closes_the_others(seed: int) -> None:
    maze = world("maze", seed, cells=(5, 4), corridor_m=300.0, wall_m=40.0)
    assert reachable(maze, 10.0)
    assert not shapely.LineString([maze.start_m, maze.goal_m]).disjoint(
        shapely.union_all([shape(each) for each in maze.obstacles])
    )
    rooms = shapely.box(*maze.bounds_m).difference(shapely.union_all([shape(e) for e in maze.obstacles]))
    assert rooms.geom_type == "Polygon", "all cells hang together"
    assert len(rooms.interiors) == 0, "one way between any two: no wall stands alone"
    assert world("maze", seed, loops=1.0).obstacles == ()


def test_a_trap_opens_towards_the_start() -> None:
    made = world("u_traps", 3, turned_deg=0.0, density_1pkm2=0.5)
    assert made.obstacles
    for each in made.obstacles:
        trap = shape(each)
        hull = trap.convex_hull
        inside = hull.difference(trap).centroid
        away = (inside.x - made.start_m[0], inside.y - made.start_m[1])
        back = shapely.LineString([(inside.x, inside.y), (inside.x + away[0], inside.y + away[1])])
        out = shapely.LineString([made.start_m, (inside.x, inside.y)])
        assert trap.intersects(back)
        assert not trap.intersects(out)


def test_a_world_seed_holds_the_world() -> None:
    spec = WorldSpec.model_validate({"seed": 4, "circles": {}})
    assert generated(spec, 1) == generated(spec, 2) == world("circles", 4)
    assert world("circles", 1) != world("circles", 2)


@pytest.mark.parametrize("name", GENERATORS)
def test_the_defaults_make_a_scenario(name: str) -> None:
    made = world(name, 11)
    scenario = parse_scenario(
        dump(
            {
                "schema": "wayproof/scenario/1",
                "name": name,
                "area": {"bounds_m": list(made.bounds_m)},
                "obstacles": list(made.obstacles),
                "mission": {"start_m": list(made.start_m), "goal_m": list(made.goal_m)},
            }
        )
    )
    assert len(scenario.obstacles) == len(made.obstacles) > 0
    assert math.dist(made.start_m, made.goal_m) > 1000
