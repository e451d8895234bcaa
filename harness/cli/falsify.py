"""The command `falsify`: the mildest condition that makes a run fail."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from harness.cli.command_line import distinct_suffix, interruptible, load, print_json
from harness.cli.options import Json, Out, Quiet, ScenarioArgument, option
from harness.cli.replacing import NOTHING, Given, replacing
from harness.cli.terminal import plain, print_table, say, step_bar
from harness.files.wording import counted

if TYPE_CHECKING:
    from harness.falsify.breaking_point import Breaking
    from harness.scenario.scenario import Scenario

Claim = Literal["reached", "no-contact", "trackable"]


@replacing("planner", "aircraft", "guidance", "conditions", "wind", "turbulence", "seed", "settings")
def falsify(
    scenario: ScenarioArgument,
    vary: Annotated[list[str], option("KEY.PATH=LO:HI", "From the mild end LO to HI; can be repeated.")],
    given: Given = NOTHING,
    claim: Annotated[Claim, option("CLAIM", "What fails to hold: reached, no-contact or trackable.")] = "reached",
    runs: Annotated[int, option("N", "Number of flights at most.", min=2)] = 40,
    tolerance: Annotated[float, option("SHARE", "Precision, as a share of each range.")] = 0.01,
    out: Out = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Searches for the mildest condition that makes a flight fail, and writes it as a scenario.

    The answer is the mildest failure found. A scan in equal steps finds it; a failing range narrower than a step may be
    missed, and more --runs make the steps finer.

    LO is the mild end; LO > HI if smaller is harder; a direction about north is 300:420. Several keys get harder
    together, each by the same share.

    For example: wayproof falsify aerosonde_forest --vary environment.wind.speed_mps=0:20

    Exit status:
    0 searched, with or without a failure; the last line says which
    2 bad input or usage, nothing written
    """
    if not 0.0 < tolerance < 1.0:
        raise typer.BadParameter(f"is {tolerance:g}; must be between 0 and 1", param_hint="--tolerance")
    from harness.falsify.breaking_point import FALSIFIED, vary_of
    from harness.falsify.breaking_point import falsify as search
    from harness.scenario.kinds import source_words

    ranges = [range_of(text) for text in vary]
    given.check_beside(key for key, *_ in ranges)

    def loaded(replaced: Any) -> Scenario:
        return load(scenario, [*given.keys, *replaced])

    varied = vary_of(loaded, ranges, tolerance)
    # Indices as `--set` takes them, which no shell takes for a pattern.
    keys = "-".join(["falsify", *(each.key.replace("[", ".").replace("]", "") for each in varied)])
    folder = out or Path("runs") / loaded(()).name / f"{keys}{distinct_suffix(given.keys, named=())}"
    with interruptible(lambda: "nothing was written"), step_bar(quiet) as bar:
        found = search(loaded, varied, folder, claim=claim, conditions=runs, tolerance=tolerance, progress=bar)
    if as_json:
        print_json(found.plain())
    elif not quiet:
        print_table(f"{found.scenario}: {found.planner}, {found.aircraft}", breaking_rows(found))
        if found.found is not None:
            words = ["wayproof", "fly", str(folder / FALSIFIED), *source_words(given.planner, given.guidance)]
            say(f"again: {shlex.join(words)}")
        say(last_line(found))
    return 0


def range_of(text: str) -> tuple[str, float, float]:
    """Splits KEY.PATH=LO:HI into its three parts; a BadParameter says that it is something else, or no range."""
    key, equals, ends = text.partition("=")
    low, colon, high = ends.partition(":")
    try:
        mild, hard = float(low), float(high)
    except ValueError:
        mild = hard = math.nan
    if not (key.strip() and equals and colon and math.isfinite(mild) and math.isfinite(hard)):
        raise typer.BadParameter(f"{text[:60]!r} is not KEY.PATH=LO:HI with two numbers", param_hint="--vary")
    return key.strip(), mild, hard


def breaking_rows(breaking: Breaking) -> dict[str, str]:
    """Returns name and value of each row. Values are printed as they were flown, never rounded."""
    from harness.falsify.breaking_point import number_text

    def joined(values: Sequence[float]) -> str:
        if len(values) == 1:
            return number_text(values[0])
        pairs = zip(breaking.vary, values, strict=True)
        return ", ".join(plain(f"{each.key} {number_text(value)}") for each, value in pairs)

    found = breaking.found
    rows = {"tried": counted(breaking.conditions, "condition")}
    for each in breaking.vary:
        rows[plain(each.key)] = f"{number_text(each.mild)} (mild) to {number_text(each.hard)} (hard)"
    share = breaking.displacement or 0.0
    if found is None:
        rows["mildest found"] = f"none: every condition tried was {breaking.claim}"
    else:
        values = f"[bold red]{joined(found.values)}[/], {share:.1%} of the way"
        rows["mildest found"] = values if share else "[bold red]already at the mild end[/]"
        untracked = "not every leg was tracked; " if found.figures["outcome"] == "reached" else ""
        how = f"{untracked}{found.figures['outcome']}: {found.figures['reason']}, seed {breaking.seed}"
        rows["how it failed"] = plain(how)
    if breaking.passes is not None:
        rows["passes below"] = f"at {joined(breaking.passes)}"
    if found is None or share:
        rows["scan"] = (
            f"{counted(breaking.steps, 'equal step')} of {1.0 / breaking.steps:.2%}; a narrower failing range may have "
            "been missed, more --runs make the steps finer"
        )
    if not breaking.settled:
        rows["not settled"] = "the conditions ran out first; give more with --runs"
    return rows


def last_line(breaking: Breaking) -> str:
    """Returns the result in a sentence."""
    from harness.falsify.breaking_point import number_text

    if breaking.found is None:
        return f"not falsified: nothing failed in {counted(breaking.conditions, 'flight')}"
    if breaking.verdict == "fails_at_the_mild_end":
        return "falsified: it fails already at the mild end"
    pairs = zip(breaking.vary, breaking.found.values, strict=True)
    keys = ", ".join(f"{each.key}={number_text(value)}" for each, value in pairs)
    return f"falsified: {keys}, the mildest found in {counted(breaking.conditions, 'condition')}"
