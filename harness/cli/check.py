"""The command `check`: can a path be flown?"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from harness.cli.options import (
    FAILED,
    ConditionsOption,
    GuidanceOption,
    bad_input,
    chosen,
    flag,
    print_json,
    settings_of,
    tell_interrupted,
    told_apart,
    turbulence_of,
    wind_of,
)
from harness.cli.standard_output import say

if TYPE_CHECKING:
    from harness.run.path_check import CheckedPath, PathCheck


def check(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="PATH",
            help="A line (.csv, .geojson, .kml, .kmz), a track (.gpx, .igc) or a mission (.plan, .waypoints).",
        ),
    ],
    aircraft: Annotated[
        str, typer.Option(metavar="NAME", help="A name that `wayproof list aircraft` prints.")
    ],
    guidance: GuidanceOption = None,
    conditions: ConditionsOption = None,
    airspeed_mps: Annotated[
        float | None, typer.Option(metavar="V", help="True airspeed. Default: the aircraft's cruise.")
    ] = None,
    altitude_m: Annotated[
        float | None,
        typer.Option(metavar="H", help="Altitude above sea level. Default: the file's, else 300."),
    ] = None,
    wind: Annotated[
        str | None, typer.Option(metavar="SPEED,FROM", help="Steady wind: m/s, degrees it blows from.")
    ] = None,
    turbulence: Annotated[
        str | None, typer.Option(metavar="INTENSITY", help="light, moderate or severe; or milspec:light, ...")
    ] = None,
    scenario: Annotated[
        str | None,
        typer.Option(
            metavar="WORLD", help="A scenario that gives obstacles, bounds, environment, seed, altitude."
        ),
    ] = None,
    clearance_m: Annotated[
        float | None, typer.Option(metavar="C", help="Wanted clearance. Default: WORLD's, if written.")
    ] = None,
    tolerance_m: Annotated[
        float | None,
        typer.Option(
            metavar="T",
            help="Largest distance from the path. Default: a tenth of C, or 10 m without C.",
        ),
    ] = None,
    altitude_tolerance_m: Annotated[
        float | None, typer.Option(metavar="A", help="Largest distance from the altitude. Default: 10 m.")
    ] = None,
    corner_m: Annotated[
        float | None,
        typer.Option(
            metavar="R",
            min=0.0,
            help="Largest distance from corners. Default: T; at waypoints of a mission the acceptance radius in the "
            "file, else 90 m.",
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Seed of the turbulence.")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY.PATH=VALUE", help="Any key of a scenario; can be repeated."),
    ] = None,
    days: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Fly it on N days of its conditions too: DIR/days, as `certify` does."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="The run folder. Default: its own in runs/check."),
    ] = None,
    no_recording: Annotated[bool, flag("--no-recording", "Do not write flight.rrd.")] = False,
    quiet: Annotated[bool, flag("--quiet", "Print nothing but errors.")] = False,
    as_json: Annotated[bool, flag("--json", "Print metrics.json, and nothing else.")] = False,
) -> int:
    """Flies a given path and says whether it can be flown as given, and where and why not.

    A drawn line is to be flown as drawn; a mission's corners may be cut. Obstacles (of WORLD, or --set obstacles=...)
    must not be touched, fences and given bounds not crossed.

    For example: wayproof check survey.plan --aircraft aerosonde --wind 8,270

    Exit status:

    0 trackable, no contact, no fence or bound crossed

    1 flown, but not as given

    2 bad input or usage, nothing flown
    """
    from harness.run.path_check import asked, origin_of
    from harness.run_files.path_files import read_path

    world = None if scenario is None else _world(scenario)
    given = read_path(path, altitude_m is not None, origin_of(world))
    sections: dict[str, dict[str, Any]] = {
        "aircraft": _given(model=aircraft, airspeed_mps=airspeed_mps),
        "planner": _given(clearance_m=clearance_m),
        "trackability": _given(cross_track_m=tolerance_m, altitude_m=altitude_tolerance_m),
        "environment": _given(wind=wind_of(wind), turbulence=turbulence_of(turbulence)),
    }
    overrides = chosen(seed=seed, guidance=guidance, conditions=conditions)
    replaced = settings_of(settings, [*overrides, *chosen(aircraft=aircraft)])

    def on_day(day: Sequence[tuple[str, str]]) -> PathCheck:
        return asked(
            given,
            sections,
            [*overrides, *replaced, *day],
            world=world,
            altitude_m=altitude_m,
            corner_m=corner_m,
            name=_name(path),
        )

    check = on_day(())
    numbers = {
        "airspeed_mps": airspeed_mps,
        "altitude_m": altitude_m,
        "clearance_m": clearance_m,
        "seed": seed,
    }
    numbers |= {
        "tolerance_m": tolerance_m,
        "altitude_tolerance_m": altitude_tolerance_m,
        "corner_m": corner_m,
    }
    words = {
        "scenario": scenario,
        "guidance": guidance,
        "conditions": conditions,
        "wind": wind,
        "turbulence": turbulence,
    }
    differs = [(name, str(value)) for name, value in {**numbers, **words}.items() if value is not None]
    apart = told_apart([*differs, *replaced], named=())
    folder = out or Path("runs") / "check" / f"{check.scenario.name}-{Path(aircraft).name}{apart}"
    flown = _fly(check, folder, recording=not no_recording, silent=quiet)
    if as_json:
        print_json(flown.metrics)
    elif not quiet:
        from harness.cli.check_terminal import verdict_rows
        from harness.cli.terminal import plain, print_table
        from harness.scenario.conditions import told

        speed_mps = check.scenario.aircraft.airspeed_mps
        verdict, *rows = verdict_rows(flown.metrics).items()
        day = ("conditions", plain(told(check.scenario)))
        print_table(f"{path.name}: {aircraft}, {speed_mps:g} m/s", dict([verdict, day, *rows]))
        say(f"run folder: {folder}")
    if days is not None:
        from harness.certification.days import PathDays
        from harness.cli.certify import fly_path_days

        content = f"{path.read_bytes().hex()} {differs} {replaced} {world and world.read_text()}"
        words_again = ["wayproof", "check", str(path), "--aircraft", aircraft]
        drawn = PathDays(
            on_day, content, words_again, {}, claim="as-given", seed=check.scenario.seed, most=days
        )
        fly_path_days(drawn, folder / "days", silent=quiet or as_json)
    return 0 if flown.ok else FAILED


def _world(scenario: str) -> Path:
    from harness.scenario.shipped import scenario_path

    return scenario_path(scenario)


def _name(path: Path) -> str:
    """The name of a path's scenario."""
    return (re.sub(r"[^a-z0-9._-]+", "-", path.stem.lower()).strip("-.") or "path")[:100]


def _given(**keys: Any) -> dict[str, Any]:
    """The keys that have a value."""
    return {name: value for name, value in keys.items() if value is not None}


def _fly(check: PathCheck, folder: Path, *, recording: bool, silent: bool) -> CheckedPath:
    """Flies into a folder, with a progress bar where a person looks on."""
    from contextlib import nullcontext

    import numpy as np

    from aircraft.airframes import AircraftError
    from harness.cli.terminal import progress_bar
    from harness.files.errors import RunFolderError
    from harness.run.path_check import fly_check
    from harness.run_files.run_folder import MANIFEST, SCHEMA

    length_m = float(np.hypot(*np.diff(check.given.points_m, axis=0).T).sum())
    try:
        with nullcontext() if silent else progress_bar(length_m) as report:
            return fly_check(check, folder, recording, report)
    except (AircraftError, RunFolderError) as error:
        raise bad_input(error) from error
    except KeyboardInterrupt:
        tell_interrupted("run", folder, MANIFEST, SCHEMA)
        raise
