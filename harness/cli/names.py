"""The command `list`: the names that a scenario or a command can use, and what there is to know of each."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from dataclasses import fields
from typing import Annotated, Any, Final

import typer

from harness.cli.options import argument
from harness.cli.standard_output import folded, say

LISTED: Final = ("planners", "aircraft", "guidance", "scenarios", "worlds", "campaigns", "metrics")
_AIRCRAFT_ROW: Final = "{:13} {:>7} {:>10} {:>6} {:>6} {:6} "
_WIDTH: Final = 80


def list_names(
    what: Annotated[
        str,
        argument(
            "WHAT",
            f"{', '.join(LISTED[:-1])} or {LISTED[-1]}.",
            autocompletion=lambda incomplete: [each for each in LISTED if each.startswith(incomplete)],
        ),
    ],
) -> int:
    """Prints the names that a scenario or a command can use; for planners and guidance laws also their keys.

    `list aircraft` first measures, in flight, each aircraft that is new to this machine: about a minute for all. The
    figures are kept.

    For example: wayproof list planners
    """
    if what not in LISTED:
        raise typer.BadParameter(f"{what[:60]!r} is not one of {', '.join(LISTED)}", param_hint="WHAT")
    if what == "aircraft":
        _print_aircraft()
    elif what == "guidance":
        from harness.scenario.kinds import guidance_kinds

        _print_kinds(guidance_kinds())
    elif what == "planners":
        from harness.scenario.kinds import planner_kinds

        _print_kinds(planner_kinds())
    elif what == "metrics":
        _print_metrics()
    elif what == "worlds":
        _print_worlds()
    else:
        _print_shipped(what)
    return 0


def _print_shipped(what: str) -> None:
    """Shipped files, a row each."""
    from harness.scenario.shipped import shipped_campaigns, shipped_scenarios, summary

    files = shipped_campaigns() if what == "campaigns" else shipped_scenarios()
    width = max(map(len, files), default=0)
    for name, path in files.items():
        say(folded(f"{name:{width}}  ", summary(path)))


def _print_metrics() -> None:
    """Every figure of a flight that people are shown: its name, place in `metrics.json`, unit, and what it means."""
    from harness.analysis.registry import METRICS

    for metric in METRICS:
        if metric.title:
            unit = f" [{metric.unit}]" if metric.unit else ""
            hint = f": {metric.hint}" if metric.hint else ""
            place = f" ({metric.path})" if metric.path != metric.name and not metric.derived else ""
            say(
                textwrap.fill(
                    f"{metric.name}{place}: {metric.title}{unit}{hint}", _WIDTH, subsequent_indent="  "
                )
            )


def _print_worlds() -> None:
    """A row for each family of benchmark worlds: how many there are, the first one's name, its source and licence."""
    from harness.scenario.shipped import shipped_worlds, summary

    families: dict[str, list[str]] = {}
    worlds = shipped_worlds()
    for name in worlds:
        families.setdefault(name.partition("/")[0], []).append(name)
    for family, names in families.items():
        source = summary(worlds[names[0]]).replace(", see ../LICENCES.md", "")
        say(folded(f"{family:15} {len(names):3}  ", f"{names[0]}: {source}"))


def _print_kinds(kinds: Mapping[str, Any]) -> None:
    """Every planner, or law, with its own keys: default, unit, what it is."""
    for name, kind in kinds.items():
        say(textwrap.fill(f"{name}: {kind.summary}", _WIDTH, subsequent_indent="  "))
        for own in fields(kind.config):
            unit = own.metadata.get("unit") or "1"
            text = f"{own.name} = {_default(own.default)}{'' if unit == '1' else f' {unit}'}: {own.metadata['doc']}"
            say(textwrap.fill(text, _WIDTH, initial_indent="  ", subsequent_indent="      "))


def _default(value: object) -> str:
    """A default as it stands in a scenario."""
    if value is None:
        return "derived"
    return f"{value:g}" if isinstance(value, float) else str(value).lower()


def _print_aircraft() -> None:
    """A row for each of the fleet; columns are those of `_AIRCRAFT_ROW`."""
    from aircraft.airframes import AircraftError, aircraft_names, airframe, is_surveyed
    from harness.cli.terminal import step_bar
    from planner.kernel_cache import seal

    names = aircraft_names()
    new, faults = [name for name in names if not is_surveyed(name)], {}
    if new:
        seal()
        many = f"{len(new)} aircraft are" if len(new) > 1 else f"{new[0]} is"
        say(f"{many} flown for the figures, once; some seconds each", err=True)
        with step_bar() as report:
            for done, name in enumerate(new):
                report(done, len(new), name)
                try:
                    airframe(name)
                except AircraftError as error:
                    faults[name] = str(error)
    say(folded(_AIRCRAFT_ROW.format("name", "mass kg", "speed m/s", "cruise", "turn m", "tested"), "what"))
    for name in names:
        fault = faults.get(name)
        say(f"{name:13} cannot be flown: {fault}" if fault else _aircraft_row(name))


def _aircraft_row(name: str) -> str:
    from aircraft.airframes import AircraftError, airframe
    from aircraft.envelope import performance

    try:
        frame = airframe(name)
        radius_m = performance(frame, frame.cruise_mps).turn_radius_m
    except AircraftError as error:
        return f"{name:13} cannot be flown: {error}"
    low, high = frame.airspeed_range_mps
    figures = (f"{frame.mass_kg:.0f}", f"{low:g}-{high:g}", f"{frame.cruise_mps:g}", f"{radius_m:.0f}")
    return folded(_AIRCRAFT_ROW.format(name, *figures, "yes" if frame.verified else "no"), frame.summary)
