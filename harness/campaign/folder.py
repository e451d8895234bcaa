"""The folder of a campaign: `campaign.json` says what is flown, the journal what has been, two tables the results.

The journal has a line for every run that is over, flushed to the disk before the next. A torn last line, of a process
that was killed, is left out; any other line that is not as it was written is damage, and refused. The tables are made
from the journal, and replaced whole. Whoever writes holds a lock on the file `lock` (flock).
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, Final

from aircraft.airframes import airframe
from harness.analysis.metric import ERROR
from harness.campaign.flight import Answer
from harness.campaign.results import INDEX, METRICS, RESULTS, RUN, RUNS, TIMES, TIMINGS, table
from harness.campaign.runs import CampaignRuns
from harness.campaign.workers import Workers, fly_jobs
from harness.files.errors import RunFolderError
from harness.files.folder_lock import MAX_INDEX_BYTES, claim_folder
from harness.files.input_file import read_index
from harness.files.versions import versions
from harness.files.whole_file import append_to, replace_text, replacing
from harness.files.wording import counted
from harness.scenario.kinds import PLANNER, source_digests

LOCK: Final = "lock"  # file that is locked while a process writes the folder
JOURNAL: Final = "journal.jsonl"  # file with a line for every finished run, from which a campaign resumes
SEAL_KEY: Final = "sha256"  # key of a journal line under which the SHA-256 of the rest of the line stands
FOLDER_SCHEMA: Final = "wayproof/campaign-folder/2"
TABLES_EVERY_S: Final = 30.0  # least wall time between two writes of the tables
TABLES_SHARE: Final = 0.01
"""Writing the tables takes at most this share of a campaign's wall time, and is done at most every `TABLES_EVERY_S`."""
MAX_CHANGES: Final = 3  # differences from the campaign in the folder that an error names


class CampaignFolder(AbstractContextManager["CampaignFolder"]):
    """The folder of a campaign that is being flown. Use as a context manager; the lock ends with it.

    `finished`: the runs that are over, by number; `grown`: whether the campaign was begun with fewer draws.
    """

    def __init__(self, path: Path, runs: CampaignRuns, *, resume: bool) -> None:
        """Claims the folder: makes it, or with `resume` goes on with what it has of this campaign, or of fewer draws.

        A RunFolderError: it holds something else, results without `resume` or of another campaign, or damage; another
        process is flying into it, or it cannot be written.
        """
        self.path, self._runs = path, runs
        with ExitStack() as stack:
            stack.enter_context(closing(claim_folder(path, "campaign", INDEX, FOLDER_SCHEMA, LOCK)))
            try:
                self.finished, end = _read_journal(path / JOURNAL)
                self._begin(resume)
                if (path / JOURNAL).exists():
                    os.truncate(path / JOURNAL, end)
                self._journal: IO[bytes] = stack.enter_context(append_to(path / JOURNAL))
            except OSError as error:
                raise RunFolderError(f"cannot write the campaign {path}: {error.strerror or error}") from error
            self._stack = stack.pop_all()

    def append(self, answer: Answer) -> None:
        """Writes a run that is over to the disk."""
        self._journal.write(sealed(vars(answer)))
        self._journal.flush()
        os.fsync(self._journal.fileno())
        self.finished[answer.run] = answer

    def write_tables(self, first: int | None = None) -> None:
        """Writes `results.parquet` and `timings.parquet` of all runs that are over; `first`: so many are all."""
        import pyarrow.parquet as pq

        rows = [self.finished[run] for run in sorted(self.finished) if first is None or run < first]
        metadata = {"runs": len(self._runs) if first is None else first, **self._runs.plain()}
        columns = RUN | dict.fromkeys(self._runs.varied, "") | METRICS
        for name, content in (
            (RESULTS, table([{**each.row, "run": each.run} for each in rows], columns, metadata)),
            (TIMINGS, table([{**each.times, "run": each.run} for each in rows], TIMES, metadata)),
        ):
            with replacing(self.path / name) as file:
                pq.write_table(content, file, compression="zstd")

    def outcomes(self) -> dict[str, int]:
        """Counts the runs that are over by outcome, the most frequent first."""
        return dict(Counter(each.row["outcome"] for each in self.finished.values()).most_common())

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _begin(self, resume: bool) -> None:
        now = json.loads(json.dumps(self._index()))
        before = read_index(self.path / INDEX, FOLDER_SCHEMA, MAX_INDEX_BYTES)
        if self.finished or (self.path / RESULTS).exists():
            if not resume:
                held = counted(len(self.finished), "run") if self.finished else RESULTS
                text = f"{self.path} holds {held}: go on with --resume, or choose another folder"
                raise RunFolderError(text)
            now["grown"] = self._check_same(before or now, now)
        self.grown: bool = now["grown"]
        if beyond := [run for run in self.finished if run >= len(self._runs)]:
            text = f"tells of run {beyond[0]} where the last is {len(self._runs) - 1}"
            raise RunFolderError(f"{self.path / JOURNAL}: {text}")
        if before != now:
            replace_text(self.path / INDEX, json.dumps(now, indent=1, allow_nan=False) + "\n")

    def _index(self) -> dict[str, Any]:
        """Returns what the index says of a campaign that begins."""
        runs, campaign = self._runs, self._runs.campaign
        return {
            "schema": FOLDER_SCHEMA,
            "grown": False,
            "versions": versions(),
            "planners": {kind: PLANNER.distribution_of(kind) for kind in runs.planners},
            "sources": source_digests([*runs.sources[0], *runs.sources[1]]),
            "aircraft": {model: airframe(model).files.digest() for model in runs.aircraft},
            # What a run flies follows from the order of these keys, too.
            "order": {"grid": list(campaign.grid), "random": list(campaign.random)},
            **({"files": runs.files} if runs.files else {}),
            **runs.plain(),
        }

    def _check_same(self, before: dict[str, Any], now: dict[str, Any]) -> bool:
        """Tells whether the campaign was begun with fewer draws; refuses one that differs otherwise."""
        was, draws = (each["campaign"].get("draws", 1) for each in (before, now))
        grows = self._runs.can_grow and was < draws
        then, today = dict(_leaves(before)), dict(_leaves(now))
        same = {"grown", *(["campaign.draws"] if grows else [])}
        changes = []
        for name in dict.fromkeys([*then, *today]):
            if then.get(name) != today.get(name) and name not in same:
                texts = (each.get(name, "not there") for each in (then, today))
                shorter = (each if len(each) <= 60 else f"{each[:57]}..." for each in texts)
                changes.append("{} was {}, is {}".format(name, *shorter))
        if len(changes) > MAX_CHANGES:
            changes[MAX_CHANGES:] = ["and more"]
        if changes:
            way = "change it back or choose another folder"
            raise RunFolderError(f"{self.path} is of another campaign: {'; '.join(changes)}; {way}")
        return grows or bool(before["grown"])


def fly_missing(
    runs: CampaignRuns,
    folder: CampaignFolder,
    workers: Workers,
    progress: Callable[[Answer], None] | None = None,
    enough: Callable[[], bool] = lambda: False,
    among: range | None = None,
) -> list[int]:
    """Flies the missing runs, of all or `among` some; whatever ends it, all that is done is in the folder's tables.

    `enough` tells before every look whether the runs so far answer the question; those still flying are given up then.
    The numbers returned are of runs whose process was killed, or had no memory: they have no result.
    """
    left: list[int] = []
    tables_due = time.monotonic()

    def finish(run: int, answer: Answer | None) -> None:
        if answer is None or answer.row["outcome"] == ERROR:
            # What a crash has left is no whole run folder.
            shutil.rmtree(folder.path / RUNS / str(run), ignore_errors=True)
        if answer is None:
            left.append(run)
            return
        folder.append(replace(answer, row={**runs.cells(run), **answer.row}))
        if progress is not None:
            progress(answer)

    def write_at_times() -> None:
        nonlocal tables_due
        if folder.finished and (begun := time.monotonic()) >= tables_due:
            folder.write_tables()
            tables_due = time.monotonic() + max(TABLES_EVERY_S, (time.monotonic() - begun) / TABLES_SHARE)

    try:
        numbers = range(len(runs)) if among is None else among
        missing = (runs.job(run, folder.path) for run in numbers if run not in folder.finished)
        fly_jobs(missing, workers, finish, write_at_times, enough)
    finally:
        if folder.finished or left:
            folder.write_tables()
    return sorted(left)


def unfinished_text(runs: Sequence[int]) -> str:
    """Returns a sentence on the runs that the machine kept from their ends."""
    first = ", ".join(map(str, runs[:5])) + (", ..." if len(runs) > 5 else "")
    were, them = ("was", "it") if len(runs) == 1 else ("were", "them")
    why = "the process died, or had no memory, each time that it was tried"
    return f"{counted(len(runs), 'run')} {were} not flown to the end ({first}): {why}; --resume flies {them}"


def _read_journal(path: Path) -> tuple[dict[int, Answer], int]:
    """Returns the runs that are over, and the byte at which the last whole line ends; a RunFolderError at damage."""
    *lines, torn = path.read_bytes().split(b"\n") if path.exists() else (b"",)
    if lines and not torn and not lines[-1].endswith(b"}"):
        lines.pop()
    runs: dict[int, Answer] = {}
    for number, text in enumerate(lines, start=1):
        try:
            line = json.loads(text)
            run, answer = line["run"], Answer(line["run"], line["row"], line["times"], line["held"])
            fault = "" if type(run) is int else "no run"
            if sealed(line) != text + b"\n":
                fault = "something else than was written: its sha256 is another"
            elif runs.setdefault(run, answer) != answer:
                fault = f"run {run} otherwise than a line before it"
        except (ValueError, RecursionError, KeyError, TypeError):
            fault = "no run"
        if fault:
            way = "delete that line, and what it told of is flown again"
            raise RunFolderError(f"{path}:{number}: is damaged: it tells of {fault}; {way}")
    return runs, sum(len(each) + 1 for each in lines)


def sealed(line: Mapping[str, Any]) -> bytes:
    """Returns a line of the journal: `run`, `row`, `times` and `held`, with their SHA-256."""
    text = json.dumps({key: value for key, value in line.items() if key != SEAL_KEY}, allow_nan=False)
    return f'{text[:-1]}, "{SEAL_KEY}": "{hashlib.sha256(text.encode()).hexdigest()}"}}\n'.encode()


def _leaves(content: Any, where: str = "") -> Iterator[tuple[str, str]]:
    """Yields the innermost values of JSON content, as text, with their places in it."""
    if content and isinstance(content, dict):
        for name, each in content.items():
            yield from _leaves(each, f"{where}.{name}".lstrip("."))
    elif isinstance(content, list) and any(isinstance(each, dict | list) for each in content):
        for index, each in enumerate(content):
            yield from _leaves(each, f"{where}[{index}]")
    else:
        yield where, json.dumps(content)
