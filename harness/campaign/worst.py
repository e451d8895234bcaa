"""The runs of a campaign to look at: those that failed, and those that were not tracked and why."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.analysis.metric import severity
from harness.campaign.results import LAW, RESULTS, RUNS, fly_again
from harness.campaign.table import NAMED, Runs, about, allowed_for
from harness.run_files.run_folder import RECORDING, REPORT

WORST: Final = 10
"""At most this many failures are listed."""
CLOSEST: Final = 3
"""Where none failed, this many runs that came closest to an obstacle are listed."""


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
    view: str
    command: str


@dataclass(frozen=True)
class Untracked:
    """Runs that were not tracked for the same causes.

    Attributes:
        causes: of all their legs; empty where nothing was flown of a plan.
        allowed_for: these are navigation errors alone, within what was planned for them.
        count: how many runs.
    """

    causes: str
    allowed_for: bool
    count: int


def untracked_runs(runs: Runs) -> tuple[Untracked, ...]:
    """Runs that were not tracked, by why, the most frequent first, but those allowed for last."""
    alike: dict[tuple[bool, str], int] = {}
    if "trackable" in runs.results.column_names:
        for row in runs.results.to_pylist():
            if row["trackable"] is False:
                why = allowed_for(row), row.get("trackability.causes") or ""
                alike[why] = alike.get(why, 0) + 1
    order = sorted(alike.items(), key=lambda each: (each[0][0], -each[1]))
    return tuple(Untracked(causes, allowed, count) for (allowed, causes), count in order)


def worst_runs(runs: Runs, folder: Path, keys: Sequence[str]) -> tuple[WorstRun, ...]:
    """Failures by severity, then by clearance over the wanted one, or by clearance where that is unknown.

    Where nothing failed, the few that came closest.
    """
    ratio, clearance_m, outcomes = (
        runs.clearance_ratio,
        runs.numbers("min_clearance_m"),
        runs.texts("outcome"),
    )
    near = np.nan_to_num(ratio if np.isfinite(ratio).any() else clearance_m, nan=np.inf)
    order = sorted(range(len(runs)), key=lambda row: (-severity(outcomes[row]), near[row], runs.run[row]))
    failed = int((~runs.reached).sum())
    varied = {key: runs.values(key) for key in keys if key not in NAMED}
    law = (about(runs.results)["campaign"].get("set") or {}).get(LAW, "")
    found = []
    for row in order[: min(failed, WORST) if failed else CLOSEST]:
        number = int(runs.run[row])
        kept = Path(RUNS) / str(number)
        recording = (folder / kept / RECORDING).is_file()
        found.append(
            WorstRun(
                run=number,
                name=runs.name(row),
                seed=int(runs.values("seed")[row]),
                outcome=outcomes[row],
                reason=runs.texts("reason")[row],
                min_clearance_m=_known(clearance_m[row]),
                clearance_ratio=_known(ratio[row]),
                varied={key: values[row] for key, values in varied.items()},
                folder=str(kept) if (folder / kept).is_dir() else "",
                recording=recording,
                report=(folder / kept / REPORT).is_file(),
                view=shlex.join(["wayproof", "view", str(folder / kept)]) if recording else "",
                command=fly_again(folder / RESULTS, number, runs.planner(row), law),
            )
        )
    return tuple(found)


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
