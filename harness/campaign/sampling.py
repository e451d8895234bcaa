"""Distributions from which a campaign may draw the value of a key.

Every value comes from a number in [0, 1) through the inverse of its distribution.
"""

from __future__ import annotations

from statistics import NormalDist
from typing import Annotated, Any, Final

from pydantic import ConfigDict, Field, Strict, model_validator

from harness.files.strict_yaml import Loc, node_of
from harness.scenario.scenario import Scenario
from harness.scenario.sections import Section, given
from harness.scenario.validation import KeyFault

LEAST_PROBABILITY: Final = 1e-12
"""The inverse of a normal distribution is taken no nearer to 0 and 1 than this, at 7 standard deviations."""
DIRECTION_ENDS: Final = ("from_deg", "course_deg", "heading_deg")  # keys that end so: 359 degrees is beside 0
FORMS: Final = ("uniform", "normal", "choice")  # keys of a distribution, of which exactly one is given

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
        if not high - low > LEAST_PROBABILITY:
            raise ValueError("leaves nothing between least and most; must be least < most, not far from mean")
        return self

    @property
    def limits(self) -> tuple[float, float]:
        """Probabilities of a value below `least` and of one below `most`."""
        bell = NormalDist(self.mean, self.sigma)
        low = 0.0 if self.least is None else bell.cdf(self.least)
        return low, 1.0 if self.most is None else bell.cdf(self.most)


class Distribution(Section):
    """The distribution that a key is drawn from: exactly one of the forms."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [given(name) for name in FORMS]})

    uniform: Annotated[tuple[Number, Number], Strict(False)] | None = None
    """Evenly between two numbers; of a key that takes whole ones alone, both ends are drawn as often as the others."""
    normal: Normal | None = None
    """A Gaussian."""
    choice: Annotated[tuple[Any, ...] | None, Strict(False), Field(min_length=1)] = None
    """One of these values, of any kind, each as likely as the others."""

    @model_validator(mode="after")
    def _has_one_form(self) -> Distribution:
        if len(given := [name for name in FORMS if getattr(self, name) is not None]) != 1:
            have = " and ".join(given) if given else "none"
            raise ValueError(f"has {have} of uniform, normal, choice; must have exactly one")
        if self.uniform and not self.uniform[0] < self.uniform[1]:
            raise KeyFault(("uniform",), f"is {list(self.uniform)}; must be [least, most] with least < most")
        return self

    def number(self, share: float) -> float:
        """Returns the value below which `share` of the draws lie; only without a choice."""
        if self.uniform:
            low, high = self.uniform
            return min(low + (high - low) * share, high)
        assert self.normal
        low, high = self.normal.limits
        reached = min(max(low + (high - low) * share, LEAST_PROBABILITY), 1.0 - LEAST_PROBABILITY)
        drawn = NormalDist(self.normal.mean, self.normal.sigma).inv_cdf(reached)
        least, most = self.normal.least, self.normal.most
        return min(max(drawn, drawn if least is None else least), drawn if most is None else most)

    def whole_number(self, share: float) -> int:
        """Returns the same for a key that takes whole numbers only, from a range that ends at whole numbers."""
        if not self.uniform:
            return round(self.number(share))
        low, high = map(int, self.uniform)
        return low + min(int((high - low + 1) * share), high - low)

    def value(self, key: str, share: float, whole: bool) -> float:
        """Returns what a key is drawn as, `as_flown`."""
        return as_flown(key, self.whole_number(share) if whole else self.number(share))

    @property
    def is_whole(self) -> bool:
        """Whether the ends that its range has are whole numbers."""
        normal = (self.normal.least, self.normal.most) if self.normal else ()
        return all(end is None or end.is_integer() for end in self.uniform or normal)

    def chosen(self, share: float) -> int:
        """Returns the index of the choice for a number in [0, 1)."""
        assert self.choice
        return min(int(share * len(self.choice)), len(self.choice) - 1)


def as_flown(key: str, number: float) -> float:
    """A number as a key takes it: a direction about north, such as 370 degrees, as one from 0 to 360."""
    return number % 360.0 if key.endswith(DIRECTION_ENDS) and not 0.0 <= number <= 360.0 else number


def takes_whole_numbers(scenario: Scenario, loc: Loc) -> bool:
    """Tells whether a key of a scenario takes whole numbers only: given a whole number, it still holds one."""
    node = node_of(scenario.model_dump(by_alias=True), 0).at(loc)
    return node is not None and type(node.value) is int
