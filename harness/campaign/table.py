"""The runs of a campaign as its folder holds them: the tables read back, one column a question."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from harness.analysis.causes import is_allowed_for
from harness.campaign.results import RESULTS, RUNS, TIMINGS
from harness.files.strict_yaml import InputError
from harness.flight.record import FloatArray
from harness.run_files.run_folder import RECORDING

if TYPE_CHECKING:
    import pyarrow as pa

NAMED: Final = ("planner", "aircraft", "world", "scenario")
"""Columns of names: varied keys where they have more than one value."""

IntArray: TypeAlias = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Runs:
    """The runs of a campaign, (n,) each. A figure that does not exist is NaN.

    Attributes:
        run: number of each run.
        case: runs of one number flew the same drawn world with the same seed.
        seed: root seed of each flight.
        names: `scenario`, `world`, `planner`, `aircraft`, `outcome` and `reason` of each run.
        varied: values of each varied key, by key path; None where a run has none.
        flown_length_m: length of the flown track.
        length_ratio: the same over the clairvoyant optimum.
        cross_track_max_m: largest cross-track error.
        min_clearance_m: least distance to an obstacle edge.
        wanted_clearance_m: what the planner was to keep.
        clearance_violation_s: time below that.
        trackable: 1 where every leg was tracked, else 0.
        planner_ms: by `p50`, `p99` and `max`, the figures of each run's searches.
    """

    run: IntArray
    case: IntArray
    seed: IntArray
    names: Mapping[str, tuple[str, ...]]
    varied: Mapping[str, tuple[Any, ...]]
    flown_length_m: FloatArray
    length_ratio: FloatArray
    cross_track_max_m: FloatArray
    min_clearance_m: FloatArray
    wanted_clearance_m: FloatArray
    clearance_violation_s: FloatArray
    trackable: FloatArray
    planner_ms: Mapping[str, FloatArray]

    def __len__(self) -> int:
        """Number of runs."""
        return len(self.run)

    @cached_property
    def reached(self) -> NDArray[np.bool_]:
        """Whether each run reached its goal."""
        return np.array([outcome == "reached" for outcome in self.names["outcome"]], dtype=bool)


def load_tables(folder: Path) -> tuple[pa.Table, pa.Table | None]:
    """Reads results and, where there are any, timings of a campaign.

    A planner or an aircraft that is named more than once is told apart by the keys that each entry gives.

    Raises:
        InputError: the folder holds no campaign, or a file of it cannot be read.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = folder / RESULTS
    if not path.is_file():
        raise InputError(f"wayproof: {folder} has no {RESULTS}: it is not the folder of a campaign")
    try:
        timings = folder / TIMINGS
        results = pq.read_table(path)
        for name, entries, first in (("planner", "planners", "kind"), ("aircraft", "aircraft", "model")):
            results = _told_apart(results, name, _campaign(results).get(entries, ()), first)
        return results, pq.read_table(timings) if timings.is_file() else None
    except (OSError, pa.ArrowException, AttributeError, RecursionError, TypeError, ValueError) as error:
        text = str(error).splitlines()[0]
        raise InputError(f"wayproof: the campaign in {folder} is damaged: {text}") from error


def planned_runs(results: pa.Table) -> int | None:
    """How many runs the campaign has, flown or not; None where the table does not say so."""
    runs = _about(results).get("runs")
    return runs if isinstance(runs, int) else None


def _about(results: pa.Table) -> Mapping[str, Any]:
    """What the table says of its campaign, as `harness.campaign.results.campaign_of` has it; empty if nothing."""
    about: Mapping[str, Any] = json.loads((results.schema.metadata or {}).get(b"wayproof", b"{}"))
    return about


def drawn_keys(results: pa.Table) -> frozenset[str]:
    """The varied keys that were drawn at random."""
    drawn = _campaign(results).get("random", {})
    return frozenset(drawn) if isinstance(drawn, Mapping) else frozenset()


def _campaign(results: pa.Table) -> Mapping[str, Any]:
    campaign: Mapping[str, Any] = _about(results).get("campaign", {})
    return campaign


def _told_apart(results: pa.Table, name: str, entries: Sequence[Any], first: str) -> pa.Table:
    """The table with entries of one planner, or aircraft, told apart by the keys that they give."""
    import pyarrow as pa

    given = [entry if isinstance(entry, Mapping) else {first: entry} for entry in entries]
    named = [each.get(first) for each in given]
    keys = [f"{name}.{key}" for key in dict.fromkeys(itertools.chain(*given)) if key != first]
    keys = [key for key in keys if key in results.column_names]
    texts = []
    for row in results.select([name, *keys]).to_pylist() if name in results.column_names else ():
        text = row[name]
        if named.count(text) > 1:
            told = (f"{key.partition('.')[2]} {row[key]}" for key in keys if row[key] is not None)
            text = ", ".join((text, *told))
        texts.append(text)
    if not texts:
        return results
    return results.set_column(results.column_names.index(name), name, pa.array(texts, pa.string()))


def varied_keys(results: pa.Table) -> list[str]:
    """Columns that say what was varied: names with more than one value, and the key paths before `outcome`."""
    before = itertools.takewhile(lambda name: name != "outcome", results.column_names)
    names = [name for name in NAMED if name in results.column_names and len(results[name].unique()) > 1]
    return names + [name for name in before if name not in (*NAMED, "run", "case", "seed")]


def runs_of(results: pa.Table, timings: pa.Table | None, keys: Sequence[str]) -> Runs:
    """The columns that the answers need.

    Args:
        results: one row a run.
        timings: the planner's times, by `run`; None where there are none.
        keys: names of the columns that count as varied.

    Raises:
        InputError: a column of `keys`, or one that every campaign has, is missing.
    """
    for name in (*keys, "run", "case", "seed", "outcome", *NAMED):
        if name not in results.column_names:
            known = ", ".join(varied_keys(results)) or "none"
            raise InputError(f"wayproof: {RESULTS} has no column {name!r}; varied there: {known}")
    rows = {int(run): row for row, run in enumerate(column(timings, "run"))} if timings is not None else {}
    own = [rows.get(int(run), -1) for run in results["run"].to_pylist()]
    return Runs(
        run=_integers(results, "run"),
        case=_integers(results, "case"),
        seed=_integers(results, "seed"),
        names={name: _texts(results, name) for name in (*NAMED, "outcome", "reason")},
        varied={key: _values(results, key) for key in keys},
        flown_length_m=column(results, "flown_length_m"),
        length_ratio=column(results, "length_ratio"),
        cross_track_max_m=column(results, "cross_track_m.max"),
        min_clearance_m=column(results, "min_clearance_m"),
        wanted_clearance_m=column(results, "wanted_clearance_m"),
        clearance_violation_s=column(results, "clearance_violation_s"),
        trackable=column(results, "trackable"),
        planner_ms={
            name: np.append(column(timings, f"compute_ms.{name}"), np.nan)[own]
            for name in ("p50", "p99", "max")
        },
    )


def are_crossed(worlds: Sequence[str], scenarios: Sequence[str]) -> bool:
    """Whether one world was flown with several scenarios: else it stands for its scenario."""
    return len(set(zip(worlds, scenarios, strict=True))) > len(set(worlds))


def run_name(runs: Runs, row: int) -> str:
    """World, planner and aircraft of a run."""
    return ", ".join(filter(None, (*_place(runs, row), *(runs.names[name][row] for name in NAMED[:2]))))


def own_name(runs: Runs, row: int) -> str:
    """What of a run's world, planner and aircraft not all runs share; may be empty."""
    several = {name for name in NAMED if len(set(runs.names[name])) > 1}
    place = _place(runs, row) if several & {*NAMED[2:]} else ()
    return ", ".join(
        filter(None, (*place, *(runs.names[name][row] for name in NAMED[:2] if name in several)))
    )


def _place(runs: Runs, row: int) -> tuple[str, ...]:
    names = runs.names
    world, scenario = names["world"][row], names["scenario"][row]
    crossed = world and are_crossed(names["world"], names["scenario"])
    return (scenario, world) if crossed else (world or scenario,)


def column(table: pa.Table | None, name: str) -> FloatArray:
    """A column of numbers, NaN where there is none."""
    if table is None:
        return np.zeros(0)
    if name not in table.column_names:
        return np.full(len(table), np.nan)
    values = [np.nan if value is None else value for value in table[name].to_pylist()]
    return np.array(values, dtype=np.float64)


def _values(table: pa.Table, name: str) -> tuple[Any, ...]:
    """A column of any kind, None where there is nothing."""
    return tuple(None if value != value else value for value in table[name].to_pylist())


def _integers(table: pa.Table, name: str) -> IntArray:
    return np.array(table[name].to_pylist(), dtype=np.int64)


def _texts(table: pa.Table, name: str) -> tuple[str, ...]:
    if name not in table.column_names:
        return ("",) * len(table)
    return tuple("" if value is None else str(value) for value in table[name].to_pylist())


def recordings_of(folder: Path) -> list[Path]:
    """The recordings that a campaign's folder keeps, by the number of the run."""
    kept = [path for path in (folder / RUNS).glob(f"*/{RECORDING}") if path.parent.name.isdecimal()]
    return sorted(kept, key=lambda path: int(path.parent.name))


HOW_BAD: Final = (
    "run",
    "outcome",
    "trackable",
    "min_clearance_m",
    "wanted_clearance_m",
    "trackability.causes",
    "navigation_error_m.max",
    "navigation_margin_m",
)
"""Columns of the results that say how badly a run went."""


def allowed_for(row: Mapping[str, Any]) -> bool:
    """Whether a row of the results was not tracked for nothing but navigation errors that were planned for."""
    causes = (row.get("trackability.causes") or "").split("; ")
    return is_allowed_for(causes, row.get("navigation_error_m.max"), row.get("navigation_margin_m"))
