"""The table at the end of `wayproof falsify`."""

from __future__ import annotations

from collections.abc import Sequence

from harness.cli.terminal import plain
from harness.falsify.breaking_point import Breaking
from harness.falsify.keys import number_text
from harness.files.wording import counted


def breaking_rows(breaking: Breaking) -> dict[str, str]:
    """Name and value of each row. Values are printed as they were flown, never rounded."""
    found, wanted = breaking.found, "trackable" if breaking.until == "untrackable" else "reached"
    flights = len(breaking.trials)
    told = f", {counted(flights, 'flight')}" if flights != breaking.conditions else ""
    rows = {"tried": counted(breaking.conditions, "condition") + told}
    for each in breaking.vary:
        rows[plain(each.key)] = f"{number_text(each.mild)} (mild) to {number_text(each.hard)} (hard)"
    if found is None:
        rows["mildest found"] = f"none: every condition tried was {wanted}"
    else:
        share = max(found.displacement)
        rows["mildest found"] = (
            f"[bold red]{_values(breaking, found.values)}[/], {share:.1%} of the way"
            if share
            else "[bold red]already at the mild end[/]"
        )
        rows["how it failed"] = plain(
            f"{found.figures['outcome']}: {found.figures['reason']}, seed {found.seed}"
        )
    if breaking.passes is not None:
        rows["passes below"] = f"at {_values(breaking, breaking.passes)}"
    if found is None or max(found.displacement):
        rows["scan"] = (
            f"{counted(breaking.steps, 'equal step')} of {1.0 / breaking.steps:.2%}; a narrower failing range may have "
            "been missed, more --runs make the steps finer"
        )
    if not breaking.settled:
        rows["not settled"] = "the conditions ran out first; give more with --runs"
    return rows


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
