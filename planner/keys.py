"""The keys of a planner's config: default, sentence, unit and bounds of each."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Self

from planner.geometry.clearance import margin_of
from planner.interface import Mission


def key(default: object, doc: str, unit: str = "1", **bounds: float) -> Any:
    """A field of a frozen dataclass with the metadata of `PlannerKind.config`; bounds: minimum, maximum, above."""
    return field(default=default, metadata={"doc": doc, "unit": unit, **bounds})


@dataclass(frozen=True)
class MarginConfig:
    """The key that all planners have, and the only one of most."""

    margin_m: float | None = key(
        None,
        "planned distance beyond the clearance; default: 0.1 of the clearance, at least twice the tracking error",
        "m",
        minimum=0.0,
    )

    def margin(self, mission: Mission) -> float:
        """The margin (m), derived where none is given."""
        return margin_of(mission) if self.margin_m is None else self.margin_m

    def resolved(self, mission: Mission) -> Self:
        """This config with every None replaced by its default for the mission."""
        return replace(self, margin_m=self.margin(mission))
