"""What is written of very many obstacles is made with little memory, and is the same as of few."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.rerun_scene import circle, lines_2d
from harness.strict_yaml import dump
from harness.yaml_pieces import PIECE, dump_in_pieces
from planner.interface import FloatArray

NUMBER = 2 * PIECE + 3


def one_by_one(number: int) -> dict[str, object]:
    """With obstacles of both kinds, so many."""
    shapes = (
        {"circle": {"center_m": [0.1 * i, -2.5], "radius_m": 1e-7 * i}}
        if i % 3
        else {
            "polygon": {"vertices_m": [[float(i), 0.0], [1.0, 2.0], [3.5, i / 7.0]]},
            "velocity_mps": [1.0, 0.5],
        }
        for i in range(number)
    )
    return {
        "schema": "wayproof/scenario/1",
        "area": {"bounds_m": [0.0, 0.0, 1e5, 1e5]},
        "obstacles": list(shapes),
        "mission": {"start_m": (1.0, 2.0), "nothing": {}, "none": []},
        "note": "yes",
    }


@pytest.mark.parametrize("left_out", [(), ("mission", "note"), ("mission",), ("schema", "area"), ("area",)])
def test_a_long_list_in_pieces_is_the_same_text(left_out: tuple[str, ...]) -> None:
    value = {key: inner for key, inner in one_by_one(NUMBER).items() if key not in left_out}
    whole = dump(value)
    assert dump_in_pieces(value) == whole
    few = {**value, "obstacles": value["obstacles"][:5]}  # type: ignore[index]
    assert dump_in_pieces(few) == dump(few)


@pytest.mark.parametrize("inner", [1.5, "yes", [1.0, 2.0], {"a": 1}, {"a": {}}])
def test_so_is_a_long_list_of_anything(inner: object) -> None:
    for value in (
        {"a": {"b": 1}, "long": [inner] * NUMBER},
        {"long": [inner] * NUMBER},
        {"long": [inner] * NUMBER, "b": 2},
    ):
        text = dump_in_pieces(value)
        assert text == dump(value)
        assert yaml.safe_load(text) == value


@given(st.lists(st.integers(3, 6), min_size=1, max_size=6))
@settings(deadline=None, max_examples=30)
def test_outlines_are_recorded_as_they_are(lengths: list[int]) -> None:
    def recorded(rings: list[FloatArray]) -> list[list[list[float]]]:
        batch = lines_2d(rings, (1, 2, 3), 1.0, 1).strips
        assert batch is not None
        found: list[list[list[float]]] = batch.as_arrow_array().to_pylist()
        return found

    rings = [circle((10.0 * i, 1 / 3), 2.0 + i, points) for i, points in enumerate(lengths)]
    assert recorded(rings) == [ring.astype(np.float32).tolist() for ring in rings]
