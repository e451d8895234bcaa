"""The commands about what can be given: `validate`, `schema`, `list`."""

from __future__ import annotations

import os
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Literal

import typer

from harness.cli.options import BAD_INPUT, load, print_json
from harness.cli.standard_output import say


def validate(
    files: Annotated[
        list[str], typer.Argument(metavar="FILE...", help="Scenario or campaign files, or shipped names.")
    ],
) -> int:
    """Checks scenario and campaign files without flying them; of a campaign, every run.

    For example: wayproof validate my_world.yaml paper_circles
    """
    from harness.files.strict_yaml import InputError

    status = 0
    for file in files:
        try:
            found = _found(file)
        except InputError as error:
            say(str(error), err=True)
            status = BAD_INPUT
        else:
            say(f"{file}: {found}: valid")
    return status


def _found(file: str) -> str:
    """What a valid file holds, in a few words."""
    from harness.campaign.campaign_file import is_campaign
    from harness.files.wording import counted
    from harness.scenario.shipped import campaign_path, shipped_campaigns

    if file in shipped_campaigns() or (os.path.isfile(file) and is_campaign(Path(file))):
        from harness.cli.sweep import checked

        runs = checked(campaign_path(file))
        return f"{runs.campaign.name}, {counted(len(runs), 'run')} of {counted(runs.cases, 'case')}"
    loaded = load(file)
    return f"{loaded.name}, {counted(len(loaded.obstacles), 'obstacle')}"


def schema(
    kind: Annotated[
        Literal["scenario", "campaign"], typer.Argument(help="The file format.", show_default=True)
    ] = "scenario",
) -> int:
    """Prints the JSON Schema of a file format, for editors.

    For example: wayproof schema > scenario.schema.json
    """
    if kind == "campaign":
        from harness.campaign.campaign_file import campaign_schema

        print_json(campaign_schema())
    else:
        from harness.scenario.scenario import scenario_schema

        print_json(scenario_schema())
    return 0


def list_names(
    what: Annotated[
        Literal["planners", "aircraft", "guidance", "scenarios"], typer.Argument(help="Of what.")
    ],
) -> int:
    """Prints the names that a scenario or a command can use.

    Aircraft that have not been flown here before are flown for their figures, which takes about a second each.

    For example: wayproof list planners
    """
    from harness.cli.terminal import print_columns

    if what == "aircraft":
        _print_aircraft()
    elif what == "guidance":
        _print_guidance()
    else:
        print_columns(_summaries(what))
    return 0


def _print_aircraft() -> None:
    """A row for each of the fleet, as soon as it is known; columns are those of `_AIRCRAFT_ROW`."""
    from aircraft.airframes import AircraftError, aircraft_names, airframe
    from aircraft.envelope import performance

    say(_AIRCRAFT_ROW.format("name", "mass kg", "speed m/s", "cruise", "turn m", "verified", "what"))
    for name in aircraft_names():
        try:
            frame = airframe(name)
            radius_m = performance(frame, frame.cruise_mps).turn_radius_m
        except AircraftError as error:
            say(f"{name:10} cannot be flown: {error}")
            continue
        low, high = frame.airspeed_range_mps
        verified = "yes" if frame.verified else "no"
        cells = (f"{frame.mass_kg:.0f}", f"{low:g}-{high:g}", f"{frame.cruise_mps:g}", f"{radius_m:.0f}")
        say(_AIRCRAFT_ROW.format(name, *cells, verified, frame.summary))


def _print_guidance() -> None:
    """Every law with its own keys: default, unit, what it is."""
    import textwrap

    from aircraft.guidance.registry import guidance_kinds

    for name, kind in guidance_kinds().items():
        say(textwrap.fill(f"{name}: {kind.summary}", 80, subsequent_indent="  "))
        for own in fields(kind.config):
            unit = own.metadata.get("unit") or "1"
            text = f"{own.name} = {_default(own.default)}{'' if unit == '1' else f' {unit}'}: {own.metadata['doc']}"
            say(textwrap.fill(text, 80, initial_indent="  ", subsequent_indent="      "))


def _default(value: object) -> str:
    """A default as it stands in a scenario."""
    if value is None:
        return "derived"
    return f"{value:g}" if isinstance(value, float) else str(value).lower()


_AIRCRAFT_ROW = "{:10} {:>7} {:>11} {:>6} {:>6}  {:8}  {}"


def _summaries(what: str) -> dict[str, str]:
    """What there is, by name, with a line on each."""
    if what == "planners":
        from planner.registry import planner_kinds

        return {name: kind.summary for name, kind in planner_kinds().items()}
    from harness.scenario.shipped import shipped_scenarios, summary

    return {name: summary(path) for name, path in shipped_scenarios().items()}
