"""The true ground: heights, contact, and how far one may fly without looking."""

import math

import numpy as np
import pytest

from harness.world.ground import Ground
from harness.world_files.height_field import HeightField, packed, unpacked


def hills(rows: int = 40, columns: int = 50, spacing_m: float = 30.0) -> HeightField:
    north, east = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    heights = 200.0 + 80.0 * np.sin(east / 5.0) * np.cos(north / 7.0) + 3.0 * east
    return HeightField((-100.0, 50.0), (spacing_m, spacing_m), heights)


def test_heights_are_those_of_the_nodes_and_bilinear_in_between() -> None:
    field = hills()
    assert field.at(np.array([-100.0 + 30 * 7]), np.array([50.0 + 30 * 9]))[0] == field.heights_m[9, 7]
    middle = field.at(np.array([-100.0 + 30 * 7.5]), np.array([50.0 + 30 * 9.5]))[0]
    assert middle == pytest.approx(field.heights_m[9:11, 7:9].mean())
    assert np.isnan(field.at(np.array([-101.0, 1e9]), np.array([60.0, 60.0]))).all()


def test_a_field_comes_back_from_its_text_to_the_step() -> None:
    field = hills()
    field.heights_m[0, 3] = np.nan
    again = unpacked(packed(field.heights_m, 100.0, 0.1), 40, 50, 100.0, 0.1)
    assert np.nanmax(np.abs(again - field.heights_m)) <= 0.05 + 1e-9
    assert (np.isnan(again) == np.isnan(field.heights_m)).all()


@pytest.mark.parametrize(
    ("text", "rows", "sentence"),
    [
        ("not base64!", 2, "is not base64 of zlib"),
        ("AAAA", 2, "is not base64 of zlib"),
        (packed(np.zeros((3, 4)), 0.0, 0.1), 2, "does not hold 2 x 4 heights"),
        (packed(np.zeros((3, 4)), 0.0, 0.1), 4, "does not hold 4 x 4 heights"),
        (packed(np.zeros((3, 4)), 0.0, 0.1), 10**7, "must be at most"),
    ],
)
def test_a_text_that_holds_other_heights_is_refused(text: str, rows: int, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        unpacked(text, rows, 4, 0.0, 0.1)


SPIKES_M = np.where(np.random.default_rng(5).random((120, 150)) < 0.005, 6000.0, 0.0)


@pytest.mark.parametrize("field", [hills(), HeightField((-100.0, 50.0), (20.0, 24.0), SPIKES_M)])
def test_within_its_reach_nothing_is_ever_touched(field: HeightField) -> None:
    rng, ground = np.random.default_rng(5), Ground(field)
    (west, south), (up, right) = field.corner_m, np.subtract(field.heights_m.shape, 1) * field.spacing_m[::-1]
    reaches = []
    for _ in range(300):
        position = west + rng.uniform(0.0, right), south + rng.uniform(0.0, up), rng.uniform(150.0, 700.0)
        reach_m = ground.reach_m(position)
        reaches.append(reach_m)
        if reach_m == 0.0:
            continue
        way = rng.normal(size=(200, 3))
        ends = (
            np.array(position)
            + reach_m * rng.uniform(0, 1, (200, 1)) ** 0.1 * way / np.linalg.norm(way, axis=1)[:, None]
        )
        assert not (ends[:, 2] < field.at(ends[:, 0], ends[:, 1])).any()
        assert ground.above_m(position) >= min(reach_m, 30.0) or math.isnan(ground.above_m(position))
    assert max(reaches) > 200.0
    assert min(reaches) == 0.0


def test_a_way_through_a_ridge_touches_it() -> None:
    field = hills()
    ground = Ground(field)
    top = np.unravel_index(int(np.argmax(field.heights_m[5:-5, 5:-5])), (30, 40))
    east, north = -100.0 + 30.0 * (top[1] + 5), 50.0 + 30.0 * (top[0] + 5)
    height = ground.height_m(east, north)
    assert ground.above_m((east, north, height + 7.0)) == pytest.approx(7.0)
    assert ground.contact_between((east - 200.0, north, height - 1.0), (east + 50.0, north, height - 1.0))
    assert not ground.contact_between((east - 200.0, north, height + 1.0), (east + 50.0, north, height + 1.0))
    wall = Ground(HeightField((0.0, 0.0), (0.25, 0.25), np.tile([0.0, 0.0, 9.0, 0.0, 0.0], (3, 1))))
    assert wall.contact_between((0.0, 0.25, 5.0), (1.0, 0.25, 5.0))  # it is looked at every half metre
