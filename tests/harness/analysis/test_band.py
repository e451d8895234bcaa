"""The band in which 95 % of days fly, against tracks whose offsets are known."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from harness.analysis.band import BAND_FILE, band_of, write_band


@pytest.mark.parametrize("course", [1j, np.exp(0.7j), -1.0])
def test_the_edges_are_the_percentiles_of_the_offsets_at_each_place(course: complex) -> None:
    """Days fly one course (east + i north) from (300, -200) m, each on a line of its own, as far to its right."""
    offsets_m = np.random.default_rng(1).normal(0.0, 3.0, 41)
    offsets_m -= np.median(offsets_m)
    along_m = np.linspace(0.0, 1000.0, 51)
    ways = [300.0 - 200.0j + course * (along_m - 1j * off) for off in offsets_m]
    edges = band_of([np.column_stack((along_m, way.real, way.imag)) for way in ways])
    for edge, percentile in zip(edges, (2.5, 97.5), strict=True):
        places = ((edge @ (1.0, 1j)) - (300.0 - 200.0j)) / course
        assert places.imag == pytest.approx(-np.percentile(offsets_m, percentile))
        assert places.real == pytest.approx(np.linspace(0.0, 1000.0, 200))  # 5 m apart, both ends among them


def test_days_that_ended_early_do_not_count_beyond_their_end() -> None:
    along_m = np.linspace(0.0, 1000.0, 101)
    days = [np.column_stack((along_m, np.full(101, off), along_m)) for off in (-1.0, 0.0, 1.0)]
    unknown = np.full((3, 3), np.nan)  # before the first plan
    short = np.vstack((unknown, np.column_stack((along_m, np.full(101, 40.0), along_m))[:50]))
    _, right = band_of([*days, short])
    assert right[right[:, 1] < 480.0, 0].min() > 20.0
    assert right[right[:, 1] > 510.0, 0].max() <= 1.0


def test_days_without_a_plan_have_no_band(tmp_path: Path) -> None:
    columns = {"arc_length_m": [np.nan], "east_m": [0.0], "north_m": [0.0]}
    pq.write_table(pa.table(columns), tmp_path / "track.parquet")
    write_band(tmp_path, [tmp_path])
    assert not (tmp_path / BAND_FILE).exists()
