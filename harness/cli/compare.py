"""The command `compare`: planners side by side, and its table in 80 columns."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from harness.cli.command_line import FAILED, interruptible, leftover_text, load, print_json
from harness.cli.options import Json, NoRecording, Out, Text, Workers, argument, option
from harness.cli.replacing import NOTHING, Given, given_by, replacing
from harness.cli.terminal import coloured, plain, print_line, print_table, say, say_view, step_bar
from harness.files.errors import WriteError

if TYPE_CHECKING:
    from harness.analysis.rows import Row

LEGEND: Final = (
    "ratio: length over the optimum; clear: least clearance; κ·R: tightest planned curvature times the turn "
    "radius in this air, above 1 with less bank in reserve; tracks: all legs trackable; tse: total system error, m; "
    "p99: planner time"
)


@replacing("aircraft", "conditions", "wind", "turbulence", "seed", "settings")
def compare(
    scenarios: Annotated[list[str], argument("SCENARIO...", "Files or shipped names.")],
    planners: Annotated[str, option("A,B,...", "Kinds, in order; KIND+shield: under the shield.")],
    guidance: Annotated[Text, option("X,Y,...", "Kinds of guidance laws. Default: the scenario's.")] = None,
    given: Given = NOTHING,
    out: Out = None,
    workers: Workers = None,
    no_recording: NoRecording = False,
    as_json: Json = False,
) -> int:
    """Flies every planner (under every guidance law) through every scenario: table, figures, report, overlays.

    For example: wayproof compare paper_circles --planners rolling_window,bug2

    Exit status:
    0 every planner reached every goal
    1 one did not, or the software failed in a flight
    2 bad input or usage, nothing flown
    """
    from harness.comparison.comparison import INDEX, SCHEMA, fly_and_compare
    from harness.run_files.run_folder import OVERLAY
    from harness.scenario.conditions import conditions_text
    from harness.scenario.kinds import imported_sources

    kinds, laws = _split(planners), _split(guidance)
    texts = [f"{name}={value}" for name, value in given.settings]
    variants = [[*given_by(kind, law, settings=texts).options, *given.keys] for kind in kinds for law in laws]
    loaded = [load(scenario, each) for scenario in scenarios for each in variants]
    folder, numbers = out or Path("runs/comparison"), itertools.count(1)
    try:
        with interruptible(partial(leftover_text, folder, "comparison", INDEX, SCHEMA)), step_bar() as bar:
            comparison = fly_and_compare(
                loaded,
                folder,
                recording=not no_recording,
                workers=workers,
                sources=(imported_sources(*kinds), imported_sources(*laws)),
                progress=lambda text: bar(next(numbers), len(loaded), text),
            )
    except OSError as error:
        raise WriteError.of("the comparison", folder, error) from error
    if as_json:
        print_json(comparison.plain())
    else:
        print_comparison(comparison.rows, {each.name: conditions_text(each) for each in loaded})
        say(f"report: {folder / 'report.html'}")
        say_view(folder / each.name / OVERLAY for each in loaded)
    return 0 if comparison.all_reached else FAILED


def _split(names: str | None) -> list[str | None]:
    return [None] if names is None else [name.strip() for name in names.split(",")]


def print_comparison(rows: Sequence[Row], conditions: Mapping[str, str]) -> None:
    """Prints one table a scenario with its conditions, what the headings mean, and the errors of the software."""
    from harness.analysis.metric import ERROR

    for name in dict.fromkeys(row.scenario for row in rows):
        _print_scenario(name, conditions[name], [row for row in rows if row.scenario == name])
    print_line(LEGEND, style="dim")
    for row in rows:
        if row.outcome == ERROR:
            say(f"{row.label}, error: {row.reason}")


def _print_scenario(name: str, day: str, rows: Sequence[Row]) -> None:
    """Prints the rows of a scenario; those of one planner under several laws are called after the laws."""
    from harness.analysis.rows import DASH, ON_TERMINAL

    by_law = all(row.guidance for row in rows) and len({row.planner for row in rows}) == 1
    lines = []
    for row in rows:
        label = row.guidance if by_law else "\n ".join(filter(None, (row.planner, row.guidance)))
        figures = [plain(row.text(figure)) or DASH for figure in ON_TERMINAL[1:]]
        lines.append([plain(label), coloured(row.outcome), *figures])
    heads = ("guidance" if by_law else "planner", *(figure.short for figure in ON_TERMINAL))
    print_table(f"{name}{f', {rows[0].planner}' if by_law else ''}\nconditions: {day}", lines, heads)
