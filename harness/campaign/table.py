"""The runs of a campaign as its folder holds them: the tables read back, a column a figure."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

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

    A planner or an aircraft that is named more than once is told apart by the keys that each entry gives.

    Args:
        results: one row a run; its metadata say of which campaign.
        timings: the planner's times by `run`; None where there are none.

    Raises:
        InputError: a column that every campaign has is missing.
    """

    def __init__(self, results: pa.Table, timings: pa.Table | None = None) -> None:
        about = json.loads((results.schema.metadata or {}).get(b"wayproof", b"{}"))
        self.campaign: Mapping[str, Any] = about.get("campaign", {})
        planned = about.get("runs")
        self.planned: int | None = planned if isinstance(planned, int) else None
        self._count = results.num_rows
        self._columns: dict[str, list[Any]] = {
            name: [None if value != value else value for value in results[name].to_pylist()]
            for name in results.column_names
        }
        before = itertools.takewhile(lambda name: name != "outcome", self._columns)
        self._keys = [name for name in before if name not in NEEDED]
        self.check_columns(NEEDED)
        self._tell_apart("planner", self.campaign.get("planners", ()), "kind")
        self._tell_apart("aircraft", self.campaign.get("aircraft", ()), "model")
        if timings is not None:
            rows = {row["run"]: row for row in timings.to_pylist()}
            for name in timings.column_names:
                self._columns.setdefault(name, [rows.get(run, {}).get(name) for run in self.values("run")])

    @classmethod
    def of(cls, folder: Path) -> Runs:
        """Those in the folder of a campaign.

        Raises:
            InputError: the folder holds no campaign, or a file of it cannot be read.
        """
        timings = folder / TIMINGS
        return cls(results_of(folder), read_table(timings)[0] if timings.is_file() else None)

    def __len__(self) -> int:
        """Number of runs."""
        return int(self._count)

    @property
    def varied(self) -> list[str]:
        """Columns that say what was varied: names with more than one value, and the varied key paths."""
        return [name for name in NAMED if len(set(self.texts(name))) > 1] + self._keys

    def check_columns(self, names: Sequence[str]) -> None:
        """Raises InputError where there is no such column."""
        for name in names:
            if name not in self._columns:
                known = ", ".join(self.varied) or "none"
                raise InputError(f"wayproof: {RESULTS} has no column {name!r}; varied there: {known}")

    def values(self, name: str) -> Sequence[Any]:
        """A column of any kind, None where there is nothing."""
        return self._columns.get(name) or (None,) * len(self)

    def texts(self, name: str) -> list[str]:
        """A column of text, empty where there is nothing."""
        return ["" if value is None else str(value) for value in self.values(name)]

    def numbers(self, name: str) -> FloatArray:
        """A figure of every run, (n,): a column of the results or of the timings, NaN where there is none."""
        return np.array([np.nan if value is None else value for value in self.values(name)], dtype=np.float64)

    @cached_property
    def reached(self) -> NDArray[np.bool_]:
        """Whether each run reached its goal."""
        return np.array([outcome == "reached" for outcome in self.texts("outcome")], dtype=bool)

    @property
    def clearance_ratio(self) -> FloatArray:
        """Least clearance over the wanted one; NaN where one of them is not known."""
        wanted_m = self.numbers("wanted_clearance_m")
        ratio: FloatArray = self.numbers("min_clearance_m") / np.where(wanted_m > 0.0, wanted_m, np.nan)
        return ratio

    @cached_property
    def are_crossed(self) -> bool:
        """Whether one world was flown with several scenarios: else it stands for its scenario."""
        worlds = self.texts("world")
        return len(set(zip(worlds, self.texts("scenario"), strict=True))) > len(set(worlds))

    def name(self, row: int) -> str:
        """World, planner and aircraft of a run."""
        world, scenario = self.values("world")[row], self.values("scenario")[row]
        place = (scenario, world) if world and self.are_crossed else (world or scenario,)
        return ", ".join(filter(None, (*place, *(self.values(name)[row] for name in NAMED[:2]))))

    def _tell_apart(self, name: str, entries: Sequence[Any], first: str) -> None:
        """Gives entries of one planner, or aircraft, names with the keys that they give."""
        given = [entry if isinstance(entry, Mapping) else {first: entry} for entry in entries]
        named = [each.get(first) for each in given]
        keys = [key for key in dict.fromkeys(itertools.chain(*given)) if f"{name}.{key}" in self._columns]
        for row, value in enumerate(self._columns[name]):
            if named.count(value) > 1:
                told = ((key, self._columns[f"{name}.{key}"][row]) for key in keys if key != first)
                texts = (f"{key} {given}" for key, given in told if given is not None)
                self._columns[name][row] = ", ".join((value, *texts))


def results_of(folder: Path) -> pa.Table:
    """The results of a campaign.

    Raises:
        InputError: the folder holds no campaign, or they cannot be read.
    """
    if not (folder / RESULTS).is_file():
        raise InputError(f"wayproof: {folder} has no {RESULTS}: it is not the folder of a campaign")
    return read_table(folder / RESULTS)[0]


def recordings_of(folder: Path) -> list[Path]:
    """The recordings that a campaign's folder keeps, by the number of the run."""
    kept = [path for path in (folder / RUNS).glob(f"*/{RECORDING}") if path.parent.name.isdecimal()]
    return sorted(kept, key=lambda path: int(path.parent.name))
