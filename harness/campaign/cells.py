"""What `results.parquet` says of a run before it is flown, and the columns of the keys that a campaign varies."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from harness.campaign.campaign_file import CampaignFile
from harness.files.strict_yaml import Scalar


@dataclass(frozen=True)
class PlannedRun:
    """One run of a campaign, before it is flown.

    Attributes:
        run: its number.
        case: runs of one case fly the same world with the same seed and draws.
        scenario: name of the scenario.
        world: name of its file, or of the generator.
        planner: kind.
        aircraft: model.
        seed: the scenario's.
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
        del about["varied"]
        return {**about, **self.varied}


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


def entry_columns(file: CampaignFile) -> dict[str, tuple[Scalar, ...]]:
    """What each entry of `planners` and of `aircraft` gives for the keys that any of them gives, by key path.

    Args:
        file: the campaign.

    Returns:
        One cell an entry, in order; None where it does not give the key.
    """
    columns: dict[str, tuple[Scalar, ...]] = {}
    for listed, section, first in (("planners", "planner", "kind"), ("aircraft", "aircraft", "model")):
        entries = file.root.plain().get(listed, ())
        given: list[dict[str, Any]] = [each if isinstance(each, dict) else {} for each in entries]
        for name in dict.fromkeys(name for each in given for name in each if name != first):
            values = [each.get(name) for each in given]
            kind = kind_of(values)
            cells = (None if value is None else cell_of(value, kind) for value in values)
            columns[f"{section}.{name}"] = tuple(cells)
    return columns
