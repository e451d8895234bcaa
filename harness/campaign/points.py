"""The runs of a campaign as what is drawn of them: points of figures and varied numbers, and the ways of failures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from harness.campaign.table import load_tables, runs_of, varied_keys
from harness.files.errors import RunFolderError
from harness.files.input_file import InputError
from harness.flight.record import FloatArray

if TYPE_CHECKING:
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
    from harness.world.world import World

    for number, outcome, folder in runs:
        try:
            run = load_run(folder)
            scenario = parse_scenario(run.scenario_yaml, str(folder), ends_checked=False)
        except (
            RunFolderError,
            InputError,
        ):  # it broke off, or is of other versions: there is nothing to draw
            continue
        mission = mission_of(scenario)
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
