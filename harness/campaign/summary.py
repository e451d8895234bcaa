"""The answers of a campaign: what its runs say by two varied keys, which ran worst, which planner did better."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from harness.campaign.cell import CONFIDENCE, Cell, cell_of
from harness.campaign.groups import Axis, grouped
from harness.campaign.paired import RATIO, TESTED, Duel, duels
from harness.campaign.table import (
    Runs,
    about,
    are_crossed,
    load_tables,
    planned_runs,
    varied_keys,
)
from harness.campaign.worst import Untracked, WorstRun, untracked_runs, worst_runs
from harness.files.strict_yaml import InputError

BY_DEFAULT: Final = 3
"""Without a choice, tables are made of every two of the first this many varied keys."""

WORST_OUTCOMES: Final = ("collision", "lost_control", "out_of_bounds")
"""Outcomes of which a campaign without any says how frequent they may still be."""

CURVE_POINTS: Final = 201
"""Points of a curve of lengths, evenly spaced shares of the goals reached."""


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
        untracked: runs that were not tracked, by why, the most frequent first, but those `allowed_for` last.
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
    untracked: tuple[Untracked, ...]
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
    keys, runs = varied_keys(results), Runs(results, timings)
    for each in by or ():
        if len(each) not in (1, 2) or len(set(each)) < len(each):
            raise InputError(f"wayproof: --by {','.join(each)}: must be one key, or two different ones")
        runs.check_columns(each)
    chosen = [list(each) for each in (by if by is not None else _default_choice(keys, runs))]
    drawn = about(results)["campaign"].get("random", {})
    planners = runs.texts("planner")
    return Summary(
        name=folder.resolve().name,
        varied=tuple(keys),
        outcomes=dict(Counter(runs.texts("outcome")).most_common()),
        total=cell_of(runs, np.ones(len(runs), dtype=bool)),
        tables=tuple(table(runs, each, drawn) for each in chosen),
        curves=tuple(
            table(runs, [key, "planner"], drawn)
            for key in dict.fromkeys(itertools.chain(*chosen))
            if key != "planner"
        ),
        lengths=_lengths(runs, planners),
        worst=worst_runs(runs, folder, keys),
        untracked=untracked_runs(runs),
        duels=duels(
            planners,
            list(zip(runs.values("case"), runs.texts("aircraft"), strict=True)),
            runs.reached.tolist(),
            {each.name: runs.numbers("length_ratio" if each.name == RATIO else each.path) for each in TESTED},
        ),
        planned=planned_runs(results),
    )


def _default_choice(keys: Sequence[str], runs: Runs) -> list[tuple[str, ...]]:
    """Every two of the first keys, but for one by which nearly every run would be a row of its own."""
    crossed = are_crossed(runs.texts("world"), runs.texts("scenario"))
    useful = [key for key in keys if key != "scenario" or crossed or "world" not in keys]
    useful = [
        key
        for key in useful
        if key not in ("world", "scenario") or 2 * len(set(runs.values(key))) <= len(runs)
    ]
    first = useful[:BY_DEFAULT]
    return [tuple(first)] if len(first) == 1 else list(itertools.combinations(first, 2))


def table(runs: Runs, keys: Sequence[str], drawn: Collection[str] = ()) -> Table:
    """The runs by one key or two; of these `drawn` were drawn at random."""
    rows, of_row = grouped(keys[0], runs.values(keys[0]), keys[0] in drawn)
    columns, of_column = None, np.zeros(len(runs), dtype=np.int64)
    if len(keys) == 2:
        columns, of_column = grouped(keys[1], runs.values(keys[1]), keys[1] in drawn)
    return Table(
        rows,
        columns,
        tuple(
            tuple(
                cell_of(runs, (of_row == row) & (of_column == column))
                for column in range(len(columns.labels) if columns else 1)
            )
            for row in range(len(rows.labels))
        ),
    )


def _lengths(runs: Runs, planners: Sequence[str]) -> dict[str, tuple[float, ...]]:
    curves = {}
    for planner in dict.fromkeys(planners):
        own = np.array([name == planner for name in planners])
        ratios = runs.numbers("length_ratio")[own & runs.reached]
        ratios = ratios[np.isfinite(ratios)]
        if len(ratios):
            curves[planner] = tuple(np.quantile(ratios, np.linspace(0.0, 1.0, CURVE_POINTS)).tolist())
    return curves
