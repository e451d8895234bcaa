"""The runs of a campaign one by one: points of figures and varied numbers, those to look at and why."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from harness.analysis.metric import severity
from harness.analysis.registry import BY_NAME
from harness.campaign.results import RESULTS, RUNS, fly_again
from harness.campaign.table import (
    HOW_BAD,
    NAMED,
    Runs,
    allowed_for,
    column,
    load_tables,
    own_name,
    run_name,
    runs_of,
    varied_keys,
)
from harness.flight.record import FloatArray
from harness.run_files.run_folder import RECORDING, REPORT

if TYPE_CHECKING:
    import pyarrow as pa


MOST_KEYS: Final = 4
"""Numbers that were varied beyond these are not drawn."""
WORST: Final = 10
CLOSEST: Final = 3
"""Runs shown where none failed: those that came closest to an obstacle."""
FIRST: Final = 5
"""Runs that are named of those that were not tracked for the same causes."""


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


STANDING_OUT: Final = {
    BY_NAME[name].path: (BY_NAME[name].title.removesuffix(" max"), BY_NAME[name].unit, BY_NAME[name].factor)
    for name in (
        "total_system_error_max_m",
        "altitude_error_max_m",
        "navigation_error_max_m",
        "navigation_jump_m",
        "bank_saturation_fraction",
        "max_load_factor",
        "plan_delay_max_s",
        "lost_returns_max",
        "flown_heading_change_deg",
        "bank_reversals_per_min",
    )
} | {"length_ratio": ("length over the optimum", "", 1.0)}
"""Figures whose largest value is named with its run, by their column of the results; label, unit and factor for it."""

OF_NAVIGATION: Final = ("navigation_error_m.max", "navigation_jump_m")
"""Those that a run with perfect navigation does not have."""

APART: Final = 1.5
"""A figure so many times as large as that of any run of another case, or as small, is likely to be odd.

Runs of one case share world, seed and draws: what is odd about the case is odd in all of them."""


@dataclass(frozen=True)
class Extreme:
    """The run that stands out most by a figure.

    Attributes:
        figure: what it is of, with its unit.
        unit: the unit alone, empty without one.
        run: its number.
        name: what of its world, planner and aircraft not all runs share.
        value: the figure: the largest of all runs, of clearance the least.
        following: the same of the run of another case that comes next; where there is one case, of the next run, None
            where only one run has the figure.
        median: of all runs that have one.
        apart: whether the figure is far from that of every run of another case, by the factor `APART`, or no other case
            came nearer to an obstacle than was wanted.
    """

    figure: str
    unit: str
    run: int
    name: str
    value: float
    following: float | None
    median: float
    apart: bool = False

    @property
    def quantity(self) -> str:
        """What it is of, without its unit."""
        return self.figure.removesuffix(f", {self.unit}")


def extremes(results: pa.Table, runs: Runs) -> tuple[Extreme, ...]:
    """The run that stands out by each figure by which any does, those that are far from all others first.

    A figure that is the same in all runs is left out.

    Args:
        results: one row a run.
        runs: the same rows.
    """
    wanted_m = np.where((runs.wanted_clearance_m > 0.0) & runs.reached, runs.wanted_clearance_m, np.nan)
    figures = {
        (label, unit): factor * _known(results, name) for name, (label, unit, factor) in STANDING_OUT.items()
    } | {("longest search", "ms"): runs.planner_ms["max"]}
    least = _extreme(
        runs, "clearance over the wanted one, goal reached", "", -runs.min_clearance_m / wanted_m
    )
    if least is not None:
        following = None if least.following is None else -least.following
        least = replace(least, value=-least.value, following=following, median=-least.median)
        least = replace(least, apart=following is not None and least.value < 1.0 <= following)
    found = (least, *(_extreme(runs, *figure, values) for figure, values in figures.items()))
    marked = [replace(each, apart=each.apart or _is_apart(each)) for each in found if each is not None]
    return tuple(sorted(marked, key=lambda each: not each.apart))


def _known(results: pa.Table, name: str) -> FloatArray:
    """A figure of all runs; of navigation errors 0 where navigation is perfect, if any run has some."""
    values = column(results, name)
    return np.nan_to_num(values) if name in OF_NAVIGATION and np.isfinite(values).any() else values


def _is_apart(extreme: Extreme) -> bool:
    if extreme.following is None:
        return False
    less, more = sorted((extreme.value, extreme.following))
    return more > 0.0 and more >= APART * less


def _extreme(runs: Runs, quantity: str, unit: str, values: FloatArray) -> Extreme | None:
    """The run with the largest value; None where none is larger than the median."""
    known = np.flatnonzero(np.isfinite(values))
    if not len(known):
        return None
    order, median = known[np.argsort(-values[known], kind="stable")], float(np.median(values[known]))
    row = int(order[0])
    if values[row] <= median:
        return None
    others = [place for place in order[1:].tolist() if runs.case[place] != runs.case[row]] or order[
        1:
    ].tolist()
    following = float(values[others[0]]) if others else None
    figure, value = f"{quantity}, {unit}" if unit else quantity, float(values[row])
    return Extreme(figure, unit, int(runs.run[row]), own_name(runs, row), value, following, median)


def _numeric(values: tuple[object, ...]) -> bool:
    given = {value for value in values if value is not None}
    return len(given) > 1 and all(
        isinstance(value, int | float) and not isinstance(value, bool) for value in given
    )


@dataclass(frozen=True)
class WorstRun:
    """A run to look at.

    Attributes:
        run: its number.
        name: scenario or world, planner and aircraft.
        seed: of the flight.
        outcome: as in `results.parquet`.
        reason: the same as a sentence.
        min_clearance_m: least distance to an obstacle edge.
        clearance_ratio: the same over the wanted one, where that is known.
        varied: the varied keys with their values.
        folder: its run folder relative to the campaign's, empty where none was kept.
        recording: whether there is a recording in it.
        report: whether there is a report in it.
        make_report: the command that writes one, empty without a run folder.
        view: the command that shows the recording, empty without one.
        command: flies it again.
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
    recording: bool
    report: bool
    make_report: str
    view: str
    command: str


@dataclass(frozen=True)
class Untracked:
    """Runs that were not tracked for the same causes.

    Attributes:
        causes: of all their legs; empty where nothing was flown of a plan.
        allowed_for: these are navigation errors alone, within what was planned for them.
        count: how many runs.
        runs: numbers of the first of them.
        cross_track_max_m: the largest cross-track error of all of them; None where it is not known.
        cross_track_median_m: of the largest of each run of the campaign, the median; likewise.
    """

    causes: str
    allowed_for: bool
    count: int
    runs: tuple[int, ...]
    cross_track_max_m: float | None = None
    cross_track_median_m: float | None = None


def untracked_runs(results: pa.Table, runs: Runs) -> tuple[Untracked, ...]:
    """Runs that were not tracked, by why, the most frequent first, but those allowed for last."""
    rows = results.select([name for name in HOW_BAD if name in results.column_names]).to_pylist()
    alike: dict[tuple[str, bool], list[int]] = {}
    for place in np.flatnonzero(runs.trackable == 0.0).tolist():
        why = rows[place].get("trackability.causes") or ""
        alike.setdefault((why, allowed_for(rows[place])), []).append(place)
    off_m = runs.cross_track_max_m
    return tuple(
        Untracked(
            why,
            allowed,
            len(places),
            tuple(runs.run[places[:FIRST]].tolist()),
            _known_or_none(np.max, off_m[places]),
            _known_or_none(np.median, off_m),
        )
        for (why, allowed), places in sorted(alike.items(), key=lambda each: (each[0][1], -len(each[1])))
    )


def _known_or_none(figure: Callable[[FloatArray], Any], values: FloatArray) -> float | None:
    """A figure of the values that are known; None where none is."""
    known = values[np.isfinite(values)]
    return float(figure(known)) if len(known) else None


def worst_runs(runs: Runs, folder: Path, keys: Sequence[str]) -> tuple[WorstRun, ...]:
    """Failures by severity, then by clearance over the wanted one, or by clearance where that is unknown.

    Where nothing failed, the few that came closest.
    """
    ratio = _clearance_ratio(runs)
    near = ratio if np.isfinite(ratio).any() else runs.min_clearance_m
    outcomes = runs.names["outcome"]
    order = sorted(
        range(len(runs)),
        key=lambda row: (
            -severity(outcomes[row]),
            near[row] if np.isfinite(near[row]) else np.inf,
            runs.run[row],
        ),
    )
    failed = int((~runs.reached).sum())
    shown = order[: min(failed, WORST)] if failed else order[:CLOSEST]
    return tuple(_worst_run(runs, row, folder, keys) for row in shown)


def named_runs(
    runs: Runs,
    folder: Path,
    keys: Sequence[str],
    standing_out: Sequence[Extreme],
    untracked: Sequence[Untracked],
    known: Collection[int],
) -> tuple[WorstRun, ...]:
    """The runs that are named by their number, but for those already known."""
    numbers = {each.run for each in standing_out}.union(*(each.runs for each in untracked)) - {*known}
    rows = [row for row, number in enumerate(runs.run.tolist()) if number in numbers]
    return tuple(_worst_run(runs, row, folder, keys) for row in rows)


def _clearance_ratio(runs: Runs) -> FloatArray:
    """Least clearance over the wanted one; NaN where one of them is not known."""
    ratio: FloatArray = runs.min_clearance_m / np.where(
        runs.wanted_clearance_m > 0.0, runs.wanted_clearance_m, np.nan
    )
    return ratio


def _worst_run(runs: Runs, row: int, folder: Path, keys: Sequence[str]) -> WorstRun:
    number, names, ratio = int(runs.run[row]), runs.names, float(_clearance_ratio(runs)[row])
    kept, clearance = Path(RUNS) / str(number), float(runs.min_clearance_m[row])
    is_kept, recording = (folder / kept).is_dir(), (folder / kept / RECORDING).is_file()
    return WorstRun(
        run=number,
        name=run_name(runs, row),
        seed=int(runs.seed[row]),
        outcome=names["outcome"][row],
        reason=names["reason"][row],
        min_clearance_m=clearance if np.isfinite(clearance) else None,
        clearance_ratio=ratio if np.isfinite(ratio) else None,
        varied={key: runs.varied[key][row] for key in keys if key not in NAMED},
        folder=str(kept) if is_kept else "",
        recording=recording,
        report=(folder / kept / REPORT).is_file(),
        make_report=shlex.join(["wayproof", "report", str(folder / kept)]) if is_kept else "",
        view=shlex.join(["wayproof", "view", str(folder / kept)]) if recording else "",
        command=fly_again(folder / RESULTS, number),
    )
