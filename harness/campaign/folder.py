"""The folder of a campaign: `campaign.json` says what is flown, the journal what has been, two tables the results.

The tables are made from the journal, and replaced whole. Whoever writes holds a lock on the file `lock` (flock),
which ends with the process.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import IO, TYPE_CHECKING, Any, Final

from aircraft.airframes import airframe
from harness.campaign.journal import JOURNAL, Journal, read_journal, sealed
from harness.campaign.results import INDEX, METRICS, RESULTS, RUN, TIMES, TIMINGS, table
from harness.campaign.runs import CampaignRuns
from harness.files.errors import RunFolderError
from harness.files.folder_lock import FolderLock
from harness.files.input_file import read_index
from harness.files.versions import versions
from harness.files.whole_file import PARTIAL, append_to, replace_text, replacing
from harness.files.wording import counted
from planner.registry import distribution_of

if TYPE_CHECKING:
    import pyarrow as pa

LOCK: Final = "lock"
FOLDER_SCHEMA: Final = "wayproof/campaign-folder/1"
MAX_INDEX_BYTES: Final = 10**9

ABSENT: Final = object()
MAX_TOLD: Final = 3
IN_ORDER: Final = ("campaign.grid", "campaign.random")
"""What a run flies follows from the order of the keys there, too."""


class CampaignFolder:
    """The folder of a campaign that is being flown. Use as a context manager; the lock ends with it.

    Attributes:
        path: where it lies.
        done: numbers of the runs that are over.
    """

    def __init__(self, path: Path, runs: CampaignRuns, *, resume: bool) -> None:
        """Claims the folder: makes it, or goes on with it.

        Args:
            path: the folder; made with its parents where missing.
            runs: the campaign.
            resume: whether what the folder has of this campaign is kept and gone on with.

        Raises:
            RunFolderError: the folder holds something else, results without `resume` or those of another
                campaign, a damaged journal, another process is flying into it, or it cannot be written.
        """
        self.path, self._runs = path, runs
        self._stack = ExitStack()
        try:
            self.done = self._claim(resume)
            self._journal: IO[bytes] = self._stack.enter_context(append_to(path / JOURNAL))
        except OSError as error:
            self._stack.close()
            raise RunFolderError(f"cannot write the campaign {path}: {error.strerror or error}") from error
        except BaseException:
            self._stack.close()
            raise

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
        over = read_journal(self.path).runs
        if first is not None:
            over = {run: each for run, each in over.items() if run < first}
        about = {"runs": len(self._runs), **self._runs.plain()}
        columns = RUN | self._runs.varied | METRICS
        rows = [{**each.row, "run": run} for run, each in over.items()]
        times = [{**each.times, "run": run} for run, each in over.items()]
        self._write_table(RESULTS, table(rows, columns, about))
        self._write_table(TIMINGS, table(times, TIMES, about))

    def outcomes(self) -> dict[str, int]:
        """How many of the runs that are over ended how, the most frequent first."""
        over = read_journal(self.path).runs.values()
        return dict(Counter(each.row["outcome"] for each in over).most_common())

    def __enter__(self) -> CampaignFolder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._stack.close()

    def _write_table(self, name: str, content: pa.Table) -> None:
        import pyarrow.parquet as pq

        with replacing(self.path / name) as file:
            pq.write_table(content, file, compression="zstd")

    def _claim(self, resume: bool) -> set[int]:
        """Locks the folder, checks and writes its index; returns the runs that are over."""
        path = self.path
        if path.exists() and not path.is_dir():
            raise RunFolderError(f"{path} is a file, not a folder for a campaign")
        path.mkdir(parents=True, exist_ok=True)
        if {each.name for each in path.iterdir()} - {LOCK, INDEX + PARTIAL} and _index(path) is None:
            raise RunFolderError(
                f"{path} is not empty and not a campaign's folder: choose another one or empty it first"
            )
        self._stack.callback(FolderLock(path, LOCK).release)
        now, before = self._about(), _index(path)
        journal = read_journal(path)
        self._check(journal, before, now, resume=resume)
        if before != now:
            replace_text(path / INDEX, json.dumps(now, indent=1, allow_nan=False) + "\n")
        if journal.path.exists():
            os.truncate(journal.path, journal.end)
        return set(journal.runs)

    def _check(
        self, journal: Journal, before: dict[str, Any] | None, now: dict[str, Any], *, resume: bool
    ) -> None:
        """Refuses results without `resume`, and those of another campaign."""
        has_any = bool(journal.runs) or _has_rows(self.path / RESULTS)
        if has_any and not resume:
            held = counted(len(journal.runs), "run") if journal.runs else RESULTS
            raise RunFolderError(f"{self.path} holds {held}: go on with --resume, or choose another folder")
        if has_any and before is not None and (changes := list(_changes(before, now))):
            told = "; ".join(changes[:MAX_TOLD]) + ("; and more" if len(changes) > MAX_TOLD else "")
            raise RunFolderError(
                f"{self.path} is of another campaign: {told}; change it back or choose another folder"
            )
        if beyond := [run for run in journal.runs if run >= len(self._runs)]:
            raise RunFolderError(
                f"{journal.path}: tells of run {beyond[0]} where the last is {len(self._runs) - 1}"
            )

    def _about(self) -> dict[str, Any]:
        """The content of `campaign.json`, as it is read back."""
        about = {
            "schema": FOLDER_SCHEMA,
            "versions": versions(),
            "planners": {kind: distribution_of(kind) for kind in self._runs.planners},
            "aircraft": {model: airframe(model).files.digest() for model in self._runs.aircraft},
            **self._runs.plain(),
        }
        read: dict[str, Any] = json.loads(json.dumps(about))
        return read


def _index(path: Path) -> dict[str, Any] | None:
    """The index of a campaign's folder, which holds all its scenarios; None where there is none that is ours."""
    return read_index(path / INDEX, FOLDER_SCHEMA, MAX_INDEX_BYTES)


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


def _changes(before: Any, now: Any, where: str = "") -> Iterator[str]:
    """What differs between two contents, a sentence each."""
    if isinstance(before, dict) and isinstance(now, dict):
        for name in dict.fromkeys([*before, *now]):
            yield from _changes(
                before.get(name, ABSENT), now.get(name, ABSENT), f"{where}.{name}".lstrip(".")
            )
        if where in IN_ORDER and before.keys() == now.keys() and list(before) != list(now):
            yield f"{where} had its keys in the order {', '.join(before)}, has {', '.join(now)}"
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for index, pair in enumerate(zip(before, now, strict=True)):
            yield from _changes(*pair, f"{where}[{index}]")
    elif before != now:
        yield f"{where} was {_shown(before)}, is {_shown(now)}"


def _shown(value: Any) -> str:
    text = "not there" if value is ABSENT else json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
