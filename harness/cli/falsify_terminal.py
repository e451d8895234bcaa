"""The table at the end of `wayproof falsify`."""

from __future__ import annotations

from collections.abc import Sequence

from harness.cli.terminal import plain
from harness.falsify.breaking_point import Breaking
from harness.files.wording import counted


def breaking_rows(breaking: Breaking) -> dict[str, str]:
    """Name and value of each row."""
    found, wanted = breaking.found, "trackable" if breaking.until == "untrackable" else "reached"
    flights = len(breaking.trials)
    told = f", {counted(flights, 'flight')}" if flights != breaking.conditions else ""
    rows = {"tried": counted(breaking.conditions, "condition") + told}
    for each in breaking.vary:
        rows[plain(each.key)] = f"{_number(each.mild)} (mild) to {_number(each.hard)} (hard)"
    if found is None:
        rows["mildest failure"] = f"none: every condition tried was {wanted}"
    elif breaking.verdict == "fails_at_the_mild_end":
        rows["mildest failure"] = "[bold red]already at the mild end[/]"
    else:
        share = max(found.displacement)
        rows["mildest failure"] = f"[bold red]{_values(found.values)}[/], {share:.1%} of the way"
    if breaking.passes is not None:
        rows["passes at"] = _values(breaking.passes)
    if found is not None:
        rows["how it failed"] = plain(f"{found.outcome}: {found.reason}, seed {found.seed}")
    if breaking.example is not None:
        milder, harder = breaking.example
        rows["not monotone"] = (
            f"fails at {_values(milder)} but passes at {_values(harder)}, which is harder; {breaking.not_monotone} "
            "such pairs: somewhere below, a milder failure may be left"
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
        f"{each.key}={_number(value)}"
        for each, value in zip(breaking.vary, breaking.found.values, strict=True)
    )
    return f"falsified: {keys}"


def _values(values: Sequence[float]) -> str:
    return ", ".join(map(_number, values))


def _number(value: float) -> str:
    return f"{value:.6g}"
