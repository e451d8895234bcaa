"""The summary of a campaign: its runs by two varied keys, the worst runs, and which planner did better.

It is written as `summary.html`, a page that needs nothing but itself, as `summary.json`, and as a table for papers.
"""

from __future__ import annotations

import itertools
import json
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.analysis.causes import FINDINGS
from harness.analysis.metric import ERROR, MISSED, how_bad
from harness.campaign.cell import CONFIDENCE, QUESTIONS, Axis, Cell, cell_of, grouped
from harness.campaign.paired import TESTED, Duel, duels
from harness.campaign.results import LAW_KEY, NAMED, RESULTS, RUNS, Runs, certificate_of, fly_again
from harness.files.errors import WriteError
from harness.files.strict_yaml import InputError
from harness.files.whole_file import replace_text
from harness.report.page import Picture, rendered
from harness.run_files.run_folder import RECORDING

PAGE: Final = "summary.html"  # page of the summary, in the campaign's folder
SCHEMA: Final = "wayproof/campaign-summary/6"
DEFAULT_KEYS: Final = 3  # without a choice, tables are made of every two of the first this many varied keys
WORST_OUTCOMES: Final = ("collision", "lost_control", "out_of_bounds")
"""A campaign without one of these says how frequent it may still be; a given path is flown on beyond its bounds."""
WORST: Final = 10  # at most this many failures are listed
CLOSEST: Final = 3  # where none failed, this many runs that came closest to an obstacle are listed


@dataclass(frozen=True)
class Table:
    """The runs by two keys, a cell a row and column; by one key all stand in one column, which has no axis."""

    rows: Axis
    columns: Axis | None
    cells: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class WorstRun:
    """A run to look at; `name`: its scenario or world, planner and aircraft; `command`: empty for a given path."""

    run: int
    name: str
    seed: int
    outcome: str
    reason: str
    min_clearance_m: float | None
    clearance_ratio: float | None  # least clearance over the wanted one, where both are known
    varied: Mapping[str, Any]
    folder: str
    """Its run folder relative to the campaign's, and `view` the command that shows its recording; or empty."""
    view: str
    command: str


@dataclass(frozen=True)
class Summary:
    """The answers of a campaign."""

    name: str
    conditions: str
    varied: tuple[str, ...]
    outcomes: Mapping[str, int]  # number of runs by outcome, the most frequent first
    total: Cell
    tables: tuple[Table, ...]
    worst: tuple[WorstRun, ...]
    """Failures, collisions first; where nothing failed, the runs that came closest to an obstacle."""
    untracked: Mapping[str, int]
    """Number of runs that were not tracked, by the causes of all their legs, the most frequent first."""
    duels: tuple[Duel, ...]
    planned: int | None = None
    """How many runs the campaign has, flown or not; None where the results do not say so."""
    failed: int = 0  # runs that did not reach the goal, or were not flown as given
    is_path: bool = False  # whether a given path was flown

    @property
    def never(self) -> str:
        """Names the worst outcomes that no run had, and how frequent each may still be; empty where all were had.

        The upper bound is that of Clopper and Pearson (1934) for none of n: 1 - (1 - confidence)^(1 / n). A run
        whose software or planner failed does not count: nobody knows how it would have ended.
        """
        runs = self.total.runs - sum(self.outcomes.get(each, 0) for each in (ERROR, "planner_failed"))
        possible = WORST_OUTCOMES[:2] if self.is_path else WORST_OUTCOMES
        none = [name.replace("_", " ") for name in possible if name not in self.outcomes]
        if not runs or not none:
            return ""
        most = f"{100.0 * (1.0 - (1.0 - CONFIDENCE) ** (1.0 / runs)):.3g} %"
        return f"{', '.join(none)}: 0 of {runs}, each less frequent than {most} at {100 * CONFIDENCE:.0f} % confidence"

    @property
    def missing(self) -> int:
        """Number of runs still to be flown, as far as is known."""
        return 0 if self.planned is None else self.planned - self.total.runs


def summarise(folder: Path, by: Sequence[Sequence[str]] | None = None) -> Summary:
    """Summarises the campaign in a folder, with a table for each one or two keys in `by`; or raises InputError."""
    runs = Runs.of(folder)
    for each in by or ():
        if len(each) not in (1, 2) or len(set(each)) < len(each):
            raise InputError(f"wayproof: --by {','.join(each)}: must be one key, or two different ones")
        runs.check_columns(each)
    why = zip(runs.texts("trackability.causes"), runs.values("trackable"), strict=True)
    none = MISSED if (is_path := "given" in runs.texts("planner")) else "no plan"
    untracked = Counter(causes or none for causes, tracked in why if tracked is False)
    columns = {each.name: "length_ratio" if each.name == "ratio" else each.path for each in TESTED}
    figures = {name: runs.numbers(column) for name, column in columns.items()}
    pairs = list(zip(runs.values("case"), runs.texts("aircraft"), strict=True))
    return Summary(
        name=runs.campaign.get("name", folder.resolve().name),
        conditions=runs.conditions,
        varied=tuple(runs.varied),
        outcomes=dict(Counter(runs.texts("outcome")).most_common()),
        total=cell_of(runs, np.ones(len(runs), dtype=bool)),
        tables=tuple(_table(runs, *each) for each in (_default_choice(runs) if by is None else by)),
        worst=_worst(runs, folder),
        untracked=dict(untracked.most_common()),
        duels=duels(runs.texts("planner"), pairs, runs.reached.tolist(), figures),
        planned=runs.planned,
        failed=int(runs.failed.sum()),
        is_path=is_path,
    )


def _default_choice(runs: Runs) -> Sequence[Sequence[str]]:
    """Chooses every two of the first keys, except one by which nearly every run would be a row of its own."""
    varied = runs.varied
    useful = [key for key in varied if key != "scenario" or runs.are_crossed or "world" not in varied]
    useful = [key for key in useful if key not in NAMED[2:] or 2 * len(set(runs.texts(key))) <= len(runs)]
    first = useful[:DEFAULT_KEYS]
    return [first] if len(first) == 1 else list(itertools.combinations(first, 2))


def _table(runs: Runs, *keys: str) -> Table:
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
    """Returns failures by severity, then by clearance over the wanted one or alone; if none failed, the closest few."""
    ratio, outcomes, numbers = runs.clearance_ratio, runs.texts("outcome"), runs.values("run")
    near = np.nan_to_num(ratio if np.isfinite(ratio).any() else runs.numbers("min_clearance_m"), nan=np.inf)
    kinds = [(-how_bad(each), not failed) for each, failed in zip(outcomes, runs.failed, strict=True)]
    order = sorted(range(len(runs)), key=lambda row: (kinds[row], near[row], numbers[row]))
    failed = int(runs.failed.sum())
    return tuple(_worst_run(runs, row, folder) for row in order[: min(failed, WORST) if failed else CLOSEST])


def _worst_run(runs: Runs, row: int, folder: Path) -> WorstRun:
    def cell(name: str) -> Any:
        return runs.values(name)[row]

    inner = Path(RUNS) / str(cell("run"))
    run_folder, planner = folder / inner, str(cell("planner")).partition(", ")[0]
    law = (runs.campaign.get("set") or {}).get(LAW_KEY, "")
    ratio = float(runs.clearance_ratio[row])
    return WorstRun(
        cell("run"),
        runs.name(row),
        cell("seed"),
        runs.texts("outcome")[row],
        runs.texts("check.verdict")[row] or runs.texts("reason")[row],
        cell("min_clearance_m"),
        ratio if np.isfinite(ratio) else None,
        {key: cell(key) for key in runs.varied if key not in NAMED},
        folder=str(inner) if run_folder.is_dir() else "",
        view=shlex.join(["wayproof", "view", str(run_folder)]) if (run_folder / RECORDING).is_file() else "",
        command="" if planner == "given" else fly_again(folder / RESULTS, cell("run"), planner, law),
    )


def write_summary(summary: Summary, folder: Path) -> Path:
    """Writes the answers as a page, whose path it returns, and as JSON, into a campaign's folder; or WriteError."""
    try:
        plain = {"schema": SCHEMA, **asdict(summary)}
        replace_text(folder / "summary.json", json.dumps(plain, indent=2, allow_nan=False) + "\n")
        drawn = _pictures(folder, summary.varied) if summary.total.runs else []
        page = {"summary": summary, "questions": QUESTIONS, "pictures": drawn, "findings": FINDINGS}
        replace_text(folder / PAGE, rendered("campaign.html", certificate=certificate_of(folder), **page))
    except OSError as error:
        again = shlex.join(["wayproof", "report", str(folder)])
        reason = f"cannot write the summary in {folder}: {error.strerror or error}"
        raise WriteError(f"{reason}; the results are whole, and `{again}` makes it from them") from error
    return folder / PAGE


def _pictures(folder: Path, varied: Sequence[str]) -> list[Picture]:
    """Returns the plot of every run against the varied numbers, if there are any."""
    from harness.campaign.figures import scatter
    from harness.report.figure_style import svg

    figure = scatter(Runs.of(folder), varied)
    caption = "A point a run. Crosses: the goal was not reached. Triangles at an edge: beyond it."
    return [] if figure is None else [Picture(svg(figure), "Every run by what was varied", caption)]


def rows_for_paper(summary: Summary) -> tuple[list[str], list[list[str]]]:
    """Returns headings and rows of the table for a paper: the groups of the first table, and all runs."""
    keys, found = [""], []
    for table in summary.tables[:1]:
        keys = [axis.key for axis in (table.rows, table.columns) if axis]
        for label, cells in zip(table.rows.labels, table.cells, strict=True):
            names = [[label, name] for name in table.columns.labels] if table.columns else [[label]]
            found += [[*named, *cell.answers] for named, cell in zip(names, cells, strict=True)]
    found.append(["all runs", *("" for _ in keys[1:]), *summary.total.answers])
    return [*keys, "runs", *(each.short for each in QUESTIONS)], found
