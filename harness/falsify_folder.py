"""The folder of a search for the breaking point, and its flights line by line."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

from harness.falsify_keys import Vary
from harness.falsify_search import Point
from harness.record import RunFolderError
from harness.whole_file import replace_text

SCHEMA: Final = "wayproof/falsify/1"
INDEX: Final = "falsify.json"
TRIALS: Final = "falsify.csv"
FALSIFIED: Final = "falsified.yaml"
PICTURES: Final = ("falsify.svg", "falsify.png")


@dataclass(frozen=True)
class Trial:
    """One flight.

    Attributes:
        trial: its number, from 0.
        condition: number of its condition; flights of one condition differ in the seed.
        displacement: of each key, from 0 (mild) to 1 (hard).
        values: of each key.
        seed: root seed of the flight.
        failed: whether it did what was looked for.
        margin: where it did not, how far it was from it, from 0 to 1.
        outcome: as in `metrics.json`, or `error`.
        reason: the same as a sentence.
        trackable: whether every leg was tracked.
        min_clearance_m: least distance to an obstacle edge.
        clearance_violation_s: time below the wanted clearance.
        flown_length_m: length of the flown track.
        flight_time_s: its time.
        cross_track_max_m: largest distance from the plan.
        digest: of the track.
    """

    trial: int
    condition: int
    displacement: Point
    values: tuple[float, ...]
    seed: int
    failed: bool
    margin: float
    outcome: str
    reason: str
    trackable: bool | None = None
    min_clearance_m: float | None = None
    clearance_violation_s: float | None = None
    flown_length_m: float | None = None
    flight_time_s: float | None = None
    cross_track_max_m: float | None = None
    digest: str = ""


@contextmanager
def trials_folder(out: Path, vary: Sequence[Vary]) -> Iterator[Callable[[Trial], None]]:
    """Makes the folder ours and gives what writes a line of `falsify.csv`; on leaving it is not yet complete.

    Raises:
        RunFolderError: the folder holds something else or cannot be written.
    """
    if out.exists() and not out.is_dir():
        raise RunFolderError(f"{out} is a file, not a folder for a search")
    try:
        out.mkdir(parents=True, exist_ok=True)
        if any(out.iterdir()) and not _is_ours(out):
            raise RunFolderError(
                f"{out} is not empty and not a search: choose another folder or empty it first"
            )
        write_index(out, {"schema": SCHEMA, "complete": False})
        for name in (TRIALS, FALSIFIED, *PICTURES):
            (out / name).unlink(missing_ok=True)
        file = (out / TRIALS).open("w", encoding="utf-8", newline="")
    except OSError as error:
        raise RunFolderError(f"cannot write the search in {out}: {error.strerror or error}") from error
    with file:
        plain = [field.name for field in fields(Trial) if field.name not in ("displacement", "values")]
        names = [*plain[:2], *(each.key for each in vary), *plain[2:]]
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()

        def write(trial: Trial) -> None:
            keys = {each.key: value for each, value in zip(vary, trial.values, strict=True)}
            writer.writerow({name: getattr(trial, name) for name in plain} | keys)
            file.flush()

        yield write


def _is_ours(out: Path) -> bool:
    try:
        index = json.loads((out / INDEX).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(index, dict) and index.get("schema") == SCHEMA


def write_index(out: Path, content: Mapping[str, Any]) -> None:
    """Writes `falsify.json`."""
    replace_text(out / INDEX, json.dumps(content, indent=2, allow_nan=False) + "\n")
