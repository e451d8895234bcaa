"""The journal of a campaign, read back: a line for every run that is over, flushed to the disk before the next.

A process killed in the middle of a line leaves a torn last one, which is left out. Any other line that is not as it
was written is damage: no more is made of the journal then, for what it holds would be lost.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from harness.campaign.results import METRICS, RUN, TIMES, table
from harness.files.errors import RunFolderError

if TYPE_CHECKING:
    from harness.campaign.runs import CampaignRuns

JOURNAL: Final = "journal.jsonl"
SEAL: Final = "sha256"
"""Key of the SHA-256 of what a line tells."""


@dataclass(frozen=True)
class Over:
    """A run that is over.

    Attributes:
        row: its cells in `results.parquet`.
        times: those in `timings.parquet`.
        held: whether the claim of the campaign holds of it.
    """

    row: Mapping[str, Any]
    times: Mapping[str, Any]
    held: bool = False


@dataclass(frozen=True)
class Journal:
    """What a journal holds.

    Attributes:
        path: where it lies; it need not exist.
        runs: those that are over, by number, in the order in which they ended.
        lines: the line that tells of each, from 1.
        end: the byte at which the last whole line ends.
    """

    path: Path
    runs: Mapping[int, Over]
    lines: Mapping[int, int]
    end: int

    def check(self, campaign: CampaignRuns) -> None:
        """Raises RunFolderError where a line tells of no run of the campaign, or makes no row of its tables."""
        for run, line in self.lines.items():
            if run >= len(campaign):
                raise _damaged(self.path, line, f"run {run} where the last is {len(campaign) - 1}")
            row = self.runs[run].row
            for name, cell in campaign.run(run).cells().items():
                if row.get(name) != cell:
                    raise _damaged(self.path, line, f"run {run} with another {name} than the campaign has")
        if not _fit(self.runs, campaign):
            for run, over in self.runs.items():
                if not _fit({run: over}, campaign):
                    raise _damaged(self.path, self.lines[run], "a value of another type")


def rows(runs: Mapping[int, Over]) -> list[dict[str, Any]]:
    """Of `results.parquet`."""
    return [{**over.row, "run": run} for run, over in runs.items()]


def time_rows(runs: Mapping[int, Over]) -> list[dict[str, Any]]:
    """Those of `timings.parquet`."""
    return [{**over.times, "run": run} for run, over in runs.items()]


def columns(campaign: CampaignRuns) -> dict[str, str]:
    """The columns of `results.parquet`, and what they hold."""
    return RUN | campaign.varied | METRICS


def read_journal(folder: Path) -> Journal:
    """Reads the journal in the folder of a campaign; without one, no run is over.

    Raises:
        RunFolderError: a line other than a torn last one is damaged.
        OSError: it cannot be read.
    """
    path = folder / JOURNAL
    runs: dict[int, Over] = {}
    lines: dict[int, int] = {}
    end = 0
    for number, (text, is_last) in enumerate(_texts(path), start=1):
        line = _mapping(text)
        if line is None and is_last:
            break
        if line is None or not _is_over(line):
            raise _damaged(path, number, "no run")
        if sealed(line) != text:
            raise _damaged(path, number, "something else than was written: its sha256 is another")
        run, over = line["run"], Over(line["row"], line["times"], line.get("held") is True)
        if runs.setdefault(run, over) != over:
            raise _damaged(path, number, f"run {run} otherwise than line {lines[run]}")
        lines.setdefault(run, number)
        end += len(text)
    return Journal(path, runs, lines, end)


def sealed(told: Mapping[str, Any]) -> bytes:
    """The line that tells of a run: `run`, `row`, `times` and what else there is, with the SHA-256 of all that."""
    text = json.dumps({key: value for key, value in told.items() if key != SEAL}, allow_nan=False)
    digest = hashlib.sha256(text.encode()).hexdigest()
    return f'{text[:-1]}, "{SEAL}": "{digest}"}}\n'.encode()


def _texts(path: Path) -> Iterator[tuple[bytes, bool]]:
    """The lines of a file, and whether each is the last."""
    if not path.exists():
        return
    with path.open("rb") as file:
        text = next(file, b"")
        for following in file:
            yield text, False
            text = following
        if text:
            yield text, True


def _mapping(text: bytes) -> dict[str, Any] | None:
    try:
        line = json.loads(text) if text.endswith(b"\n") else None
    except (ValueError, RecursionError):
        return None
    return line if isinstance(line, dict) else None


def _is_over(line: Mapping[str, Any]) -> bool:
    """Whether a line is one of a run that is over."""
    run, row, times = line.get("run"), line.get("row"), line.get("times")
    return (
        (type(run) is int and run >= 0)
        and (isinstance(row, dict) and isinstance(times, dict))
        and (row.get("run", run) == run and isinstance(row.get("outcome"), str))
    )


def _fit(runs: Mapping[int, Over], campaign: CampaignRuns) -> bool:
    """Whether tables can be made of the runs."""
    import pyarrow as pa

    try:
        table(rows(runs), columns(campaign), "")
        table(time_rows(runs), TIMES, "")
    except (pa.ArrowException, TypeError, ValueError, OverflowError):
        return False
    return True


def _damaged(path: Path, line: int, told: str) -> RunFolderError:
    return RunFolderError(
        f"{path}:{line}: is damaged: it tells of {told}; delete that line, and what it told of is flown again"
    )
