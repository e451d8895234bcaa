"""The commands about what can be given to others: `list` names it, `validate` and `schema` are about files."""

from __future__ import annotations

import os
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import typer

from harness.cli.command_line import BAD_INPUT, load, print_json, world_notes
from harness.cli.options import argument
from harness.cli.terminal import say, step_bar
from harness.files.input_file import InputError

_AIRCRAFT_ROW: Final = "{:13} {:>7} {:>10} {:>6} {:>6} {:6} "
_WIDTH: Final = 80  # width of printed lines, in letters
IN_FILES: Final = {"km": "m", "%": "share", "1/km": "1/m"}  # units in files of what tables show in these
WHAT_HELP: Final = "planners, aircraft, guidance, scenarios, worlds, campaigns or metrics."


def list_names(what: Annotated[str, argument("WHAT", WHAT_HELP)]) -> int:
    """Prints the names that a scenario or a command can use; for planners and guidance laws also their keys.

    `list aircraft` first measures, in flight, each aircraft that is new to this machine: about a minute for all. The
    figures are kept.

    For example: wayproof list planners
    """
    from harness.scenario.kinds import guidance_kinds, planner_kinds
    from harness.scenario.shipped import shipped_campaigns, shipped_scenarios

    lists: dict[str, Callable[[], Iterator[str]]] = {
        "planners": lambda: _kinds(planner_kinds()),
        "aircraft": _aircraft,
        "guidance": lambda: _kinds(guidance_kinds()),
        "scenarios": lambda: _files(shipped_scenarios()),
        "worlds": _worlds,
        "campaigns": lambda: _files(shipped_campaigns()),
        "metrics": _metrics,
    }
    if what not in lists:
        raise typer.BadParameter(f"{what[:60]!r} is not one of {', '.join(lists)}", param_hint="WHAT")
    for line in lists[what]():
        say(line)
    return 0


def _files(files: Mapping[str, Path]) -> Iterator[str]:
    width = max(map(len, files), default=0)
    return (_fold(f"{name:{width}}  ", summary(path)) for name, path in files.items())


def summary(path: Path) -> str:
    """Returns what a scenario is for: the first line of the comment it begins with, the one for editors left out."""
    with path.open(encoding="utf-8") as file:
        first = next(line for line in file if not line.startswith("# yaml-language-server:"))
    return first.lstrip("# ").rstrip()


def _fold(head: str, text: str) -> str:
    """Folds a text under its own beginning where a terminal is too narrow for it."""
    if not sys.stdout.isatty():
        return head + text
    room = max(shutil.get_terminal_size().columns - len(head), 20)
    return head + f"\n{' ' * len(head)}".join(textwrap.wrap(text, room))


def _metrics() -> Iterator[str]:
    """Yields a text for each figure of a flight that people are shown: name, place in `metrics.json`, unit, meaning."""
    from harness.analysis.registry import METRICS

    for metric in METRICS:
        if metric.title:
            unit = f" [{IN_FILES.get(metric.unit, metric.unit)}]" if metric.unit else ""
            hint = f": {metric.hint}" if metric.hint else ""
            place = f" ({metric.path})" if metric.path != metric.name and not metric.derived else ""
            yield _fill(f"{metric.name}{place}: {metric.title}{unit}{hint}")


def _fill(text: str, begin: str = "") -> str:
    return textwrap.fill(text, _WIDTH, initial_indent=begin, subsequent_indent=f"{2 * begin}  ")


def _worlds() -> Iterator[str]:
    """Yields a row for each family of benchmark worlds: how many, the first one's name, its source and licence."""
    from harness.scenario.shipped import shipped_worlds

    families: dict[str, list[str]] = {}
    worlds = shipped_worlds()
    for name in worlds:
        families.setdefault(name.partition("/")[0], []).append(name)
    for family, names in families.items():
        source = summary(worlds[names[0]]).replace(", see ../LICENCES.md", "")
        yield _fold(f"{family:15} {len(names):3}  ", f"{names[0]}: {source}")


def _kinds(kinds: Mapping[str, Any]) -> Iterator[str]:
    """Yields every planner, or law, with its own keys: default, unit, meaning."""
    for name, kind in kinds.items():
        yield _fill(f"{name}: {kind.summary}")
        for own in fields(kind.config):
            unit = own.metadata.get("unit") or "1"
            suffix = "" if unit == "1" else f" {unit}"
            value = "derived" if own.default is None else own.default
            default = f"{value:g}" if isinstance(value, float) else str(value).lower()
            yield _fill(f"{own.name} = {default}{suffix}: {own.metadata.get('doc', '')}", "  ")


def _aircraft() -> Iterator[str]:
    from aircraft.airframes import AircraftError, aircraft_names, airframe, is_surveyed
    from aircraft.envelope import performance
    from planner.kernel_cache import seal

    names = aircraft_names()
    if new := [name for name in names if not is_surveyed(name)]:
        seal()
        many = f"{len(new)} aircraft are" if len(new) > 1 else f"{new[0]} is"
        say(f"{many} flown for the figures, once; some seconds each", err=True)
    heads = ("name", "mass kg", "speed m/s", "cruise", "turn m", "tested")
    rows = [_fold(_AIRCRAFT_ROW.format(*heads), "what")]
    with step_bar(silent=not new) as report:
        for done, name in enumerate(names):
            report(done, len(names), name)
            try:
                frame = airframe(name)
                radius_m = performance(frame, frame.cruise_mps).turn_radius_m
            except AircraftError as error:
                rows.append(f"{name:13} cannot be flown: {error}")
                continue
            low, high = frame.airspeed_range_mps
            speeds = f"{low:g}-{high:g}", f"{frame.cruise_mps:g}"
            figures = f"{frame.mass_kg:.0f}", *speeds, f"{radius_m:.0f}", "yes" if frame.verified else "no"
            rows.append(_fold(_AIRCRAFT_ROW.format(name, *figures), frame.summary))
    return iter(rows)


def validate(
    files: Annotated[list[str], argument("FILE...", "Scenario or campaign files, or shipped names.")],
) -> int:
    """Checks scenario and campaign files without flying them; in a campaign, every run.

    For example: wayproof validate my_world.yaml paper_circles
    """
    status = 0
    for file in files:
        try:
            for line in _file_faults(file):
                say(line)
        except InputError as error:
            say(str(error), err=True)
            status = BAD_INPUT
    return status


def _file_faults(file: str) -> list[str]:
    """Returns what a valid file holds, and a line for what of a scenario's obstacles is not as one expects."""
    from harness.campaign.campaign_file import is_a
    from harness.files.wording import counted
    from harness.scenario.shipped import campaign_path, shipped_campaigns

    if file in shipped_campaigns() or (os.path.isfile(file) and is_a("campaign", Path(file))):
        from harness.cli.sweep import checked

        runs = checked(campaign_path(file))
        held = f"{runs.campaign.name}, {counted(len(runs), 'run')} of {counted(runs.cases, 'case')}"
        return [f"{file}: {held}: valid"]
    loaded = load(file)
    from harness.world.motion_assumptions import outside_assumptions

    held = f"{loaded.name}, {counted(len(loaded.obstacles), 'obstacle')}"
    uncovered = [f"not covered by what the planner promises: {each}" for each in outside_assumptions(loaded)]
    return [f"{file}: {held}: valid", *(f"  {each}" for each in (*uncovered, *world_notes(loaded).values()))]


def schema(
    kind: Annotated[
        Literal["scenario", "campaign"], argument("FORMAT", "The file format.", show_default=True)
    ] = "scenario",
) -> int:
    """Prints the JSON Schema of a file format, for editors.

    For example: wayproof schema > scenario.schema.json
    """
    from harness.campaign.campaign_file import campaign_schema
    from harness.scenario.scenario import scenario_schema

    print_json(campaign_schema() if kind == "campaign" else scenario_schema())
    return 0
