"""The folder of a campaign: `campaign.json` says what is flown, the journal what has been, two tables the results.

The tables are made from the journal, and replaced whole. Whoever writes holds a lock on the file `lock` (flock),
which ends with the process.
"""

from __future__ import annotations

import json
import os
import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any, Final

from aircraft.airframes import airframe
from harness.campaign.journal import JOURNAL, read_journal, sealed
from harness.campaign.results import INDEX, METRICS, RESULTS, RUN, TIMES, TIMINGS, table
from harness.campaign.runs import CampaignRuns
from harness.files.errors import RunFolderError
from harness.files.folder_lock import FolderLock
from harness.files.input_file import MAX_JSON_BYTES, read_index
from harness.files.versions import versions
from harness.files.whole_file import PARTIAL, append_to, replace_text, replacing
from harness.files.wording import counted
from harness.scenario.kinds import PLANNER

LOCK: Final = "lock"
FOLDER_SCHEMA: Final = "wayproof/campaign-folder/1"
MAX_INDEX_BYTES: Final = 10**9

MAX_TOLD: Final = 3


def claim_folder(
    path: Path, what: str, index: str, schema: str, lock: str | None = None, most_bytes: int = MAX_JSON_BYTES
) -> FolderLock:
    """Holds the folder that a command writes, made where missing.

    `what`: the noun for what is written there.
    `lock`: name of a file to lock in place of the folder.
    `most_bytes`: the largest index that is read.

    Raises:
        RunFolderError: it is a file, holds something else, another process writes to it, or it cannot be made.
    """
    if path.exists() and not path.is_dir():
        raise RunFolderError(f"{path} is a file, not a folder for a {what}")
    try:
        path.mkdir(parents=True, exist_ok=True)
        others = {each.name for each in path.iterdir() if not each.name.endswith(PARTIAL)} - {lock}
        if others and read_index(path / index, schema, most_bytes) is None:
            raise RunFolderError(
                f"{path} is not empty and not a {what}: choose another folder or empty it first"
            )
        return FolderLock(path, lock)
    except OSError as error:
        raise RunFolderError(f"cannot write the {what} {path}: {error.strerror or error}") from error


class CampaignFolder:
    """The folder of a campaign that is being flown. Use as a context manager; the lock ends with it.

    Attributes:
        done: numbers of the runs that are over.
    """

    def __init__(self, path: Path, runs: CampaignRuns, *, resume: bool) -> None:
        """Claims the folder: makes it, or goes on with it.

        `resume`: whether what the folder has of this campaign is kept and gone on with.

        Raises:
            RunFolderError: the folder holds something else, results without `resume` or those of another
                campaign, a damaged journal, another process is flying into it, or it cannot be written.
        """
        self.path, self._runs = path, runs
        with ExitStack() as stack:
            held = claim_folder(path, "campaign", INDEX, FOLDER_SCHEMA, LOCK, MAX_INDEX_BYTES)
            stack.callback(held.release)
            try:
                self.done = self._begin(resume)
                self._journal: IO[bytes] = stack.enter_context(append_to(path / JOURNAL))
            except OSError as error:
                raise RunFolderError(
                    f"cannot write the campaign {path}: {error.strerror or error}"
                ) from error
            self._stack = stack.pop_all()

    def append(self, run: int, row: Mapping[str, Any], times: Mapping[str, Any], held: bool = False) -> None:
        """Puts a run that is over on the disk."""
        self._journal.write(sealed({"run": run, "row": row, "times": times, "held": held}))
        self._journal.flush()
        os.fsync(self._journal.fileno())
        self.done.add(run)

    def write_tables(self, first: int | None = None) -> None:
        """Makes `results.parquet` and `timings.parquet` from the journal.

        Args:
            first: of so many runs, by their number; default: of all that are over.
        """
        import pyarrow.parquet as pq

        over = read_journal(self.path).runs.items()
        kept = [(run, each) for run, each in over if first is None or run < first]
        about = {"runs": len(self._runs), **self._runs.plain()}
        for name, columns, rows in (
            (RESULTS, RUN | self._runs.varied | METRICS, [{**each.row, "run": run} for run, each in kept]),
            (TIMINGS, TIMES, [{**each.times, "run": run} for run, each in kept]),
        ):
            with replacing(self.path / name) as file:
                pq.write_table(table(rows, columns, about), file, compression="zstd")

    def outcomes(self) -> dict[str, int]:
        """How many of the runs that are over ended how, the most frequent first."""
        over = read_journal(self.path).runs.values()
        return dict(Counter(each.row["outcome"] for each in over).most_common())

    def __enter__(self) -> CampaignFolder:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _begin(self, resume: bool) -> set[int]:
        """Checks and writes the index; returns the runs that are over."""
        about = {
            "schema": FOLDER_SCHEMA,
            "versions": versions(),
            "planners": {kind: PLANNER.distribution_of(kind) for kind in self._runs.planners},
            "aircraft": {model: airframe(model).files.digest() for model in self._runs.aircraft},
            **self._runs.plain(),
        }
        now = json.loads(json.dumps(about))
        before = read_index(self.path / INDEX, FOLDER_SCHEMA, MAX_INDEX_BYTES)
        journal = read_journal(self.path)
        if journal.runs or _has_rows(self.path / RESULTS):
            held = counted(len(journal.runs), "run") if journal.runs else RESULTS
            if not resume:
                raise RunFolderError(
                    f"{self.path} holds {held}: go on with --resume, or choose another folder"
                )
            if changes := list(_changes(before or now, now)):
                told = "; ".join(changes[:MAX_TOLD]) + ("; and more" if len(changes) > MAX_TOLD else "")
                raise RunFolderError(
                    f"{self.path} is of another campaign: {told}; change it back or choose another folder"
                )
        if beyond := [run for run in journal.runs if run >= len(self._runs)]:
            raise RunFolderError(
                f"{journal.path}: tells of run {beyond[0]} where the last is {len(self._runs) - 1}"
            )
        if before != now:
            replace_text(self.path / INDEX, json.dumps(now, indent=1, allow_nan=False) + "\n")
        if journal.path.exists():
            os.truncate(journal.path, journal.end)
        return set(journal.runs)


def _has_rows(results: Path) -> bool:
    """Whether a table holds runs; one that cannot be read may."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return bool(pq.read_metadata(results).num_rows > 0)
    except FileNotFoundError:
        return False
    except (OSError, pa.ArrowException):
        return True


def _changes(before: dict[str, Any], now: dict[str, Any]) -> Iterator[str]:
    """What differs between two indices, a sentence each; what a run flies follows from the order of some keys, too."""
    was, is_now = dict(_leaves(before)), dict(_leaves(now))
    for name in {**was, **is_now}:
        if was.get(name) != is_now.get(name):
            texts = (
                textwrap.shorten(each.get(name, "not there"), 60, placeholder="...") for each in (was, is_now)
            )
            yield "{} was {}, is {}".format(name, *texts)
    for name in ("grid", "random"):
        orders = [list(each["campaign"].get(name, ())) for each in (before, now)]
        if orders[0] != orders[1] and sorted(orders[0]) == sorted(orders[1]):
            yield "campaign.{} had its keys in the order {}, has {}".format(name, *map(", ".join, orders))


def _leaves(content: Any, where: str = "") -> Iterator[tuple[str, str]]:
    """The values in a content as JSON, by where they stand."""
    if content and isinstance(content, dict):
        for name, each in content.items():
            yield from _leaves(each, f"{where}.{name}".lstrip("."))
    elif isinstance(content, list) and any(isinstance(each, dict | list) for each in content):
        for index, each in enumerate(content):
            yield from _leaves(each, f"{where}[{index}]")
    else:
        yield where, json.dumps(content)
