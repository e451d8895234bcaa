"""Columns equal those that pyarrow makes of the same values, and do not bring pandas in."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest

from harness.run_files.columns import lists, numbers, texts, truths


@pytest.mark.parametrize("count", [0, 1, 8, 19])
def test_columns_hold_the_values(count: int) -> None:
    rng = np.random.default_rng(count)
    floats, whole, yes = rng.normal(size=2 * count)[::2], np.arange(count), rng.random(count) < 0.5
    words = ["", "plan", "café ✓"] * count
    assert numbers(floats).equals(pa.array(floats))
    assert numbers(whole, np.int64).equals(pa.array(whole))
    assert truths(yes).equals(pa.array(yes))
    assert texts(words).equals(pa.array(words, pa.string()))
    rows = [rng.normal(size=(each, 2)) for each in range(count)]
    assert lists(rows, 2).to_pylist() == [each.tolist() for each in rows]


def test_columns_bring_no_pandas_in() -> None:
    code = """if True:
        import sys
        import numpy as np
        import pyarrow as pa
        from harness.run_files.columns import lists, numbers, texts, truths
        columns = numbers([1.0]), texts(["a"]), truths([True]), lists([np.zeros((1, 2))], 2)
        pa.table(dict(zip("abcd", columns)))
        sys.exit("pandas" in sys.modules)
    """
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
