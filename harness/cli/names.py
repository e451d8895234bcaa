"""The command `list`: the names that a scenario or a command can use, and what there is to know of each."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from harness.cli.options import argument, called
from harness.cli.standard_output import folded, say
from harness.cli.terminal import step_bar

_AIRCRAFT_ROW: Final = "{:13} {:>7} {:>10} {:>6} {:>6} {:6} "
_WIDTH: Final = 80
WHAT: Final = "planners, aircraft, guidance, scenarios, worlds, campaigns or metrics."


def list_names(
    what: Annotated[str, argument("WHAT", WHAT, "harness.cli.names:listed")],
) -> int:
    """Prints the names that a scenario or a command can use; for planners and guidance laws also their keys.

    `list aircraft` first measures, in flight, each aircraft that is new to this machine: about a minute for all. The
    figures are kept.

    For example: wayproof list planners
    """
    lists = listed()
    if what not in lists:
        raise typer.BadParameter(f"{what[:60]!r} is not one of {', '.join(lists)}", param_hint="WHAT")
    for line in lists[what]():
        say(line)
    return 0


def listed() -> dict[str, Callable[[], Iterator[str]]]:
    """What makes the lines of each list."""
    return {
        "planners": lambda: _kinds(called("harness.scenario.kinds:planner_kinds")),
        "aircraft": _aircraft,
        "guidance": lambda: _kinds(called("harness.scenario.kinds:guidance_kinds")),
        "scenarios": lambda: _files(called("harness.scenario.shipped:shipped_scenarios")),
        "worlds": _worlds,
        "campaigns": lambda: _files(called("harness.scenario.shipped:shipped_campaigns")),
        "metrics": _metrics,
    }


def _files(files: Mapping[str, Path]) -> Iterator[str]:
    """Shipped files, a row each."""
    from harness.scenario.shipped import summary

    width = max(map(len, files), default=0)
    return (folded(f"{name:{width}}  ", summary(path)) for name, path in files.items())


def _metrics() -> Iterator[str]:
    """Every figure of a flight that people are shown: its name, place in `metrics.json`, unit, and what it means."""
    from harness.analysis.registry import METRICS

    for metric in METRICS:
        if metric.title:
            unit = f" [{metric.unit}]" if metric.unit else ""
            hint = f": {metric.hint}" if metric.hint else ""
            place = f" ({metric.path})" if metric.path != metric.name and not metric.derived else ""
            yield _filled(f"{metric.name}{place}: {metric.title}{unit}{hint}")


def _filled(text: str, begin: str = "") -> str:
    return textwrap.fill(text, _WIDTH, initial_indent=begin, subsequent_indent=f"{2 * begin}  ")


def _worlds() -> Iterator[str]:
    """A row for each family of benchmark worlds: how many there are, the first one's name, its source and licence."""
    from harness.scenario.shipped import shipped_worlds, summary

    families: dict[str, list[str]] = {}
    worlds = shipped_worlds()
    for name in worlds:
        families.setdefault(name.partition("/")[0], []).append(name)
    for family, names in families.items():
        source = summary(worlds[names[0]]).replace(", see ../LICENCES.md", "")
        yield folded(f"{family:15} {len(names):3}  ", f"{names[0]}: {source}")


def _kinds(kinds: Mapping[str, Any]) -> Iterator[str]:
    """Every planner, or law, with its own keys: default, unit, what it is."""
    for name, kind in kinds.items():
        yield _filled(f"{name}: {kind.summary}")
        for own in fields(kind.config):
            unit = own.metadata.get("unit") or "1"
            told = "" if unit == "1" else f" {unit}"
            yield _filled(f"{own.name} = {_default(own.default)}{told}: {own.metadata['doc']}", "  ")


def _default(value: object) -> str:
    """A default as it stands in a scenario."""
    if value is None:
        return "derived"
    return f"{value:g}" if isinstance(value, float) else str(value).lower()


def _aircraft() -> Iterator[str]:
    """A row for each of the fleet; columns are those of `_AIRCRAFT_ROW`."""
    from aircraft.airframes import AircraftError, aircraft_names, airframe, is_surveyed
    from aircraft.envelope import performance
    from planner.kernel_cache import seal

    names = aircraft_names()
    new = [name for name in names if not is_surveyed(name)]
    if new:
        seal()
        many = f"{len(new)} aircraft are" if len(new) > 1 else f"{new[0]} is"
        say(f"{many} flown for the figures, once; some seconds each", err=True)
    rows = [
        folded(_AIRCRAFT_ROW.format("name", "mass kg", "speed m/s", "cruise", "turn m", "tested"), "what")
    ]
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
            figures = (
                f"{frame.mass_kg:.0f}",
                f"{low:g}-{high:g}",
                f"{frame.cruise_mps:g}",
                f"{radius_m:.0f}",
            )
            tested = "yes" if frame.verified else "no"
            rows.append(folded(_AIRCRAFT_ROW.format(name, *figures, tested), frame.summary))
    return iter(rows)
