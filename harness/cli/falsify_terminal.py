"""The table at the end of `wayproof falsify`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from harness.cli.terminal import plain
from harness.falsify.breaking_point import Breaking
from harness.falsify.keys import number_text
from harness.files.wording import counted

MOST_BANDS: Final = 12
"""Most neighbouring bands of outcomes that are listed; the rest is in `falsify.csv`."""


def breaking_rows(breaking: Breaking) -> dict[str, str]:
    """Name and value of each row. Values are printed as they were flown, never rounded."""
    found, wanted = breaking.found, "trackable" if breaking.until == "untrackable" else "reached"
    rows = {"tried": _tried(breaking)}
    for each in breaking.vary:
        rows[plain(each.key)] = f"{number_text(each.mild)} (mild) to {number_text(each.hard)} (hard)"
    if found is None:
        rows["mildest found"] = f"none: every condition tried was {wanted}"
    elif breaking.verdict == "fails_at_the_mild_end":
        rows["mildest found"] = "[bold red]already at the mild end[/]"
    else:
        share = max(found.displacement)
        rows["mildest found"] = f"[bold red]{_values(breaking, found.values)}[/], {share:.1%} of the way"
    if found is not None:
        rows["how it failed"] = plain(f"{found.outcome}: {found.reason}, seed {found.seed}")
    if breaking.passes is not None:
        rows["passes below"] = f"at {_values(breaking, breaking.passes)}; {_milder(breaking)}"
    if breaking.passes_above is not None:
        rows["passes above"] = f"at {_values(breaking, breaking.passes_above)}, which is harder"
    if len(breaking.vary) == 1:
        rows |= _of_one_key(breaking)
    elif breaking.example is not None:
        milder, harder = breaking.example
        rows["not monotone"] = (
            f"fails at {_values(breaking, milder)} but passes at {_values(breaking, harder)}, which is harder; "
            f"{counted(breaking.not_monotone, 'such pair')}: a milder failure may be left between what was tried"
        )
    if not breaking.settled:
        rows["not settled"] = "the conditions ran out first; give more with --runs"
    return rows


def _tried(breaking: Breaking) -> str:
    flights = len(breaking.trials)
    told = f", {counted(flights, 'flight')}" if flights != breaking.conditions else ""
    if breaking.conditions < breaking.allowed and breaking.verdict != "fails_at_the_mild_end":
        told += f" of {breaking.allowed} allowed: none is left to try that differs by more than the tolerance"
    return counted(breaking.conditions, "condition") + told


def _milder(breaking: Breaking) -> str:
    """What became of the conditions milder than the failure, none of which failed."""
    if breaking.milder == 1:
        return "no other milder condition was tried"
    if len(breaking.vary) > 1:
        return f"so do all {breaking.milder} conditions tried of which the hardest key is milder"
    return f"so do all {breaking.milder} milder conditions that were tried"


def _of_one_key(breaking: Breaking) -> dict[str, str]:
    """What was tried of one key, whole, and where nothing was."""
    told = [
        f"{'fails' if band.failed else 'passes'} {_stretch(band.mildest, band.hardest)} ({band.conditions})"
        for band in breaking.bands
    ]
    if len(told) > MOST_BANDS:
        told[MOST_BANDS:] = [f"{len(told) - MOST_BANDS} more such stretches in falsify.csv"]
    rows = {"in order": ", ".join(told)}
    if breaking.widest_gap is not None:
        low, high = breaking.widest_gap
        where = "" if breaking.found is None else " below the failure"
        rows["widest untried gap"] = f"{number_text(low)} to {number_text(high)}{where}"
    return rows


def _stretch(mildest: float, hardest: float) -> str:
    if mildest == hardest:
        return number_text(mildest)
    return f"{number_text(mildest)} to {number_text(hardest)}"


def last_line(breaking: Breaking) -> str:
    """What came of it, in a sentence."""
    if breaking.found is None:
        return f"not falsified: nothing failed in {counted(len(breaking.trials), 'flight')}"
    if breaking.verdict == "fails_at_the_mild_end":
        return "falsified: it fails already at the mild end"
    keys = ", ".join(
        f"{each.key}={number_text(value)}"
        for each, value in zip(breaking.vary, breaking.found.values, strict=True)
    )
    return f"falsified: {keys}, the mildest found in {counted(breaking.conditions, 'condition')}"


def _values(breaking: Breaking, values: Sequence[float]) -> str:
    """A condition; with several keys, each value with its key."""
    if len(values) == 1:
        return number_text(values[0])
    pairs = zip(breaking.vary, values, strict=True)
    return ", ".join(plain(f"{each.key} {number_text(value)}") for each, value in pairs)
