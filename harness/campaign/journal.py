"""The journal of a campaign: a line for every run that is over, flushed to the disk before the next.

A process killed in the middle of a line leaves a torn last one, which is left out. Any other line that is not as it
was written is damage: no more is made of the journal then, for what it holds would be lost.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from harness.files.errors import RunFolderError

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
        end: the byte at which the last whole line ends.
    """

    path: Path
    runs: Mapping[int, Over]
    end: int


def read_journal(folder: Path) -> Journal:
    """Reads the journal in the folder of a campaign; without one, no run is over.

    Raises:
        RunFolderError: a line other than a torn last one is damaged.
        OSError: it cannot be read.
    """
    path = folder / JOURNAL
    runs: dict[int, Over] = {}
    end = 0
    for number, (text, is_last) in enumerate(_texts(path), start=1):
        line = _line(text)
        if line is None and is_last and not text.endswith(b"}\n"):
            break
        told = "" if line is None else "something else than was written: its sha256 is another"
        if line is None or sealed(line) != text:
            told = told or "no run"
        else:
            run, over = line["run"], Over(line["row"], line["times"], line["held"])
            told = "" if runs.setdefault(run, over) == over else f"run {run} otherwise than a line before it"
        if told:
            raise RunFolderError(
                f"{path}:{number}: is damaged: it tells of {told}; delete that line, and what it told of is flown again"
            )
        end += len(text)
    return Journal(path, runs, end)


def sealed(told: Mapping[str, Any]) -> bytes:
    """The line that tells of a run: `run`, `row`, `times` and `held`, with the SHA-256 of all that."""
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


def _line(text: bytes) -> dict[str, Any] | None:
    """What a line tells; None where it does not tell of a run."""
    try:
        line = json.loads(text) if text.endswith(b"\n") else None
    except (ValueError, RecursionError):
        return None
    if not isinstance(line, dict) or not {"run", "row", "times", "held"} <= line.keys():
        return None
    return line if type(line["run"]) is int and line["run"] >= 0 else None
