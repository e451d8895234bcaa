"""What `results.parquet` says of a run before it is flown."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from harness.files.strict_yaml import Scalar


@dataclass(frozen=True)
class PlannedRun:
    """One run of a campaign, before it is flown.

    Attributes:
        case: runs of one case fly the same world with the same seed and draws.
        world: name of its file, or of the generator.
        varied: grid and drawn values, and those of its entries, by key path; lists and mappings as JSON text.
    """

    run: int
    case: int
    scenario: str
    world: str
    planner: str
    aircraft: str
    seed: int
    varied: dict[str, Scalar]

    def cells(self) -> dict[str, Scalar]:
        """Its first columns in `results.parquet`."""
        about = asdict(self)
        return {**about, **about.pop("varied")}


def kind_of(values: Sequence[Any]) -> str:
    """What a column of these values holds, nulls aside."""
    kinds = {type(value) for value in values if value is not None}
    for name, of in (("bool", {bool}), ("int", {int}), ("number", {int, float}), ("text", {str})):
        if kinds <= of:
            return name
    return "json"


def cell_of(value: Any, kind: str) -> Scalar:
    """A value as its column has it."""
    if kind == "json":
        return json.dumps(value)
    return float(value) if kind == "number" and value is not None else value
