"""What may be claimed of a flight, and whether a flight bears it out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal, TypeAlias, get_args

Claim: TypeAlias = Literal["reached", "no-contact", "trackable", "as-given"]

CLAIMS: Final[tuple[Claim, ...]] = get_args(Claim)

UNKNOWN_AFTER: Final = ("collision", "lost_control", "planner_failed", "error")
"""Outcomes after which nobody can say that nothing is touched: `no-contact` does not hold."""


def holds(claim: Claim, metrics: Mapping[str, Any]) -> bool:
    """Whether a claim holds of one flight, by the content of its `metrics.json`.

    `reached`: goal reached, without contact and inside the area. `no-contact`: nothing was touched, and the flight did
    not break off. `trackable`: goal reached and every leg tracked. `as-given`: a given path was flown as given, with no
    contact and no breach, as `wayproof check` judges it.
    """
    if claim == "reached":
        return bool(metrics["outcome"] == "reached")
    if claim == "no-contact":
        return metrics["outcome"] not in UNKNOWN_AFTER and not metrics.get("contact")
    if claim == "trackable":
        return metrics["outcome"] == "reached" and bool(metrics["trackable"])
    return bool(metrics.get("check", {}).get("ok"))
