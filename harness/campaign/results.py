"""The results of a campaign: the columns of `results.parquet` and `timings.parquet`, written and read back.

`results.parquet` has one row a run, sorted by run, and nothing that depends on the machine's speed or on who
flew what when, so that its bytes are the same whatever flew it; times are in `timings.parquet`.
"""

from __future__ import annotations

import itertools
import json
import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from harness.analysis.registry import METRICS as FIGURES
from harness.files.input_file import InputError, read_index
from harness.flight.record import FloatArray
from harness.run_files.run_folder import RECORDING
from harness.scenario.kinds import source_words

if TYPE_CHECKING:
    import pyarrow as pa

INDEX: Final = "campaign.json"  # file in a campaign's folder that says what is flown
RUNS: Final = "runs"
"""Folder in a campaign's folder that holds run folders, each named by the number of its run."""
RESULTS: Final = "results.parquet"  # file with a row for each finished run
TIMINGS: Final = "timings.parquet"  # file with the wall times of each run
SCHEMA: Final = "wayproof/results/1"
CERTIFICATE: Final = "certificate.json"  # file of what a certificate's days say
OF_A_DAY: Final = ("environment", "navigation", "uncertainty")  # sections that conditions fill where left out
CERTIFICATE_SCHEMA: Final = "wayproof/certificate/1"
NAMED: Final = ("planner", "aircraft", "world", "scenario")
"""Columns of names, which count as varied keys where they have more than one value."""
RUN: Final = {name: "int" if name in ("run", "case", "seed") else "text" for name in (
    "run", "case", "scenario", "world", "planner", "aircraft", "seed",
)}  # fmt: skip
"""The first columns of `results.parquet`, before those of the varied keys, and the type of each."""
LAW_KEY: Final = "guidance.kind"  # key of a scenario that names the guidance law

UNTIMED_FIGURES: Final = tuple(each for each in FIGURES if not each.timed and not each.derived)
METRICS: Final = {each.path: each.kind for each in UNTIMED_FIGURES} | dict.fromkeys(
    ("wanted_clearance_m", "optimum_m", "length_ratio"), "number"
)
"""The columns of `results.parquet` after the varied keys: figures of `metrics.json` without times, and more.

Of the legs of `trackability` there are their number, that of those not trackable, and their causes, each once;
`wanted_clearance_m` is the planner's `clearance_m`, of a given path one that is written; `optimum_m` is the shortest
path of a point that knows the world and keeps the clearance, `length_ratio` the flown length over it where the goal was
reached; `error` is a traceback.
"""
TIMED: Final = {each.path.removeprefix("timing."): each for each in FIGURES if each.timed}
TIMES: Final = {"run": "int"} | {name: each.kind for name, each in TIMED.items()}
"""Columns of `timings.parquet`."""


def metric_cells(
    metrics: Mapping[str, Any], wanted_clearance_m: float | None, optimum_m: float | None
) -> dict[str, Any]:
    """Returns the figures of `metrics.json` as cells of a row, with the clearance wanted and the shortest path."""
    reached = metrics["outcome"] == "reached"
    return {
        **{each.path: each.value(metrics) for each in UNTIMED_FIGURES},
        "wanted_clearance_m": wanted_clearance_m,
        "optimum_m": optimum_m,
        "length_ratio": metrics["flown_length_m"] / optimum_m if reached and optimum_m else None,
    }


def time_cells(metrics: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the wall-clock times of `metrics.json` as cells of a row, by column."""
    return {name: each.value(metrics) for name, each in TIMED.items()}


def fly_again(results: Path, run: int, planner: str = "", law: str = "") -> str:
    """Returns the command line that flies a run again; it names a planner or a law that is code of one's own."""
    words = ["wayproof", "fly", "--from", str(results), "--run", str(run)]
    return shlex.join([*words, *source_words(planner, law)])


def table(rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str], metadata: Mapping[str, Any]) -> pa.Table:
    """Makes a table of rows, and adds `metadata` to it as `sealed` does.

    `columns` gives the type of each: int, number, bool, text; or empty, for whatever stands there, JSON where mixed.
    """
    import pyarrow as pa

    types = {"int": pa.int64(), "number": pa.float64(), "bool": pa.bool_(), "text": pa.string()}
    arrays = []
    for name, kind in columns.items():
        cells = [row.get(name) for row in rows]
        try:
            arrays.append(pa.array(cells, types.get(kind)))
        except pa.ArrowException:
            arrays.append(pa.array([None if cell is None else json.dumps(cell) for cell in cells]))
    return sealed(pa.Table.from_arrays(arrays, list(columns)), metadata)


def sealed(content: pa.Table, metadata: Mapping[str, Any]) -> pa.Table:
    """Adds `metadata`, and the SHA-256 of it and the table, to the metadata of the table."""
    stored = {"schema": SCHEMA, **metadata, "sha256": _sha256(content, metadata)}
    return content.replace_schema_metadata({"wayproof": json.dumps(stored, allow_nan=False)})


def _sha256(content: pa.Table, metadata: Mapping[str, Any]) -> str:
    digest = sha256(json.dumps({**metadata, "schema": SCHEMA}, sort_keys=True).encode())
    for name in content.column_names:
        digest.update(json.dumps([name, content[name].to_pylist()]).encode())
    return digest.hexdigest()


def read_table(path: Path) -> tuple[pa.Table, dict[str, Any]]:
    """Reads a table of a campaign and what it is about; an InputError for another file, damage or a changed table."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not path.exists():
        raise InputError(f"{path}: no such file")
    try:
        metadata = json.loads((pq.read_schema(path).metadata or {})[b"wayproof"])
        digest = metadata.pop("sha256") if metadata["schema"] == SCHEMA else None
        if not isinstance(digest, str) or not isinstance(metadata["campaign"], dict):
            raise ValueError("of something else")
    except (OSError, pa.ArrowException, LookupError, TypeError, ValueError, AttributeError, RecursionError):
        raise InputError(f"{path}: is not the {RESULTS} of a campaign; give one") from None
    try:
        content = pq.read_table(path)
    except (OSError, pa.ArrowException, ValueError) as error:
        raise InputError(f"{path}: is damaged: {str(error).splitlines()[0]}") from error
    if _sha256(content, metadata) != digest:
        way = "`wayproof sweep` with --resume makes it anew from the journal"
        raise InputError(f"{path}: is not as it was written: its sha256 is another; {way}")
    return content, metadata


def results_of(folder: Path) -> pa.Table:
    """Reads the results in a campaign's folder; an InputError where there are none, or they cannot be read."""
    if not (folder / RESULTS).is_file():
        raise InputError(f"wayproof: {folder} has no {RESULTS}: it is not the folder of a campaign")
    return read_table(folder / RESULTS)[0]


def certificate_of(folder: Path) -> dict[str, Any] | None:
    """Returns the certificate that a campaign's runs were flown for; None without one."""
    return read_index(folder / CERTIFICATE, CERTIFICATE_SCHEMA)


def recordings_of(folder: Path) -> list[Path]:
    """Lists the recordings in a campaign's folder, by the number of the run."""
    recordings = [path for path in (folder / RUNS).glob(f"*/{RECORDING}") if path.parent.name.isdecimal()]
    return sorted(recordings, key=lambda path: int(path.parent.name))


class Runs:
    """The runs in a campaign's tables; `planned` is how many the campaign has, flown or not, where that is known.

    `conditions` has every kind of day that is flown: `ideal or typical, but for what scenarios or campaign set`.

    Entries of one planner or aircraft that is named more than once differ by the keys that each gives.
    """

    def __init__(self, results: pa.Table, timings: pa.Table | None = None) -> None:
        metadata = json.loads((results.schema.metadata or {}).get(b"wayproof", b"{}"))
        self.campaign: Mapping[str, Any] = metadata.get("campaign", {})
        self.planned: int | None = metadata.get("runs")
        self.rare: bool = metadata.get("rare", False)
        self._count = results.num_rows
        self._columns: dict[str, list[Any]] = {
            name: [None if value != value else value for value in results[name].to_pylist()]
            for name in results.column_names
        }
        scenarios = metadata.get("scenarios") or [{"keys": {}}]
        self.conditions = " or ".join(self._days(scenarios))
        given = (*(each["keys"] for each in scenarios), *map(self.campaign.get, ("set", "grid", "random")))
        if any(key.partition(".")[0] in OF_A_DAY for keys in given for key in keys or ()):
            self.conditions += ", but for what scenarios or campaign set"
        self._tell_apart("planner", self.campaign.get("planners", ()), "kind")
        self._tell_apart("aircraft", self.campaign.get("aircraft", ()), "model")
        before = itertools.takewhile(lambda name: name != "outcome", self._columns)
        names = [name for name in NAMED if len(set(self.texts(name))) > 1]
        self.varied = names + [name for name in before if name not in RUN]
        self.reached = np.array(self.texts("outcome")) == "reached"
        self.failed = ~self.reached | (self.numbers("check.ok") == 0.0)  # also not flown as given
        if timings is not None:
            for name, cells in (columns := timings.to_pydict()).items():
                times = dict(zip(columns["run"], cells, strict=True))
                self._columns.setdefault(name, [times.get(run) for run in self.values("run")])

    def _days(self, scenarios: Sequence[Mapping[str, Any]]) -> Iterable[str]:
        """Returns the kinds of day flown: those of the column, else those that scenarios and campaign ask for."""
        written = [(each["keys"] | (self.campaign.get("set") or {})).get("conditions") for each in scenarios]
        return dict.fromkeys(day or "ideal" for day in self._columns.get("conditions") or written)

    @classmethod
    def of(cls, folder: Path) -> Runs:
        """Reads the runs in a campaign's folder; an InputError: none, none readable, or drawn near failure."""
        timings = folder / TIMINGS
        if (runs := cls(results_of(folder), read_table(timings)[0] if timings.is_file() else None)).rare:
            raise InputError(f"wayproof: {folder} has days drawn near failure; see its {CERTIFICATE}")
        return runs

    def __len__(self) -> int:
        return int(self._count)

    def check_columns(self, names: Sequence[str]) -> None:
        """Raises InputError where one of the columns does not exist."""
        for name in names:
            if name not in self._columns:
                known = ", ".join(self.varied) or "none"
                raise InputError(f"wayproof: {RESULTS} has no column {name!r}; varied there: {known}")

    def values(self, name: str) -> Sequence[Any]:
        """Returns a column of any kind; all of it is None where the tables lack it."""
        return self._columns.get(name) or (None,) * len(self)

    def texts(self, name: str) -> list[str]:
        """Returns a column as text, empty where a run has no value."""
        return ["" if value is None else str(value) for value in self.values(name)]

    def numbers(self, name: str) -> FloatArray:
        """Returns a figure of every run, (n,), from the results or the timings; NaN where a run has none."""
        return np.array([np.nan if value is None else value for value in self.values(name)], dtype=np.float64)

    @property
    def clearance_ratio(self) -> FloatArray:
        """Least clearance over the wanted one; NaN where one of them is not known."""
        wanted_m = self.numbers("wanted_clearance_m")
        return self.numbers("min_clearance_m") / np.where(wanted_m > 0.0, wanted_m, np.nan)

    @cached_property
    def are_crossed(self) -> bool:
        """Whether a world was flown with several scenarios; else a world's name stands for its scenario."""
        worlds = self.texts("world")
        return len(set(zip(worlds, self.texts("scenario"), strict=True))) > len(set(worlds))

    def name(self, row: int) -> str:
        """Names a run by its world, planner and aircraft."""
        planner, aircraft, world, scenario = (self.values(name)[row] for name in NAMED)
        place = (scenario, world) if world and self.are_crossed else (world or scenario,)
        return ", ".join(filter(None, (*place, planner, aircraft)))

    def _tell_apart(self, name: str, entries: Sequence[Any], first: str) -> None:
        """Names entries of the same planner, or aircraft, by the keys that they give; the name has its shield."""
        keys = dict.fromkeys(itertools.chain(*(each for each in entries if isinstance(each, Mapping))))
        columns = {key: self.values(f"{name}.{key}") for key in keys if key not in (first, "shield")}
        texts = [
            tuple(f"{key} {cells[row]}" for key, cells in columns.items() if cells[row] is not None)
            for row in range(len(self))
        ]
        pairs = list(zip(self._columns[name], texts, strict=True))
        named = Counter(value for value, _ in {*pairs})
        self._columns[name] = [", ".join((one, *more)) if named[one] > 1 else one for one, more in pairs]
