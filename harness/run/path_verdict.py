"""The answer of a check as one sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from harness.analysis.breaches import Breach, Kept
from harness.files.wording import tallied


def verdict(figures: Mapping[str, Any], seen: Kept, drawn: bool, tolerance_m: float) -> tuple[bool, str]:
    """Whether a path can be flown as given, and a sentence that says so or why not.

    Args:
        figures: of the flight: outcome, reason, `trackable`, `trackability`.
        seen: what was touched and crossed.
        drawn: the path is to be flown as drawn; else it is a mission, whose corners may be cut.
        tolerance_m: what the aircraft may be off.
    """
    bad = [leg for leg in figures["trackability"] if not leg["trackable"]]
    faults = [_first(seen.contacts, "touches")] if seen.contacts else []
    for kind, verb in (("exclusion", "enters"), ("inclusion", "leaves"), ("area", "leaves")):
        crossed = [each for each in seen.crossings if each.kind == kind]
        faults += [_first(crossed, verb)] if crossed else []
    if bad:
        faults.append(tallied([leg["cause"] for leg in bad], "legs"))
    if figures["outcome"] not in ("reached", "collision"):
        faults.append(str(figures["reason"]))
    if not faults and not figures["trackable"]:
        faults.append("no leg was flown")
    if faults:
        return False, "no: " + "; ".join(faults)
    how = "as drawn" if drawn else "with its corners cut by no more than allowed"
    return True, f"yes: flown {how}, within {tolerance_m:.3g} m"


def _first(found: Sequence[Breach], verb: str) -> str:
    """The first of some breaches, and how many more there are."""
    first = found[0]
    more = f", {len(found) - 1} more" if len(found) > 1 else ""
    return f"{verb} {first.name} at {first.start_s:.0f} s, by {first.depth_m:.3g} m{more}"
