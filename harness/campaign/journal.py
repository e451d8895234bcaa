"""The journal of a campaign: a line for every run that is over, flushed to the disk before the next.

A process killed in the middle of a line leaves a torn last one, which is left out. Any other line that is not as it
was written is damage: no more is made of the journal then, for what it holds would be lost.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
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
        held: whether the claim of the campaign holds of it.
    """

    row: Mapping[str, Any]
    times: Mapping[str, Any]
    held: bool = False


@dataclass(frozen=True)
class Journal:
    """What a journal holds.

    Attributes:
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
    *lines, torn = path.read_bytes().split(b"\n") if path.exists() else (b"",)
    if lines and not torn and not lines[-1].endswith(b"}"):
        lines.pop()
    runs: dict[int, Over] = {}
    for number, text in enumerate(lines, start=1):
        try:
            line = json.loads(text)
            run, over = line["run"], Over(line["row"], line["times"], line["held"])
            told = "" if type(run) is int else "no run"
            if sealed(line) != text + b"\n":
                told = "something else than was written: its sha256 is another"
            elif runs.setdefault(run, over) != over:
                told = f"run {run} otherwise than a line before it"
        except (ValueError, RecursionError, KeyError, TypeError):
            told = "no run"
        if told:
            raise RunFolderError(
                f"{path}:{number}: is damaged: it tells of {told}; delete that line, and what it told of is flown again"
            )
    return Journal(path, runs, sum(len(each) + 1 for each in lines))


def sealed(told: Mapping[str, Any]) -> bytes:
    """The line that tells of a run: `run`, `row`, `times` and `held`, with the SHA-256 of all that."""
    text = json.dumps({key: value for key, value in told.items() if key != SEAL}, allow_nan=False)
    digest = hashlib.sha256(text.encode()).hexdigest()
    return f'{text[:-1]}, "{SEAL}": "{digest}"}}\n'.encode()
