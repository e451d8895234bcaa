"""The command `check`: can a path be flown?"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from harness.cli.options import FAILED, bad_input, flag, print_json, setting

if TYPE_CHECKING:
    from harness.run_files.path_files import GivenPath
    from harness.scenario.scenario import Scenario


def check(
    path: Annotated[
        Path, typer.Argument(metavar="PATH", help=".csv (x_m,y_m), .geojson, .plan or .waypoints.")
    ],
    aircraft: Annotated[str, typer.Option(metavar="NAME", help="What `wayproof list aircraft` prints.")],
    airspeed_mps: Annotated[
        float | None, typer.Option(metavar="V", help="True airspeed. Default: the aircraft's cruise.")
    ] = None,
    altitude_m: Annotated[
        float | None, typer.Option(metavar="H", help="Above the sea. Default: the file's, else 300.")
    ] = None,
    wind: Annotated[
        str | None, typer.Option(metavar="SPEED,FROM", help="Steady wind: m/s, and degrees it blows from.")
    ] = None,
    turbulence: Annotated[
        str | None, typer.Option(metavar="INTENSITY", help="light, moderate or severe; milspec:light.")
    ] = None,
    clearance_m: Annotated[
        float | None, typer.Option(metavar="C", help="Free room about the path. Default: one turn radius.")
    ] = None,
    tolerance_m: Annotated[
        float | None,
        typer.Option(metavar="T", help="Allowed cross-track error. Default: a tenth of C in calm air."),
    ] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Of the turbulence.")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY.PATH=VALUE", help="Any key of a scenario; can be repeated."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Default: runs/check/NAME-AIRCRAFT.")
    ] = None,
    no_recording: Annotated[bool, flag("--no-recording", "Do not write flight.rrd.")] = False,
    quiet: Annotated[bool, flag("--quiet", "Print nothing but errors.")] = False,
    as_json: Annotated[bool, flag("--json", "Print metrics.json, and nothing else.")] = False,
) -> int:
    """Flies a path as it is given and says where it can be tracked, and why not elsewhere.

    For example: wayproof check survey.plan --aircraft aerosonde --wind 8,270

    Exit status:

    0 trackable

    1 flown, but not trackable

    2 bad input or usage, nothing flown
    """
    from harness.run_files.path_files import read_path

    given = read_path(path, any_altitude=altitude_m is not None)
    sections: dict[str, dict[str, Any]] = {
        "aircraft": _given(model=aircraft, airspeed_mps=airspeed_mps),
        "mission": _given(altitude_m=altitude_m if altitude_m is not None else given.altitude_m),
        "planner": _given(clearance_m=clearance_m),
        "trackability": _given(cross_track_m=tolerance_m),
        "environment": _given(wind=_wind(wind), turbulence=_turbulence(turbulence)),
    }
    scenario = _scenario(path, given, sections, [] if seed is None else [("seed", str(seed))], settings or [])
    folder = out or Path("runs") / "check" / f"{scenario.name}-{Path(aircraft).name}"
    metrics = _fly(scenario, given, folder, recording=not no_recording, silent=quiet)
    if as_json:
        print_json(metrics)
    elif not quiet:
        from harness.cli.check_terminal import verdict_rows
        from harness.cli.terminal import print_table

        print_table(f"{path.name}: {aircraft}, {scenario.aircraft.airspeed_mps:g} m/s", verdict_rows(metrics))
        typer.echo(f"run folder: {folder}")
    return 0 if metrics["trackable"] else FAILED


def _scenario(
    path: Path,
    given: GivenPath,
    sections: Mapping[str, Mapping[str, Any]],
    overrides: list[tuple[str, str]],
    settings: list[str],
) -> Scenario:
    from harness.run.path_flight import scenario_for

    name = re.sub(r"[^a-z0-9._-]+", "-", path.stem.lower()).strip("-.") or "path"
    where = given.origin_deg
    area = {"area": {"origin": {"latitude_deg": where[0], "longitude_deg": where[1]}}} if where else {}
    return scenario_for(
        name[:100], given.points_m, {**sections, **area}, [*overrides, *map(setting, settings)]
    )


def _given(**keys: Any) -> dict[str, Any]:
    """The keys that have a value."""
    return {name: value for name, value in keys.items() if value is not None}


def _wind(text: str | None) -> dict[str, float] | None:
    if text is None:
        return None
    try:
        speed, direction = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not SPEED,FROM such as 8,270", param_hint="--wind") from None
    return {"speed_mps": speed, "from_deg": direction}


def _turbulence(text: str | None) -> dict[str, str] | None:
    if text is None:
        return None
    model, colon, intensity = text.rpartition(":")
    return {"model": model if colon else "tustin", "intensity": intensity}


def _fly(
    scenario: Scenario, given: GivenPath, folder: Path, *, recording: bool, silent: bool
) -> dict[str, Any]:
    """Flies into a folder, with a progress bar where a person looks on."""
    from contextlib import nullcontext

    import numpy as np

    from aircraft.airframes import AircraftError
    from harness.cli.terminal import progress_bar
    from harness.files.errors import RunFolderError
    from harness.run.path_flight import check_path

    length_m = float(np.hypot(*np.diff(given.points_m, axis=0).T).sum())
    try:
        with nullcontext() if silent else progress_bar(length_m) as report:
            return check_path(scenario, given.points_m, folder, recording, report)
    except (AircraftError, RunFolderError) as error:
        raise bad_input(error) from error
    except KeyboardInterrupt:
        typer.echo(f"wayproof: interrupted; the run in {folder} is marked incomplete", err=True)
        raise
