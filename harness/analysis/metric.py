"""What is known of a figure of a flight, how bad an outcome is, and what may be claimed of a flight."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

if TYPE_CHECKING:
    from harness.analysis.flight_limits import FlightLimits
    from harness.flight.record import Flight

Claim: TypeAlias = Literal["reached", "no-contact", "trackable", "as-given"]
UNKNOWN_AFTER: Final = ("collision", "lost_control", "planner_failed", "error")
"""Outcomes after which nobody can say that nothing is touched: `no-contact` does not hold."""
LEAST_MARGIN: Final = 1e-9  # a claim that holds has at least this margin, whatever its figure says
CROSSED: Final = {"exclusion": "enters", "inclusion": "leaves", "area": "leaves"}
"""What an aircraft does to cross the line of a breach of that kind; obstacles and terrain it touches."""
MISSED: Final = "end or a corner missed"  # why a given path of which every leg was tracked was not
ERROR: Final = "error"
"""Outcome of a flight whose software failed before its end; the other outcomes are those of `metrics.json`."""
SEVERITY: Final[Mapping[str, float]] = {
    **{"collision": 8.0, "lost_control": 7.0, "out_of_bounds": 6.0, "planner_failed": 5.0},
    **{ERROR: 4.0, "timeout": 3.0, "unreachable": 2.0, "reached": 0.0},
}
"""How bad an outcome is, the worst first. A flight that reached its goal and was not tracked, or came nearer to an
obstacle than was wanted, has 1."""


@dataclass(frozen=True)
class Metric:
    """One figure of a flight."""

    name: str  # its column in a comparison and its property in a recording; ends in its unit
    title: str = ""  # its name for people, without the unit; empty for a figure that only programs read
    unit: str = ""  # unit of the value shown, that is after `factor`; empty for a figure without a unit
    short: str = ""
    """Heading of its column on a terminal, a few letters; empty for a figure that stands in no table for people."""
    path: str = ""
    """Its place in `metrics.json`, dots between the levels, and its column in a campaign; default: `name`."""
    kind: Literal["number", "int", "bool", "text"] = "number"  # type of the value
    factor: float = 1.0  # the value in the file times this is the value shown
    digits: int | None = None  # decimals of the value shown; None: three or four significant digits
    worse: Literal["more", "less", ""] = ""
    """Whether a larger or a smaller value is worse; empty where neither is."""
    hint: str = ""  # what the figure means, where the title does not say it
    rare: bool = False  # a table for people has this column only if at least one flight has a value
    derived: bool = False
    """The figure is computed from the world or the aircraft too, not from `metrics.json` alone."""
    timed: bool = False
    """The figure depends on the speed of the machine, and so is not among the results of a campaign."""
    recorded: bool = False  # the figure is a property of recordings
    heading: str = ""
    """Heading of its column in the viewer's table of runs; empty for a figure that is not shown there."""
    get: Callable[[Mapping[str, Any]], Any] | None = None
    """Takes the value from the content of `metrics.json`; None: the value at `path`."""
    of: Callable[[Flight, FlightLimits], Any] | None = None
    """Computes the value from a flight and its limits; None for a figure that `harness.analysis.metrics` computes."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", self.path or self.name)

    @property
    def label(self) -> str:
        """The title with its unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title

    @property
    def recorded_as(self) -> str:
        """Its name among the properties of a recording, which hold percent in place of shares."""
        return self.name.removesuffix("_fraction") + "_percent" if self.unit == "%" else self.name

    def value(self, metrics: Mapping[str, Any]) -> Any:
        """Its value in the content of `metrics.json`; None where there is none."""
        if self.get is not None:
            return self.get(metrics)
        found: Any = metrics
        for level in self.path.split("."):
            found = found.get(level) if isinstance(found, Mapping) else None
        return found

    def text(self, value: Any) -> str:
        """A value as people are shown it; empty where there is none."""
        if value is None:
            return ""
        if self.kind == "bool":
            return "yes" if value else "no"
        if self.kind in ("text", "int"):
            return str(value)[:12] if self.name == "digest" else str(value)
        return number(value, self.factor) if self.digits is None else f"{value * self.factor:.{self.digits}f}"


def number(value: float | None, factor: float = 1.0) -> str:
    """A value times a factor with three or four digits, below 0.001 with two; empty where there is none."""
    if value is None:
        return ""
    if abs(scaled := value * factor) < 1e-3:
        return "0" if scaled == 0 else f"{scaled:.1e}"
    return format(scaled, ".0f" if abs(scaled) >= 1000 else ".3g" if abs(scaled) < 100 else ".1f")


def round_length_m(most_m: float) -> float:
    """The longest of 1, 2, 5, 10, 20 ... m that is at most so long: of a scale bar."""
    decade = 10.0 ** math.floor(math.log10(most_m))
    return decade * max(step for step in (1, 2, 5) if step * decade <= most_m)


def how_bad(outcome: str) -> float:
    """Ranks how bad an outcome is; an unknown one counts as the mildest of those that did not reach the goal."""
    return SEVERITY.get(outcome, SEVERITY["unreachable"])


def holds(claim: Claim, metrics: Mapping[str, Any]) -> bool:
    """Whether a claim holds of one flight, by the content of its `metrics.json`.

    `reached`: without contact and inside the area. `no-contact`: nothing was touched, and the flight did not break off.
    `trackable`: goal reached and every leg tracked. `as-given`: as `wayproof check` judges a path, with no contact and
    no breach.
    """
    if claim == "reached":
        return bool(metrics["outcome"] == "reached")
    if claim == "no-contact":
        return metrics["outcome"] not in UNKNOWN_AFTER and not metrics.get("contact")
    if claim == "trackable":
        return metrics["outcome"] == "reached" and bool(metrics["trackable"])
    return bool(metrics.get("check", {}).get("ok"))


def cause_of(claim: Claim, metrics: Mapping[str, Any]) -> str:
    """Names why a claim does not hold of a flight, without times and figures; may be empty.

    Of a given path: what was touched first, as given also crossed first; else why legs were not tracked, or the first
    corner that was not kept.
    """
    for each in metrics.get("contacts") or (metrics.get("breaches") if claim == "as-given" else ()) or ():
        return f"{CROSSED.get(each['kind'], 'touches')} {each['name']}"
    corners = metrics.get("check", {}).get("corners", ())
    missed = [f"corner {each['waypoint']} not kept" for each in corners if not each["kept"]]
    return "; ".join(sorted({leg["cause"] for leg in metrics["trackability"] if leg["cause"]}) or missed[:1])


def margin(claim: Claim, metrics: Mapping[str, Any]) -> float | None:
    """Returns the margin by which a claim holds of a flight, by the content of its `metrics.json`; 0 if it does not.

    `no-contact`: least distance to an obstacle or fence (m). `trackable`, `as-given`: what is left, as a share, of the
    cross-track limit, or of a given path of the limit used most. None: no such figure, or no obstacle.
    """
    if not holds(claim, metrics):
        return 0.0
    if claim in ("reached", "no-contact"):
        left = metrics["min_clearance_m"] if claim == "no-contact" else None
    else:
        pairs = [(leg["max_cross_track_m"], leg["threshold_m"]) for leg in metrics["trackability"]]
        if check := metrics.get("check"):
            pairs = [(corner["most_off_m"], corner["allowed_cut_m"]) for corner in check["corners"]]
            pairs += [(check["limit_used"][name], 1.0) for name in ("off_path", "altitude")]
        left = 1.0 - max((off / allowed for off, allowed in pairs if off and allowed), default=0.0)
    return None if left is None else max(left, LEAST_MARGIN)
