"""Generated worlds: the same of the same seed, room about start and goal, gaps kept, ways where they are promised."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

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


KEYS = {
    "circles": scattered(radius_m=spans),
    "forest": scattered(radius_m=spans, trunks=st.tuples(st.integers(1, 2), st.integers(2, 5))),
}
worlds = st.sampled_from(sorted(GENERATORS)).flatmap(
    lambda name: st.tuples(st.just(name), KEYS[name], st.integers(0, 2**53))
)


def shape(obstacle: dict[str, Any]) -> shapely.Geometry:
    return shapely.Point(obstacle["circle"]["center_m"]).buffer(obstacle["circle"]["radius_m"], 64)


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
    room = keys["room_m"]
    xmin, ymin, xmax, ymax = made.bounds_m
    shapes = [shape(each) for each in made.obstacles]
    for x, y in (made.start_m, made.goal_m):
        assert min(x - xmin, xmax - x, y - ymin, ymax - y) >= room - ROUNDING_M
        assert all(each.distance(shapely.Point(x, y)) >= room - ROUNDING_M for each in shapes)
    assert all(each.is_valid and each.area > 0 for each in shapes)


@pytest.mark.flights
@BOUNDED
@given(st.sampled_from(GENERATORS), st.integers(0, 2**53), st.data())
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
    ("name", "keys", "sentence"),
    [
        ("circles", {"density_1pkm2": 4001}, "asks for 100025 obstacles; must be at most 10000"),
        ("forest", {"density_1pkm2": 50, "trunks": (1, 100)}, "asks for 125000 obstacles"),
    ],
)
def test_more_than_a_world_can_hold_is_refused(name: str, keys: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        WorldSpec.model_validate({name: keys})


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
