"""The planner's section of a scenario."""

from __future__ import annotations

from typing import Any, Final, Literal

from pydantic import ConfigDict, model_validator

from harness.scenario.sections import MAX_COORDINATE_M, Section, key

SHIELDED: Final = "+shield"
"""What a planner's name ends with that is flown with the shield."""


class PlannerSpec(Section):
    """Which planner, and what it has to keep; the planner's own keys stand beside these."""

    # The own keys depend on the kind: `Scenario` holds them against the planner's config.
    model_config = ConfigDict(extra="allow")

    kind: str = key("A name that `wayproof list planners` prints.", default="rolling_window")
    clearance_m: float = key(
        "Wanted distance from every obstacle edge; the boundary must only not be crossed. Planners keep a fiftieth of "
        "the turn radius at the least.",
        unit="m",
        derived="the planned turn radius, rounded up to 10 m",
        ge=0,
        le=MAX_COORDINATE_M,
    )
    compute_latency_s: float = key(
        "A plan takes effect this much after the scan it used.", unit="s", default=0.0, ge=0, le=60
    )
    shield: Literal["none", "loiter"] = key(
        "loiter: a path is flown only as far as a turn from there has been seen to be free; none: as the planner gives "
        "it. A kind with +shield at its end means loiter.",
        derived="loiter for rolling_window, none for every other kind",
    )

    @model_validator(mode="before")
    @classmethod
    def _shield_of_kind(cls, data: Any) -> Any:
        """`kind: NAME+shield` as `kind: NAME, shield: loiter`."""
        if not isinstance(data, dict) or not str(data.get("kind", "")).endswith(SHIELDED):
            return data
        if data.get("shield", "loiter") != "loiter":
            raise ValueError(f"shield is {data['shield']}, and kind {data['kind']}")
        return {**data, "kind": data["kind"].removesuffix(SHIELDED), "shield": "loiter"}

    @property
    def label(self) -> str:
        """The kind, and whether it has another shield than usual: what tells flights of one kind apart."""
        told = {"none": "-bare"} if self.kind == "rolling_window" else {"loiter": SHIELDED}
        return self.kind + told.get(self.shield, "")

    @property
    def own(self) -> dict[str, Any]:
        """The planner's own keys."""
        return dict(self.__pydantic_extra__ or {})
