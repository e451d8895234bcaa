"""The runs of a campaign one by one: points of figures and varied numbers, runs that stand out, ways of failures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from harness.campaign.table import Runs, column, load_tables, own_name, runs_of, varied_keys
from harness.files.errors import RunFolderError
from harness.files.input_file import InputError
from harness.flight.record import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

    from harness.campaign.summary import Summary
    from harness.report.figures import FigureScene

MOST_FAILURES: Final = 9
"""Failures beyond these are not drawn."""
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


STANDING_OUT: Final = {
    "cross_track_m.max": ("cross-track error, m", 1.0),
    "altitude_error_m.max": ("altitude error, m", 1.0),
    "navigation_error_m.max": ("navigation error, m", 1.0),
    "navigation_jump_m": ("jump of the believed position, m", 1.0),
    "bank_saturation_fraction": ("time at the bank limit, %", 100.0),
    "max_load_factor": ("load factor", 1.0),
    "plan_delay_s.max": ("plan delay, s", 1.0),
    "lost_returns.max": ("returns lost in the worst scan, %", 100.0),
    "smoothness.flown.heading_change_deg": ("heading change, deg", 1.0),
    "length_ratio": ("length over the optimum", 1.0),
}
"""Figures whose largest value is named with its run, by their column of the results; label, and factor for its unit."""

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
    run: int
    name: str
    value: float
    following: float | None
    median: float
    apart: bool = False


def extremes(results: pa.Table, runs: Runs) -> tuple[Extreme, ...]:
    """The run that stands out by each figure by which any does, those that are far from all others first.

    A figure that is the same in all runs is left out.

    Args:
        results: one row a run.
        runs: the same rows.
    """
    wanted_m = np.where((runs.wanted_clearance_m > 0.0) & runs.reached, runs.wanted_clearance_m, np.nan)
    figures = {label: factor * _known(results, name) for name, (label, factor) in STANDING_OUT.items()} | {
        "longest search, ms": runs.planner_ms["max"]
    }
    least = _extreme(runs, "clearance over the wanted one, goal reached", -runs.min_clearance_m / wanted_m)
    if least is not None:
        following = None if least.following is None else -least.following
        least = replace(least, value=-least.value, following=following, median=-least.median)
        least = replace(least, apart=following is not None and least.value < 1.0 <= following)
    found = (least, *(_extreme(runs, label, values) for label, values in figures.items()))
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


def _extreme(runs: Runs, figure: str, values: FloatArray) -> Extreme | None:
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
    return Extreme(figure, int(runs.run[row]), own_name(runs, row), float(values[row]), following, median)


def _numeric(values: tuple[object, ...]) -> bool:
    given = {value for value in values if value is not None}
    return len(given) > 1 and all(
        isinstance(value, int | float) and not isinstance(value, bool) for value in given
    )


@dataclass(frozen=True, eq=False)
class Failure:
    """A run that did not reach the goal.

    Attributes:
        run: its number.
        outcome: how it ended.
        scene: its world.
        track_m: (n, 2) what was flown, east and north.
    """

    run: int
    outcome: str
    scene: FigureScene
    track_m: FloatArray


def failures(summary: Summary, folder: Path) -> list[Failure]:
    """The worst of the runs that failed, as far as their run folders were kept.

    Args:
        summary: of the campaign.
        folder: of the campaign.
    """
    kept = (each for each in summary.worst if each.outcome != "reached" and each.folder)
    return list(_failures([(each.run, each.outcome, folder / each.folder) for each in kept]))[:MOST_FAILURES]


def _failures(runs: list[tuple[int, str, Path]]) -> Iterator[Failure]:
    from harness.report.figures import FigureScene
    from harness.run_files.run_folder import load_run
    from harness.scenario.performance import mission_of
    from harness.scenario.scenario import parse_scenario
    from harness.scenario.validation import KeyFault
    from harness.world.world import World

    for number, outcome, folder in runs:
        try:
            run = load_run(folder)
            scenario = parse_scenario(run.scenario_yaml, str(folder), as_flown=True)
            mission = mission_of(scenario)
        except (RunFolderError, InputError, KeyFault):
            # It broke off, is of other versions, or of a guidance law that is not here: there is nothing to draw.
            continue
        scene = FigureScene(
            name=scenario.name,
            bounds_m=mission.bounds_m,
            obstacles=World.from_scenario(scenario).obstacles,
            start_m=scenario.mission.start_m,
            goal_m=mission.goal_m,
            goal_radius_m=mission.goal_radius_m,
            clearance_m=mission.clearance_m,
            turn_radius_m=mission.turn_radius_m,
            optimum_m=np.zeros((0, 2)),
        )
        yield Failure(number, outcome, scene, np.column_stack((run.track.east_m, run.track.north_m)))
