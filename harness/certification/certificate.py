"""What a certificate says, and its file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from harness.analysis.claims import Claim
from harness.certification.bounds import Verdict
from harness.certification.explained import Explained
from harness.files.whole_file import replace_text

CERTIFICATE: Final = "certificate.json"
SCHEMA: Final = "wayproof/certificate/1"
FIRST_FAILURES: Final = 5
"""Runs that are named of those that failed in the same way."""


@dataclass(frozen=True)
class Failure:
    """Runs of which the claim does not hold, and that ended alike.

    Attributes:
        outcome: how they ended.
        cause: why legs were not tracked, or what the check of a given path found; may be empty.
        count: how many.
        runs: numbers of the first of them.
    """

    outcome: str
    cause: str
    count: int
    runs: tuple[int, ...]


@dataclass(frozen=True)
class Certificate:
    """How often a claim held, and what follows from it; what else it says is what was asked.

    Attributes:
        runs: number of days that were flown and count.
        held: on how many of them the claim held.
        probability_lower: lower confidence bound of the probability that it holds on a day.
        probability_upper: upper bound.
        confidence: of each bound by itself.
        verdict: of the claim that it holds with at least `probability`.
        probability: what was claimed; None where nothing was.
        method: how the bounds were derived.
        most_runs: number of days that were allowed.
        planner: its kind; `given` for a path.
        varied: what was drawn, by key path.
        failures: days on which it did not hold, by how they ended, the most frequent first.
        explained: how much of the failures each varied quantity explains.
        failing_runs: numbers of all days on which it did not hold.
    """

    claim: Claim
    runs: int
    held: int
    probability_lower: float
    probability_upper: float
    confidence: float
    verdict: Verdict
    probability: float | None
    method: str
    most_runs: int
    subject: str
    planner: str
    aircraft: str
    conditions: str | None
    seed: int
    varied: Mapping[str, Any]
    failures: tuple[Failure, ...]
    explained: tuple[Explained, ...]
    failing_runs: tuple[int, ...]
    command: str
    versions: Mapping[str, str | None]

    def plain(self) -> dict[str, Any]:
        """The content of `certificate.json`."""
        return {"schema": SCHEMA, **asdict(self)}

    def write(self, folder: Path) -> None:
        """Writes `certificate.json` into a folder."""
        replace_text(folder / CERTIFICATE, json.dumps(self.plain(), indent=2, allow_nan=False) + "\n")


def failures(rows: Sequence[Mapping[str, Any]]) -> tuple[Failure, ...]:
    """Days that failed, by outcome and cause, the most frequent first.

    Args:
        rows: of `results.parquet`, those of which the claim does not hold.
    """
    alike: dict[tuple[str, str], list[int]] = {}
    for row in rows:
        cause = row.get("trackability.causes") or row.get("check.verdict") or ""
        alike.setdefault((str(row["outcome"]), str(cause)), []).append(int(row["run"]))
    ordered = sorted(alike.items(), key=lambda each: -len(each[1]))
    return tuple(Failure(*key, len(runs), tuple(runs[:FIRST_FAILURES])) for key, runs in ordered)
