"""The runs of a campaign as its folder holds them: the tables read back, a column a figure."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from harness.analysis.causes import is_allowed_for
from harness.campaign.results import RESULTS, RUNS, TIMINGS, read_table
from harness.files.strict_yaml import InputError
from harness.flight.record import FloatArray
from harness.run_files.run_folder import RECORDING

if TYPE_CHECKING:
    import pyarrow as pa

NAMED: Final = ("planner", "aircraft", "world", "scenario")
"""Columns of names: varied keys where they have more than one value."""

NEEDED: Final = ("run", "case", "seed", "outcome", *NAMED)
"""Columns that every campaign has."""

IntArray: TypeAlias = NDArray[np.int64]


class Runs:
    """The runs of a campaign, in the order of its table.

    Args:
        results: one row a run.
        timings: the planner's times by `run`; None where there are none.

    Raises:
        InputError: a column that every campaign has is missing.
    """

    def __init__(self, results: pa.Table, timings: pa.Table | None = None) -> None:
        self.results, self._timings = results, timings
        self.check_columns(NEEDED)

    def __len__(self) -> int:
        """Number of runs."""
        return int(self.results.num_rows)

    def check_columns(self, names: Sequence[str]) -> None:
        """Raises InputError where there is no such column."""
        for name in names:
            if name not in self.results.column_names:
                known = ", ".join(varied_keys(self.results)) or "none"
                raise InputError(f"wayproof: {RESULTS} has no column {name!r}; varied there: {known}")

    @cache  # noqa: B019 - as long as the table is there
    def values(self, name: str) -> tuple[Any, ...]:
        """A column of any kind, None where there is nothing."""
        return tuple(None if value != value else value for value in self.results[name].to_pylist())

    @cache  # noqa: B019
    def texts(self, name: str) -> tuple[str, ...]:
        """A column of text, empty where there is nothing."""
        if name not in self.results.column_names:
            return ("",) * len(self)
        return tuple("" if value is None else str(value) for value in self.values(name))

    @cache  # noqa: B019
    def numbers(self, name: str) -> FloatArray:
        """A figure of every run, (n,): a column of the results or of the timings, NaN where there is none."""
        found: Sequence[Any] = ()
        if name in self.results.column_names:
            found = self.values(name)
        elif self._timings is not None and name in self._timings.column_names:
            times = zip(self._timings["run"].to_pylist(), self._timings[name].to_pylist(), strict=True)
            found = [*map(dict(times).get, self.values("run"))]
        values = [np.nan if value is None else value for value in found or (None,) * len(self)]
        return np.array(values, dtype=np.float64)

    @cached_property
    def run(self) -> IntArray:
        """Number of each run."""
        return np.array(self.values("run"), dtype=np.int64)

    @cached_property
    def reached(self) -> NDArray[np.bool_]:
        """Whether each run reached its goal."""
        return np.array([outcome == "reached" for outcome in self.texts("outcome")], dtype=bool)

    @cached_property
    def clearance_ratio(self) -> FloatArray:
        """Least clearance over the wanted one; NaN where one of them is not known."""
        wanted_m = self.numbers("wanted_clearance_m")
        ratio: FloatArray = self.numbers("min_clearance_m") / np.where(wanted_m > 0.0, wanted_m, np.nan)
        return ratio

    def planner(self, row: int) -> str:
        """The planner of a run, without the keys that tell its entries apart."""
        return self.texts("planner")[row].partition(", ")[0]

    def name(self, row: int) -> str:
        """World, planner and aircraft of a run."""
        world, scenario = self.texts("world")[row], self.texts("scenario")[row]
        crossed = world and are_crossed(self.texts("world"), self.texts("scenario"))
        place = (scenario, world) if crossed else (world or scenario,)
        return ", ".join(filter(None, (*place, *(self.texts(name)[row] for name in NAMED[:2]))))


def load_tables(folder: Path) -> tuple[pa.Table, pa.Table | None]:
    """Reads results and, where there are any, timings of a campaign.

    A planner or an aircraft that is named more than once is told apart by the keys that each entry gives.

    Raises:
        InputError: the folder holds no campaign, or a file of it cannot be read.
    """
    path, timings = folder / RESULTS, folder / TIMINGS
    if not path.is_file():
        raise InputError(f"wayproof: {folder} has no {RESULTS}: it is not the folder of a campaign")
    results, told = read_table(path)
    for name, entries, first in (("planner", "planners", "kind"), ("aircraft", "aircraft", "model")):
        results = _told_apart(results, name, told["campaign"].get(entries, ()), first)
    return results, read_table(timings)[0] if timings.is_file() else None


def about(results: pa.Table) -> dict[str, Any]:
    """What the table says of its campaign: `campaign`, `scenarios`, `runs`."""
    told: dict[str, Any] = json.loads(results.schema.metadata[b"wayproof"])
    return told


def planned_runs(results: pa.Table) -> int | None:
    """How many runs the campaign has, flown or not; None where the table does not say so."""
    runs = about(results).get("runs")
    return runs if isinstance(runs, int) else None


def _told_apart(results: pa.Table, name: str, entries: Sequence[Any], first: str) -> pa.Table:
    """The table with entries of one planner, or aircraft, told apart by the keys that they give."""
    import pyarrow as pa

    given = [entry if isinstance(entry, Mapping) else {first: entry} for entry in entries]
    named = [each.get(first) for each in given]
    keys = [f"{name}.{key}" for key in dict.fromkeys(itertools.chain(*given)) if key != first]
    keys = [key for key in keys if key in results.column_names]
    texts = []
    for row in results.select([name, *keys]).to_pylist() if name in results.column_names else ():
        told = (f"{key.partition('.')[2]} {row[key]}" for key in keys if row[key] is not None)
        texts.append(", ".join((row[name], *told)) if named.count(row[name]) > 1 else row[name])
    if not texts:
        return results
    return results.set_column(results.column_names.index(name), name, pa.array(texts, pa.string()))


def varied_keys(results: pa.Table) -> list[str]:
    """Columns that say what was varied: names with more than one value, and the key paths before `outcome`."""
    before = itertools.takewhile(lambda name: name != "outcome", results.column_names)
    names = [name for name in NAMED if name in results.column_names and len(results[name].unique()) > 1]
    return names + [name for name in before if name not in NEEDED]


def are_crossed(worlds: Sequence[str], scenarios: Sequence[str]) -> bool:
    """Whether one world was flown with several scenarios: else it stands for its scenario."""
    return len(set(zip(worlds, scenarios, strict=True))) > len(set(worlds))


def recordings_of(folder: Path) -> list[Path]:
    """The recordings that a campaign's folder keeps, by the number of the run."""
    kept = [path for path in (folder / RUNS).glob(f"*/{RECORDING}") if path.parent.name.isdecimal()]
    return sorted(kept, key=lambda path: int(path.parent.name))


def allowed_for(row: Mapping[str, Any]) -> bool:
    """Whether a row of the results was not tracked for nothing but navigation errors that were planned for."""
    causes = (row.get("trackability.causes") or "").split("; ")
    return is_allowed_for(causes, row.get("navigation_error_m.max"), row.get("navigation_margin_m"))
