"""The folder of a search for the breaking point, and its flights line by line."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, fields
from pathlib import Path
from types import TracebackType
from typing import Any, Final

from harness.falsify.keys import Vary
from harness.falsify.search import Point
from harness.files.errors import RunFolderError
from harness.files.folder_lock import FolderLock
from harness.files.input_file import read_index
from harness.files.strict_yaml import InputError
from harness.files.whole_file import PARTIAL, fresh, replace_text

SCHEMA: Final = "wayproof/falsify/1"
INDEX: Final = "falsify.json"
TRIALS: Final = "falsify.csv"
FALSIFIED: Final = "falsified.yaml"


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
    outcome: str
    reason: str
    trackable: bool | None = None
    min_clearance_m: float | None = None
    clearance_violation_s: float | None = None
    flown_length_m: float | None = None
    flight_time_s: float | None = None
    cross_track_max_m: float | None = None
    digest: str = ""


class SearchFolder:
    """The folder of a search that is under way. Use as a context manager; this process alone writes to it.

    Flights go into `falsify.csv.partial`. An earlier search stays until `take_over`, which Ctrl-C calls where a
    flight has ended; an InputError leaves everything as it was found.
    """

    def __init__(self, out: Path, vary: Sequence[Vary]) -> None:
        """Claims the folder, made with its parents where missing.

        Raises:
            RunFolderError: the folder holds something else, another process writes to it, or it cannot be written.
        """
        if out.exists() and not out.is_dir():
            raise RunFolderError(f"{out} is a file, not a folder for a search")
        self._out, self._vary, self.flights = out, vary, 0
        self._made = [each for each in (out, *out.parents) if not each.exists()]
        with ExitStack() as stack, _told(out):
            out.mkdir(parents=True, exist_ok=True)
            stack.callback(FolderLock(out).release)
            others = {each.name for each in out.iterdir()} - {TRIALS + PARTIAL, INDEX + PARTIAL}
            if others and read_index(out / INDEX, SCHEMA) is None:
                raise RunFolderError(
                    f"{out} is not empty and not a search: choose another folder or empty it first"
                )
            self._file = stack.enter_context(
                io.TextIOWrapper(fresh(out / (TRIALS + PARTIAL)), "utf-8", newline="")
            )
            self._plain = [each.name for each in fields(Trial) if each.name not in ("displacement", "values")]
            names = [*self._plain[:2], *(each.key for each in vary), *self._plain[2:]]
            self._writer = csv.DictWriter(self._file, names, lineterminator="\n")
            self._writer.writeheader()
            self._file.flush()
            self._held = stack.pop_all()

    def write(self, trial: Trial) -> None:
        """Puts a flight that has ended into the table."""
        keys = {each.key: value for each, value in zip(self._vary, trial.values, strict=True)}
        self._writer.writerow({name: getattr(trial, name) for name in self._plain} | keys)
        self._file.flush()
        self.flights += 1

    def take_over(self) -> None:
        """Puts these flights in the place of an earlier search, all of which goes; not yet complete."""
        with _told(self._out):
            self._file.close()
            write_index(self._out, {"schema": SCHEMA, "complete": False})
            (self._out / FALSIFIED).unlink(missing_ok=True)
            (self._out / (TRIALS + PARTIAL)).replace(self._out / TRIALS)

    def __enter__(self) -> SearchFolder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        with self._held:
            if isinstance(error, KeyboardInterrupt) and self.flights and not self._file.closed:
                self.take_over()
            elif isinstance(error, InputError | KeyboardInterrupt):
                (self._out / (TRIALS + PARTIAL)).unlink(missing_ok=True)
                with suppress(OSError):  # what holds anything else stays
                    for each in self._made:
                        each.rmdir()


@contextmanager
def _told(out: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise RunFolderError(f"cannot write the search in {out}: {error.strerror or error}") from error


def write_index(out: Path, content: Mapping[str, Any]) -> None:
    """Writes `falsify.json`."""
    replace_text(out / INDEX, json.dumps(content, indent=2, allow_nan=False) + "\n")
