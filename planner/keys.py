"""The keys of a planner's config: default, sentence, unit and bounds of each."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Self

from planner.interface import Mission

MARGIN_SHARE = 0.1  # the default margin beyond the clearance is at least this share of the clearance
MARGIN_ERRORS = 2.0
"""The default margin is at least this many times the tracking error of the aircraft in tight turns."""


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
        default_m = max(MARGIN_SHARE * mission.clearance_m, MARGIN_ERRORS * mission.tracking_error_m)
        return default_m if self.margin_m is None else self.margin_m

    def resolved(self, mission: Mission) -> Self:
        """This config with every None replaced by its default for the mission."""
        return replace(self, margin_m=self.margin(mission))
