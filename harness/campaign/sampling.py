"""Random values: what a campaign may draw a key from.

Every value comes from a number in [0, 1) through the inverse of its distribution.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from statistics import NormalDist
from typing import Annotated, Any, Final

from pydantic import ConfigDict, Field, Strict, field_validator, model_validator

from harness.files.strict_yaml import Loc
from harness.scenario.scenario import scenario_schema
from harness.scenario.sections import Section

LEAST: Final = 1e-12
"""Nearest to 0 and 1 that a normal distribution is asked for its inverse: 7 standard deviations off."""

Number = Annotated[float, Field(ge=-1e12, le=1e12)]


class Normal(Section):
    """A Gaussian, cut off where limits are given: what lies beyond them is not drawn."""

    mean: Number
    """Mean, before it is cut off."""
    sigma: Annotated[Number, Field(gt=0)]
    """Standard deviation, before it is cut off."""
    least: Number | None = None
    """Nothing below this is drawn. Default: no limit."""
    most: Number | None = None
    """Nothing above this is drawn. Default: no limit."""

    @model_validator(mode="after")
    def _leaves_something(self) -> Normal:
        low, high = self.limits
        if not high - low > LEAST:
            raise ValueError("leaves nothing between least and most; must be least < most, not far from mean")
        return self

    @property
    def limits(self) -> tuple[float, float]:
        """Probabilities of a value below `least` and of one below `most`."""
        bell = NormalDist(self.mean, self.sigma)
        low = 0.0 if self.least is None else bell.cdf(self.least)
        return low, 1.0 if self.most is None else bell.cdf(self.most)


class Distribution(Section):
    """What a key is drawn from: exactly one of the forms."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": [name]} for name in ("uniform", "normal", "choice")]}
    )

    uniform: Annotated[tuple[Number, Number], Strict(False)] | None = None
    """Evenly between two numbers; of a key that takes whole ones alone, both ends are drawn as often as the others."""
    normal: Normal | None = None
    """A Gaussian."""
    choice: Annotated[tuple[Any, ...] | None, Strict(False), Field(min_length=1)] = None
    """One of these values, of any kind, each as likely as the others."""

    @field_validator("uniform")
    @classmethod
    def _in_order(cls, uniform: tuple[float, float] | None) -> tuple[float, float] | None:
        if uniform and not uniform[0] < uniform[1]:
            raise ValueError(f"is {list(uniform)}; must be [least, most] with least < most")
        return uniform

    @model_validator(mode="after")
    def _has_one_form(self) -> Distribution:
        given = [name for name in ("uniform", "normal", "choice") if getattr(self, name) is not None]
        if len(given) != 1:
            have = " and ".join(given) if given else "none"
            raise ValueError(f"has {have} of uniform, normal, choice; must have exactly one")
        return self

    def number(self, share: float) -> float:
        """The value below which `share` of the draws lie; only without a choice."""
        if self.uniform:
            low, high = self.uniform
            return min(low + (high - low) * share, high)
        assert self.normal
        low, high = self.normal.limits
        reached = min(max(low + (high - low) * share, LEAST), 1.0 - LEAST)
        drawn = NormalDist(self.normal.mean, self.normal.sigma).inv_cdf(reached)
        least = drawn if self.normal.least is None else max(drawn, self.normal.least)
        return least if self.normal.most is None else min(least, self.normal.most)

    def whole_number(self, share: float) -> int:
        """The same for a key that takes whole numbers alone."""
        if not self.uniform:
            return round(self.number(share))
        low, high = map(int, self.uniform)
        return low + min(int((high - low + 1) * share), high - low)

    def ends(self) -> list[tuple[Loc, float]]:
        """Where it begins and ends, as far as that is given, and where in it that is said."""
        if self.uniform:
            return [(("uniform", index), end) for index, end in enumerate(self.uniform)]
        limits = {"least": self.normal.least, "most": self.normal.most} if self.normal else {}
        return [(("normal", name), end) for name, end in limits.items() if end is not None]

    def chosen(self, share: float) -> int:
        """Index of the choice that a number in [0, 1) stands for."""
        assert self.choice
        return min(int(share * len(self.choice)), len(self.choice) - 1)


def takes_whole_numbers(loc: Loc) -> bool:
    """Whether a key takes whole numbers and no others; of planners' own keys, of any planner's that has it."""
    schema = _schema()
    found = [schema]
    for step in loc:
        found = [inner for each in found for inner in _inside(each, step, schema["$defs"])]
    return any(each.get("type") == "integer" for each in found)


@cache
def _schema() -> dict[str, Any]:
    return scenario_schema()


def _inside(schema: Mapping[str, Any], step: str | int, definitions: Mapping[str, Any]) -> Iterator[Any]:
    """What stands at a step in any variant of a schema, variants of it one by one."""
    for variant in _variants(schema, definitions):
        inner = variant.get("properties", {}).get(step) if isinstance(step, str) else variant.get("items")
        if isinstance(inner, Mapping):
            yield from _variants(inner, definitions)


def _variants(schema: Mapping[str, Any], definitions: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """A schema, or those that it refers to or chooses from."""
    if "$ref" in schema:
        yield from _variants(definitions[schema["$ref"].rsplit("/", 1)[-1]], definitions)
        return
    chosen = [*schema.get("anyOf", ()), *schema.get("oneOf", ())]
    for each in chosen:
        yield from _variants(each, definitions)
    if not chosen:
        yield schema
