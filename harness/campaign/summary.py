"""The answers of a campaign: what its runs say by two varied keys, which ran worst, which planner did better."""

from __future__ import annotations

import itertools
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.analysis.metric import severity
from harness.campaign.cell import CONFIDENCE, Cell, cell_of
from harness.campaign.groups import Axis, grouped
from harness.campaign.paired import RATIO, TESTED, Duel, duels
from harness.campaign.results import LAW, RESULTS, RUNS, fly_again
from harness.campaign.table import NAMED, Runs
from harness.files.strict_yaml import InputError
from harness.run_files.run_folder import RECORDING

BY_DEFAULT: Final = 3
"""Without a choice, tables are made of every two of the first this many varied keys."""
WORST_OUTCOMES: Final = ("collision", "lost_control", "out_of_bounds")
"""Outcomes of which a campaign without any says how frequent they may still be."""
WORST: Final = 10
"""At most this many failures are listed."""
CLOSEST: Final = 3
"""Where none failed, this many runs that came closest to an obstacle are listed."""


@dataclass(frozen=True)
class Table:
    """The runs by two keys.

    Attributes:
        columns: the second key; None for all runs in one column.
        cells: one a row and column; empty groups have no runs.
    """

    rows: Axis
    columns: Axis | None
    cells: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class WorstRun:
    """A run to look at.

    Attributes:
        name: scenario or world, planner and aircraft.
        clearance_ratio: the same over the wanted one, where that is known.
        folder: its run folder relative to the campaign's, empty where none was kept.
        view: the command that shows the recording, empty without one.
    """

    run: int
    name: str
    seed: int
    outcome: str
    reason: str
    min_clearance_m: float | None
    clearance_ratio: float | None
    varied: Mapping[str, Any]
    folder: str
    view: str
    command: str


@dataclass(frozen=True)
class Summary:
    """The answers.

    Attributes:
        outcomes: number of runs by outcome, the most frequent first.
        worst: failures, collisions first; where nothing failed, the runs that came closest to an obstacle.
        untracked: number of runs that were not tracked, by the causes of all their legs, the most frequent first.
        planned: how many runs the campaign has, flown or not; None where the results do not say so.
    """

    name: str
    varied: tuple[str, ...]
    outcomes: Mapping[str, int]
    total: Cell
    tables: tuple[Table, ...]
    worst: tuple[WorstRun, ...]
    untracked: Mapping[str, int]
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

    `by`: one or two keys for each table; default: every two of the first varied keys.

    Raises:
        InputError: the folder holds no campaign, or a key is no column of it.
    """
    runs = Runs.of(folder)
    for each in by or ():
        if len(each) not in (1, 2) or len(set(each)) < len(each):
            raise InputError(f"wayproof: --by {','.join(each)}: must be one key, or two different ones")
        runs.check_columns(each)
    chosen = by if by is not None else _default_choice(runs)
    return Summary(
        name=folder.resolve().name,
        varied=tuple(runs.varied),
        outcomes=dict(Counter(runs.texts("outcome")).most_common()),
        total=cell_of(runs, np.ones(len(runs), dtype=bool)),
        tables=tuple(_table(runs, *each) for each in chosen),
        worst=_worst(runs, folder),
        untracked=dict(
            Counter(
                causes or "no plan"
                for causes, tracked in zip(
                    runs.texts("trackability.causes"), runs.values("trackable"), strict=True
                )
                if tracked is False
            ).most_common()
        ),
        duels=duels(
            runs.texts("planner"),
            list(zip(runs.values("case"), runs.texts("aircraft"), strict=True)),
            runs.reached.tolist(),
            {each.name: runs.numbers("length_ratio" if each.name == RATIO else each.path) for each in TESTED},
        ),
        planned=runs.planned,
    )


def _default_choice(runs: Runs) -> Sequence[Sequence[str]]:
    """Every two of the first keys, but for one by which nearly every run would be a row of its own."""
    varied = runs.varied
    useful = [key for key in varied if key != "scenario" or runs.are_crossed or "world" not in varied]
    useful = [key for key in useful if key not in NAMED[2:] or 2 * len(set(runs.texts(key))) <= len(runs)]
    first = useful[:BY_DEFAULT]
    return [first] if len(first) == 1 else list(itertools.combinations(first, 2))


def _table(runs: Runs, *keys: str) -> Table:
    """The runs by one key or two."""
    drawn = runs.campaign.get("random", ())
    (rows, row_of), *others = (grouped(key, runs.values(key), key in drawn) for key in keys)
    columns, column_of = others[0] if others else (None, np.zeros(len(runs), dtype=np.int64))
    places = range(len(columns.labels) if columns else 1)
    cells = (
        tuple(cell_of(runs, (row_of == row) & (column_of == column)) for column in places)
        for row in range(len(rows.labels))
    )
    return Table(rows, columns, tuple(cells))


def _worst(runs: Runs, folder: Path) -> tuple[WorstRun, ...]:
    """Failures by severity, then by clearance over the wanted one, or by clearance where that is unknown.

    Where nothing failed, the few that came closest.
    """
    ratio, clearance_m, outcomes = (
        runs.clearance_ratio,
        runs.numbers("min_clearance_m"),
        runs.texts("outcome"),
    )
    near = np.nan_to_num(ratio if np.isfinite(ratio).any() else clearance_m, nan=np.inf)
    numbers = runs.values("run")
    order = sorted(range(len(runs)), key=lambda row: (-severity(outcomes[row]), near[row], numbers[row]))
    failed = int((~runs.reached).sum())
    varied = {key: runs.values(key) for key in runs.varied if key not in NAMED}
    law = (runs.campaign.get("set") or {}).get(LAW, "")
    found = []
    for row in order[: min(failed, WORST) if failed else CLOSEST]:
        number, inner = int(numbers[row]), Path(RUNS) / str(numbers[row])
        kept = folder / inner
        found.append(
            WorstRun(
                number,
                runs.name(row),
                int(runs.values("seed")[row]),
                outcomes[row],
                runs.texts("reason")[row],
                float(clearance_m[row]) if np.isfinite(clearance_m[row]) else None,
                float(ratio[row]) if np.isfinite(ratio[row]) else None,
                {key: values[row] for key, values in varied.items()},
                folder=str(inner) if kept.is_dir() else "",
                view=shlex.join(["wayproof", "view", str(kept)]) if (kept / RECORDING).is_file() else "",
                command=fly_again(
                    folder / RESULTS, number, runs.texts("planner")[row].partition(", ")[0], law
                ),
            )
        )
    return tuple(found)
