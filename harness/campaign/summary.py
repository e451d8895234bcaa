"""The answers of a campaign: what its runs say by two varied keys, which ran worst, which planner did better.

Pure functions of the tables in a campaign's folder. A share has Wilson's 95 % interval (Wilson 1927). A run
whose software failed counts as one that did not reach its goal; so does a goal that the planner proved unreachable.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from harness.campaign.groups import Axis, grouped
from harness.campaign.paired import CONFIDENCE, Duel, duels
from harness.campaign.points import (
    Extreme,
    Untracked,
    WorstRun,
    extremes,
    named_runs,
    untracked_runs,
    worst_runs,
)
from harness.campaign.table import (
    NAMED,
    Runs,
    are_crossed,
    drawn_keys,
    load_tables,
    planned_runs,
    runs_of,
    varied_keys,
)
from harness.files.strict_yaml import InputError
from harness.flight.record import FloatArray

BY_DEFAULT: Final = 3
"""Without a choice, tables are made of every two of so many varied keys, the first ones."""

WORST_OUTCOMES: Final = ("collision", "lost_control", "out_of_bounds")
"""Outcomes of which a campaign without any says how frequent they may still be."""

CURVE_POINTS: Final = 201


@dataclass(frozen=True)
class Cell:
    """What a group of runs comes to. A figure that no run of it has is None.

    Attributes:
        runs: how many.
        reached: how many of them reached their goal.
        success: their share, from 0 to 1.
        success_low: lower end of its interval.
        success_high: upper end.
        length_median: flown length over the clairvoyant optimum where the goal was reached, median.
        length_p95: the same, 95th percentile.
        least_clearance_m: least distance to an obstacle edge in any run.
        below_wanted: share of the runs flown that were below the wanted clearance at any time.
        trackable: share of the runs flown in which every leg was tracked.
        planner_p50_ms: median over the runs of a run's median search time.
        planner_p99_ms: largest 99th percentile of a run; of all searches together it is no larger.
        planner_max_ms: longest search.
    """

    runs: int
    reached: int
    success: float | None = None
    success_low: float | None = None
    success_high: float | None = None
    length_median: float | None = None
    length_p95: float | None = None
    least_clearance_m: float | None = None
    below_wanted: float | None = None
    trackable: float | None = None
    planner_p50_ms: float | None = None
    planner_p99_ms: float | None = None
    planner_max_ms: float | None = None


@dataclass(frozen=True)
class Table:
    """The runs by two keys.

    Attributes:
        rows: the first key.
        columns: the second key; None for all runs in one column.
        cells: one a row and column; empty groups have no runs.
    """

    rows: Axis
    columns: Axis | None
    cells: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class Summary:
    """The answers.

    Attributes:
        name: the folder's.
        varied: keys that were varied.
        outcomes: number of runs by outcome, the most frequent first.
        total: all runs.
        tables: one for each choice of keys.
        curves: one for each key that a table has, by planner.
        lengths: of each planner, flown length over the optimum at evenly spaced shares of the goals reached.
        worst: failures, collisions first; where nothing failed, the runs that came closest to an obstacle.
        extremes: the run that stands out by each of some figures.
        untracked: runs that were not tracked, by why, the most frequent first, but those `allowed_for` last.
        named: the runs that `extremes` and `untracked` name and `worst` does not have, by number.
        duels: planners on the same cases.
        planned: how many runs the campaign has, flown or not; None where the results do not say so.
    """

    name: str
    varied: tuple[str, ...]
    outcomes: Mapping[str, int]
    total: Cell
    tables: tuple[Table, ...]
    curves: tuple[Table, ...]
    lengths: Mapping[str, tuple[float, ...]]
    worst: tuple[WorstRun, ...]
    extremes: tuple[Extreme, ...]
    untracked: tuple[Untracked, ...]
    named: tuple[WorstRun, ...]
    duels: tuple[Duel, ...]
    planned: int | None = None

    @property
    def never(self) -> str:
        """Which of the worst outcomes no run had, and how frequent each may still be; empty where each was had.

        The upper bound is that of Clopper and Pearson (1934) for none of n: 1 - (1 - confidence)^(1 / n).
        """
        runs = self.total.runs
        none = [name.replace("_", " ") for name in WORST_OUTCOMES if name not in self.outcomes]
        if not runs or not none:
            return ""
        most = f"{100.0 * (1.0 - (1.0 - CONFIDENCE) ** (1.0 / runs)):.3g} %"
        return f"{', '.join(none)}: 0 of {runs}, each less frequent than {most} at {100 * CONFIDENCE:.0f} % confidence"

    @property
    def missing(self) -> int:
        """How many runs are still to be flown, as far as is known."""
        return 0 if self.planned is None else self.planned - self.total.runs


def summarise(folder: Path, by: Sequence[Sequence[str]] | None = None) -> Summary:
    """The answers of the campaign in a folder.

    Args:
        folder: with `results.parquet` and `timings.parquet`.
        by: one or two keys for each table; default: every two of the first varied keys.

    Raises:
        InputError: the folder holds no campaign, or a key is no column of it.
    """
    results, timings = load_tables(folder)
    keys = varied_keys(results)
    for each in by or ():
        if len(each) not in (1, 2) or len(set(each)) < len(each):
            raise InputError(f"wayproof: --by {','.join(each)}: must be one key, or two different ones")
    runs = runs_of(results, timings, list(dict.fromkeys([*keys, *itertools.chain(*(by or ())), *NAMED])))
    chosen = [list(each) for each in (by if by is not None else _default_choice(keys, runs))]
    singles = dict.fromkeys(itertools.chain(*chosen))
    drawn = drawn_keys(results)
    worst, standing_out, untracked = (
        worst_runs(runs, folder, keys),
        extremes(results, runs),
        untracked_runs(results, runs),
    )
    return Summary(
        name=folder.resolve().name,
        varied=tuple(keys),
        outcomes=dict(Counter(runs.names["outcome"]).most_common()),
        total=cell(runs, np.ones(len(runs), dtype=bool)),
        tables=tuple(table(runs, each, drawn) for each in chosen),
        curves=tuple(table(runs, [key, "planner"], drawn) for key in singles if key != "planner"),
        lengths=_lengths(runs),
        worst=worst,
        extremes=standing_out,
        untracked=untracked,
        named=named_runs(runs, folder, keys, standing_out, untracked, {each.run for each in worst}),
        duels=duels(runs),
        planned=planned_runs(results),
    )


def _default_choice(keys: Sequence[str], runs: Runs) -> list[tuple[str, ...]]:
    """Every two of the first keys, but for one by which nearly every run would be a row of its own."""
    crossed = are_crossed(runs.names["world"], runs.names["scenario"])
    useful = [key for key in keys if key != "scenario" or crossed or "world" not in keys]
    useful = [
        key
        for key in useful
        if key not in ("world", "scenario") or 2 * len(set(runs.varied[key])) <= len(runs)
    ]
    first = useful[:BY_DEFAULT]
    return [tuple(first)] if len(first) == 1 else list(itertools.combinations(first, 2))


def table(runs: Runs, keys: Sequence[str], drawn: Collection[str] = ()) -> Table:
    """The runs by one key or two; of these `drawn` were drawn at random."""
    rows, of_row = grouped(keys[0], runs.varied[keys[0]], keys[0] in drawn)
    if len(keys) == 1:
        cells = tuple((cell(runs, of_row == place),) for place in range(len(rows.labels)))
        return Table(rows, None, cells)
    columns, of_column = grouped(keys[1], runs.varied[keys[1]], keys[1] in drawn)
    return Table(
        rows,
        columns,
        tuple(
            tuple(
                cell(runs, (of_row == row) & (of_column == column)) for column in range(len(columns.labels))
            )
            for row in range(len(rows.labels))
        ),
    )


def cell(runs: Runs, among: NDArray[np.bool_]) -> Cell:
    """What the runs among some come to."""
    count, reached = int(among.sum()), int((runs.reached & among).sum())
    if not count:
        return Cell(0, 0)
    low, high = wilson(reached, count)
    ratios = _finite(runs.length_ratio[among & runs.reached])
    clear, tracked = _finite(runs.min_clearance_m[among]), _finite(runs.trackable[among])
    below = _finite(runs.clearance_violation_s[among]) > 0.0
    p50, p99, most = (_finite(runs.planner_ms[name][among]) for name in ("p50", "p99", "max"))
    return Cell(
        count,
        reached,
        success=reached / count,
        success_low=low,
        success_high=high,
        length_median=float(np.median(ratios)) if len(ratios) else None,
        length_p95=float(np.percentile(ratios, 95)) if len(ratios) else None,
        least_clearance_m=float(clear.min()) if len(clear) else None,
        below_wanted=float(below.mean()) if len(below) else None,
        trackable=float(tracked.mean()) if len(tracked) else None,
        planner_p50_ms=float(np.median(p50)) if len(p50) else None,
        planner_p99_ms=float(p99.max()) if len(p99) else None,
        planner_max_ms=float(most.max()) if len(most) else None,
    )


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share, `trials` at least 1."""
    from scipy import stats

    interval = stats.binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return float(interval.low), float(interval.high)


def _finite(values: FloatArray) -> FloatArray:
    return values[np.isfinite(values)]


def _lengths(runs: Runs) -> dict[str, tuple[float, ...]]:
    curves = {}
    for planner in dict.fromkeys(runs.names["planner"]):
        own = np.array([name == planner for name in runs.names["planner"]])
        ratios = _finite(runs.length_ratio[own & runs.reached])
        if len(ratios):
            curves[planner] = tuple(np.quantile(ratios, np.linspace(0.0, 1.0, CURVE_POINTS)).tolist())
    return curves
