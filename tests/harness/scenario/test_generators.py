"""Generated forests: the same of the same seed, room about start and goal, gaps kept."""

from itertools import combinations
from typing import Any

import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from harness.files.strict_yaml import key_path
from harness.scenario.generators import WorldSpec, generated

ROUNDING_M = 0.2

sides = st.floats(2000.0, 6000.0)
FORESTS = st.fixed_dictionaries(
    {
        "size_m": st.tuples(sides, sides),
        "room_m": st.floats(100.0, 500.0),
        "gap_m": st.floats(0.0, 600.0),
        "density_1pkm2": st.floats(0.0, 4.0),
        "radius_m": st.tuples(st.floats(30.0, 150.0), st.floats(150.0, 400.0)),
        "trunks": st.tuples(st.integers(1, 2), st.integers(2, 5)),
    }
)


def world(seed: int, **keys: Any) -> dict[str, Any]:
    made = generated(WorldSpec.model_validate({"forest": keys}), seed)
    return {key_path(loc): value for loc, value in made.items()}


@settings(derandomize=True, max_examples=12, suppress_health_check=[HealthCheck.too_slow])
@given(FORESTS, st.integers(0, 2**53))
def test_a_world_is_a_function_of_its_seed_and_keeps_room_and_gaps(keys: dict[str, Any], seed: int) -> None:
    made = world(seed, **keys)
    assert made == world(seed, **keys)
    xmin, ymin, xmax, ymax = made["area.bounds_m"]
    circles = [each["circle"] for each in made["obstacles"]]
    trunks = [shapely.Point(each["center_m"]).buffer(each["radius_m"], 64) for each in circles]
    for x, y in (made["mission.start_m"], made["mission.goal_m"]):
        assert min(x - xmin, xmax - x, y - ymin, ymax - y) >= keys["room_m"] - ROUNDING_M
        assert all(each.distance(shapely.Point(x, y)) >= keys["room_m"] - ROUNDING_M for each in trunks)
    # The trunks of a copse overlap: a copse is one.
    for one, other in combinations(shapely.get_parts(shapely.union_all(trunks)), 2):
        assert one.distance(other) >= keys["gap_m"] - 2 * ROUNDING_M


def test_density_is_the_number_a_square_kilometre_where_there_is_room() -> None:
    discs: dict[str, Any] = {"radius_m": (50, 60), "trunks": (1, 1)}
    assert len(world(1, size_m=(10000, 5000), density_1pkm2=1.0, gap_m=100, **discs)["obstacles"]) == 50
    assert 5 < len(world(1, size_m=(2000, 2000), density_1pkm2=100.0, gap_m=400, **discs)["obstacles"]) < 40
