"""The results of a campaign as rows: their columns, and the tables of a journal's lines.

`results.parquet` has one row a run, sorted by run, and nothing that depends on the machine's speed or on who
flew what when, so that its bytes are the same whatever flew it; times are in `timings.parquet`.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from harness.analysis.metric import ERROR as ERROR  # the same word for the same thing
from harness.analysis.registry import METRICS as FIGURES
from harness.files.strict_yaml import InputError
from harness.scenario.given import own_words

if TYPE_CHECKING:
    import pyarrow as pa

INDEX: Final = "campaign.json"
"""In the folder of a campaign: what is flown."""
RUNS: Final = "runs"
"""Below that: run folders, each called by the number of its run."""
RESULTS: Final = "results.parquet"
TIMINGS: Final = "timings.parquet"
SCHEMA: Final = "wayproof/results/1"
RUN: Final = {
    "run": "int",
    "case": "int",
    "scenario": "text",
    "world": "text",
    "planner": "text",
    "aircraft": "text",
    "seed": "int",
}
"""Columns before those of the varied keys, and what they hold."""

WITHOUT_TIMES: Final = tuple(each for each in FIGURES if not each.timed and not each.derived)

METRICS: Final = {
    **{each.path: each.kind for each in WITHOUT_TIMES},
    "wanted_clearance_m": "number",
    "optimum_m": "number",
    "length_ratio": "number",
}
"""Columns after them: what `metrics.json` has, dots between its levels, times left out, and more.

Of what is there only with terrain, with navigation errors or of a given path the other runs have nothing.
Of the legs of `trackability` there are their number, that of those not trackable, and their causes, each once;
`wanted_clearance_m` is the planner's `clearance_m`; `optimum_m` is the shortest path of a point that knows the
world and keeps the clearance, `length_ratio` the flown length over it where the goal was reached; `error` is a
traceback.
"""

TIMES: Final = {"run": "int"} | {
    each.path.removeprefix("timing."): each.kind for each in FIGURES if each.timed
}
"""Columns of `timings.parquet`."""


def metric_cells(
    metrics: Mapping[str, Any], wanted_clearance_m: float | None, optimum_m: float | None
) -> dict[str, Any]:
    """The content of `metrics.json` as cells of a row, by column.

    `wanted_clearance_m`: distance from obstacles that the planner was to keep.
    `optimum_m`: length of the shortest path; None where there is none or it is not wanted.
    """
    reached = metrics["outcome"] == "reached"
    return {
        **{each.path: each.value(metrics) for each in WITHOUT_TIMES},
        "wanted_clearance_m": wanted_clearance_m,
        "optimum_m": optimum_m,
        "length_ratio": metrics["flown_length_m"] / optimum_m if reached and optimum_m else None,
    }


def time_cells(metrics: Mapping[str, Any]) -> dict[str, Any]:
    """The wall-clock times of `metrics.json` as cells of a row, by column."""
    return {each.path.removeprefix("timing."): each.value(metrics) for each in FIGURES if each.timed}


def table(
    rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str], about: Mapping[str, Any]
) -> pa.Table:
    """Rows as a table, by the number of the run.

    Args:
        rows: cells by column; those that are missing are null.
        columns: what each column holds: int, number, bool, text or json.
        about: what goes with it of its campaign, as JSON has it.
    """
    import pyarrow as pa

    types = {"int": pa.int64(), "number": pa.float64(), "bool": pa.bool_()}
    schema = pa.schema([(name, types.get(kind, pa.string())) for name, kind in columns.items()])
    ordered = sorted(rows, key=lambda row: row["run"])
    arrays = [pa.array([row.get(field.name) for row in ordered], field.type) for field in schema]
    return sealed(pa.Table.from_arrays(arrays, schema=schema), about)


def sealed(content: pa.Table, about: Mapping[str, Any]) -> pa.Table:
    """A table with what it says of its campaign, and the SHA-256 of both in its metadata."""
    told = {"schema": SCHEMA, **about, "sha256": _sha256(content, about)}
    return content.replace_schema_metadata({"wayproof": json.dumps(told, allow_nan=False)})


def _sha256(content: pa.Table, about: Mapping[str, Any]) -> str:
    digest = sha256(json.dumps({**about, "schema": SCHEMA}, sort_keys=True).encode())
    for name in content.column_names:
        digest.update(json.dumps([name, content[name].to_pylist()]).encode())
    return digest.hexdigest()


LAW: Final = "guidance.kind"
"""Key of a scenario that names the guidance law."""


def read_table(path: Path) -> tuple[pa.Table, dict[str, Any]]:
    """Reads `results.parquet` or `timings.parquet`, and what it says of its campaign.

    Raises:
        InputError: it is something else, damaged, or other than it was written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not path.exists():
        raise InputError(f"{path}: no such file")
    try:
        about = json.loads((pq.read_schema(path).metadata or {})[b"wayproof"])
        digest = about.pop("sha256") if about["schema"] == SCHEMA else None
        campaign = about["campaign"]
        if not isinstance(digest, str) or not isinstance(campaign, dict):
            raise ValueError("of something else")
    except (
        OSError,
        pa.ArrowException,
        KeyError,
        TypeError,
        ValueError,
        AttributeError,
        RecursionError,
    ) as error:
        raise InputError(f"{path}: is not the {RESULTS} of a campaign; give one") from error
    try:
        content = pq.read_table(path)
    except (OSError, pa.ArrowException, ValueError) as error:
        raise InputError(f"{path}: is damaged: {str(error).splitlines()[0]}") from error
    if _sha256(content, about) != digest:
        raise InputError(
            f"{path}: is not as it was written: its sha256 is another; `wayproof sweep` with --resume makes it anew "
            "from the journal"
        )
    return content, about


def fly_again(results: Path, run: int, planner: str = "", law: str = "") -> str:
    """The command line that flies a run of a campaign again; a planner or a law that is code of one's own is named."""
    words = ["wayproof", "fly", "--from", str(results), "--run", str(run)]
    return shlex.join([*words, *own_words(planner, law)])
