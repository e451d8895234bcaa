"""Outlines of cells: those of an independent union of squares, however ragged, and bounded in time."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from harness.world_files import cells
from harness.world_files.cells import outlines


def union(mask: np.ndarray[tuple[int, int], np.dtype[np.bool_]]) -> shapely.MultiPolygon:
    squares = [shapely.box(x, y, x + 1, y + 1) for y, x in np.argwhere(mask).tolist()]
    return shapely.MultiPolygon(
        [each for each in shapely.get_parts(shapely.union_all(squares)) if each.area > 0]
    )


@given(
    rows=st.integers(1, 9),
    columns=st.integers(1, 9),
    share=st.floats(0.0, 1.0),
    seed=st.integers(0, 2**32 - 1),
)
def test_outlines_are_the_union_of_the_cells(rows: int, columns: int, share: float, seed: int) -> None:
    mask = np.random.default_rng(seed).random((rows, columns)) < share
    found, factor = outlines(mask)
    whole, wanted = shapely.MultiPolygon(found), union(mask)
    assert factor == 1
    assert whole.is_valid
    assert len(found) == len(wanted.geoms)
    assert whole.equals(wanted)
    # No corner more than it takes.
    assert shapely.get_num_coordinates(whole) <= shapely.get_num_coordinates(wanted)


def test_a_ragged_mask_is_made_coarser_and_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cells, "MAX_RUNS", 15)
    mask = np.random.default_rng(4).random((37, 53)) < 0.02
    found, factor = outlines(mask)
    assert factor > 1
    whole = shapely.MultiPolygon(found)
    assert whole.is_valid
    assert shapely.covers(whole, union(mask))
    assert np.array_equal(
        shapely.get_coordinates(whole) % factor, np.zeros_like(shapely.get_coordinates(whole))
    )
