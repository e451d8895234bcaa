"""The band in which 95 % of days fly, against tracks whose offsets are known."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from harness.analysis.band import BAND_FILE, band_of, write_band


def test_the_edges_are_the_percentiles_of_the_offsets_at_each_place() -> None:
    """Days fly north, each on a line of its own; the median flies at east 0, so that left is west."""
    offsets_m = np.random.default_rng(1).normal(0.0, 3.0, 41)
    offsets_m -= np.median(offsets_m)
    along_m = np.linspace(0.0, 1000.0, 51)
    left, right = band_of([np.column_stack((along_m, np.full(51, off), along_m)) for off in offsets_m])
    assert left[:, 0] == pytest.approx(np.percentile(offsets_m, 2.5))
    assert right[:, 0] == pytest.approx(np.percentile(offsets_m, 97.5))
    assert left[:, 1] == pytest.approx(np.linspace(0.0, 1000.0, len(left)))
    assert ((left[0, 0] <= offsets_m) & (offsets_m <= right[0, 0])).mean() == pytest.approx(0.95, abs=0.03)


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
