"""The folder of one run: complete only when the manifest says so.

The manifest comes first and says `complete: false`, files are renamed when they are whole, the manifest with checksums
comes last: a process killed at any point leaves no folder that can be taken for a complete run.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import platform
import sys
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from harness.files.errors import RunFolderError
from harness.files.folder_lock import FolderLock, claim_folder
from harness.files.input_file import MAX_JSON_BYTES, read_index, read_text
from harness.files.versions import FLOWN_WITH, versions
from harness.files.whole_file import PARTIAL, replace_text, replacing
from harness.files.wording import printable
from harness.flight.record import AcceptedPlan, Track
from harness.run_files.run_tables import PlanRow, plan_rows, plans_table, track_of, track_table

if TYPE_CHECKING:
    import pyarrow as pa

SCENARIO = "scenario.yaml"
MANIFEST = "manifest.json"
TRACK = "track.parquet"
PLANS = "plans.parquet"
METRICS = "metrics.json"
EVENTS = "events.csv"
RECORDING = "flight.rrd"
OVERLAY: Final = "overlay.rrd"  # recording of all runs of a scenario in one, in the folder of a comparison
REPORT = "report.html"
REPORT_FILES = ("report.html", "report.csv", "path.svg", "path.png", "profiles.svg", "profiles.png")
"""Files that `wayproof report` adds to a run folder."""
MAX_BYTES = 64_000_000  # a larger scenario file in the folder is refused

HASHED: Final = (SCENARIO, METRICS, TRACK, PLANS, EVENTS, RECORDING)  # files whose SHA-256 the manifest has

SCHEMA = "wayproof/run/1"
VERSIONED_DISTRIBUTIONS = (*FLOWN_WITH, "rerun-sdk", "pyarrow")  # their versions stand in the manifest
UNSPLIT_COLUMN = "plan_index"  # not written byte plane by byte plane, which halves the others' size and time


@dataclass(frozen=True, eq=False)
class Run:
    """A complete run, read back; `scenario_yaml` is the scenario as flown, the plans are in order."""

    folder: Path
    scenario_yaml: str
    manifest: Mapping[str, Any]
    track: Track
    plans: tuple[PlanRow, ...]
    metrics: Mapping[str, Any]


class RunFolder(AbstractContextManager["RunFolder"]):
    """A run folder while it is written, as a context manager; left without `finish`, it stays marked incomplete."""

    def __init__(self, path: Path, manifest: dict[str, Any], lock: FolderLock) -> None:
        self.path, self._manifest, self._lock = path, manifest, lock

    @classmethod
    def create(
        cls,
        path: Path,
        scenario_yaml: str,
        command: Sequence[str],
        sources: Sequence[Mapping[str, str]] = (),
        turn_radius_m: float | None = None,
    ) -> RunFolder:
        """Makes the folder, marked incomplete, with scenario as flown and manifest; removes a former run's files.

        `sources` has path and SHA-256 of each file that obstacles were made of. A RunFolderError says that the path is
        a file, a folder with other things in it or that another process is writing to, or cannot be written.
        """
        manifest = {
            "schema": SCHEMA,
            "complete": False,
            "command": list(command),
            "started_utc": datetime.now(UTC).isoformat(timespec="seconds"),
            **({"sources": [dict(each) for each in sources]} if sources else {}),
            **({} if turn_radius_m is None else {"turn_radius_m": turn_radius_m}),
            "versions": versions(VERSIONED_DISTRIBUTIONS),
            "platform": {
                "system": platform.platform(),
                "machine": platform.machine(),
                "byte_order": sys.byteorder,
                "cpus": os.cpu_count(),
            },
        }
        try:
            made = [each for each in (path, *path.parents) if not each.exists()]
            lock = claim_folder(path, "run folder", MANIFEST, SCHEMA)
            with ExitStack() as undo:
                undo.callback(_remove_made, path, made)
                replace_text(path / MANIFEST, _json(manifest))
                for name in (METRICS, PLANS, TRACK, EVENTS, SCENARIO, RECORDING, *REPORT_FILES):
                    (path / name).unlink(missing_ok=True)
                    (path / (name + PARTIAL)).unlink(missing_ok=True)
                replace_text(path / SCENARIO, scenario_yaml)
                undo.pop_all()
        except OSError as error:
            raise RunFolderError(f"cannot write the run folder {path}: {error.strerror or error}") from error
        return cls(path, manifest, lock)

    def finish(self, track: Track, plans: Sequence[AcceptedPlan], metrics: Mapping[str, Any]) -> None:
        """Writes all after the recording, then `complete`; RunFolderError: no rows; ValueError: a metric not finite."""
        if not len(track):
            raise RunFolderError(f"the run in {self.path} has no track: nothing was flown")
        text = _json(metrics)
        self.leave(track, plans)
        replace_text(self.path / METRICS, text)
        sums = {name: _sha256(self.path / name) for name in HASHED if (self.path / name).exists()}
        replace_text(self.path / MANIFEST, _json({**self._manifest, "complete": True, "sha256": sums}))

    def log_events(self, events: Sequence[tuple[float, str, str]]) -> None:
        """Writes the log of events as text: a row each of simulated time (s), level and sentence."""
        text = io.StringIO()
        rows = ((f"{at:g}", level, printable(message)) for at, level, message in events)
        csv.writer(text, lineterminator="\n").writerows((("time_s", "level", "text"), *rows))
        replace_text(self.path / EVENTS, text.getvalue())

    def leave(self, track: Track, plans: Sequence[AcceptedPlan]) -> None:
        """Writes track and plans, perhaps of a flight that was broken off; the run stays marked incomplete."""
        import pyarrow.parquet as pq

        rows = track_table(track)
        columns = [each for each in rows.column_names if each != UNSPLIT_COLUMN]
        split = {"use_dictionary": False, "use_byte_stream_split": columns}
        for name, table, how in ((TRACK, rows, split), (PLANS, plans_table(plans), {})):
            with replacing(self.path / name) as file:
                pq.write_table(table, file, compression="lz4", **how)

    def __exit__(self, *error: object) -> None:
        self._lock.close()


def tables(path: Path) -> tuple[pa.Table, pa.Table]:
    """Returns all columns of track and plans in a run folder that `load_run` has read without a fault."""
    import pyarrow.parquet as pq

    return pq.read_table(path / TRACK), pq.read_table(path / PLANS)


def load_run(path: Path) -> Run:
    """Reads a complete run back; a RunFolderError says that it is none, incomplete, or misses or has damaged files."""
    if (manifest := read_index(path / MANIFEST, SCHEMA)) is None:
        _check_exists(path)
        raise RunFolderError(f"{path} is not a run folder: it has no {MANIFEST} of a run")
    if manifest.get("complete") is not True:
        left = f"; {TRACK} and {PLANS} have what was flown" if (path / TRACK).exists() else ""
        raise RunFolderError(f"the run in {path} is incomplete: it was stopped before its end; fly it again{left}")
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        for name in (TRACK, PLANS, METRICS, SCENARIO, *({EVENTS} & {*manifest.get("sha256", {})})):
            _check_hash(path / name, manifest)
        return Run(
            folder=path,
            scenario_yaml=read_text(path / SCENARIO, MAX_BYTES, "a scenario, in YAML"),
            manifest=manifest,
            track=track_of(pq.read_table(path / TRACK)),
            plans=plan_rows(pq.read_table(path / PLANS)),
            metrics=json.loads(read_text(path / METRICS, MAX_JSON_BYTES, "metrics, in JSON")),
        )
    except (OSError, pa.ArrowException, *WRONG_CONTENT) as error:
        raise damaged(path, error) from error


WRONG_CONTENT: Final = (
    AttributeError, LookupError, TypeError, ValueError, ArithmeticError, MemoryError, RecursionError
)  # fmt: skip
"""Errors that come up when values are not what they should be."""


def damaged(path: Path, error: BaseException) -> RunFolderError:
    """Returns the error that says that a run folder's content is not that of a run."""
    text = " ".join(str(error).split())[:200]
    reason = text if isinstance(error, OSError | ValueError) else f"{type(error).__name__} {text}"
    return RunFolderError(f"the run in {path} is damaged: {reason}; fly it again")


def _check_exists(path: Path) -> None:
    if not path.exists():
        raise RunFolderError(f"{path}: no such folder; give a run folder")


def recording_of(path: Path) -> Path:
    """Returns the recording in a run folder, whose run may be incomplete; a RunFolderError: none, or changed files."""
    if not (recording := path / RECORDING).is_file():
        _check_exists(path)
        raise RunFolderError(f"{path} has no {RECORDING}: not a run folder, or flown with --no-recording")
    try:
        manifest = read_index(path / MANIFEST, SCHEMA) or {}
        for name in manifest.get("sha256", {}):
            _check_hash(path / name, manifest)
    except (OSError, *WRONG_CONTENT) as error:
        raise damaged(path, error) from error
    return recording


def _check_hash(path: Path, manifest: Mapping[str, Any]) -> None:
    """Raises ValueError if a file is not the one that the manifest knows, if it knows one."""
    if not path.is_file():
        raise ValueError(f"{path.name} is missing or not a file")
    if manifest.get("sha256", {}).get(path.name) not in (None, _sha256(path)):
        raise ValueError(f"{path.name} is not what was written: its sha256 is not that in {MANIFEST}")


def _remove_made(path: Path, made: Sequence[Path]) -> None:
    """Removes the manifest of a run that could not begin, and the folder, if it was made for the run."""
    if path in made:
        with suppress(OSError):
            (path / MANIFEST).unlink(missing_ok=True)
            for each in made:
                each.rmdir()


def _json(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
