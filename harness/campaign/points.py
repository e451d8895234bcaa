"""The runs of a campaign as points: figures of each against the numbers that were varied."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from harness.campaign.table import load_tables, runs_of, varied_keys
from harness.flight.record import FloatArray

MOST_KEYS: Final = 4
"""Numbers that were varied beyond these are not drawn."""


@dataclass(frozen=True, eq=False)
class RunPoints:
    """Figures of all runs, NaN where a run has none.

    Attributes:
        varied: numbers that were varied, by key path, (n,) each.
        figures: what came out, by label, (n,) each.
        reached: (n,) whether the goal was reached.
    """

    varied: Mapping[str, FloatArray]
    figures: Mapping[str, FloatArray]
    reached: NDArray[np.bool_]


def run_points(folder: Path) -> RunPoints:
    """The runs of the campaign in a folder."""
    results, timings = load_tables(folder)
    runs = runs_of(results, timings, varied_keys(results))
    numbers = {
        key: np.array([np.nan if value is None else float(value) for value in values])
        for key, values in runs.varied.items()
        if _numeric(values)
    }
    wanted_m = np.where(runs.wanted_clearance_m > 0.0, runs.wanted_clearance_m, np.nan)
    figures = {
        "clearance / wanted": runs.min_clearance_m / wanted_m,
        "cross-track max, m": runs.cross_track_max_m,
        "length / optimum": runs.length_ratio,
    }
    return RunPoints(
        dict(list(numbers.items())[:MOST_KEYS]),
        {label: values for label, values in figures.items() if np.isfinite(values).any()},
        runs.reached,
    )


def _numeric(values: tuple[object, ...]) -> bool:
    given = {value for value in values if value is not None}
    return len(given) > 1 and all(
        isinstance(value, int | float) and not isinstance(value, bool) for value in given
    )
