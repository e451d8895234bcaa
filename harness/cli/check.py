"""The command `check`: can a path be flown?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

from harness.cli.command_line import FAILED, distinct_suffix, flying_into, print_json, world_notes
from harness.cli.flight_rows import verdict_rows
from harness.cli.options import AircraftName, Count, Json, NoRecording, Number, Out, Quiet, argument, option
from harness.cli.replacing import NOTHING, Given, replacing
from harness.cli.terminal import plain, print_table, say

PATH: Final = "A line (.csv, .geojson, .kml, .kmz), a track (.gpx, .igc) or a mission (.plan, .waypoints)."
WORLD_HELP: Final = "A scenario that gives obstacles, bounds, air, navigation, seed, altitude."
ALTITUDE_HELP: Final = "One altitude above sea level throughout. Default: the file's, else WORLD's, else 300."
LEVEL_HELP: Final = "Largest distance from the altitude. Default: 10 m."
TOLERANCE_HELP: Final = "Largest distance from the path. Default: a tenth of C, or 10 m without C."
ACCEPTED: Final = "at waypoints of a mission the acceptance radius in the file, else 90 m."
CORNER_HELP: Final = f"Largest distance from corners. Default: T; {ACCEPTED}"
DAYS_HELP: Final = "Fly it on N days of its conditions too: DIR/days, as `certify` does."


@replacing("guidance", "conditions", "wind", "turbulence", "seed", "settings")
def check(
    path: Annotated[Path, argument("PATH", PATH)],
    aircraft: AircraftName,
    given: Given = NOTHING,
    airspeed_mps: Annotated[Number, option("V", "True airspeed. Default: the aircraft's cruise.")] = None,
    altitude_m: Annotated[Number, option("H", ALTITUDE_HELP)] = None,
    scenario: Annotated[str | None, option("WORLD", WORLD_HELP)] = None,
    clearance_m: Annotated[Number, option("C", "Wanted clearance. Default: WORLD's, if written.")] = None,
    tolerance_m: Annotated[Number, option("T", TOLERANCE_HELP)] = None,
    altitude_tolerance_m: Annotated[Number, option("A", LEVEL_HELP)] = None,
    corner_m: Annotated[Number, option("R", CORNER_HELP)] = None,
    days: Annotated[Count, option("N", DAYS_HELP, min=1)] = None,
    out: Out = None,
    no_recording: NoRecording = False,
    quiet: Quiet = False,
    as_json: Json = False,
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
    import numpy as np

    from harness.certification.days import PathDays
    from harness.cli.certify import drop_other_days, fly_path_days
    from harness.run.path_check import CheckedFile, fly_check
    from harness.scenario.conditions import conditions_text
    from harness.scenario.shipped import scenario_path

    replaced = given.plus(
        aircraft__model=aircraft,
        aircraft__airspeed_mps=airspeed_mps,
        planner__clearance_m=clearance_m,
        trackability__cross_track_m=tolerance_m,
        trackability__altitude_m=altitude_tolerance_m,
    ).keys
    world = None if scenario is None else scenario_path(scenario)
    file = CheckedFile(path, replaced, world, altitude_m, corner_m, given.sources[1])
    check = file.prepared()
    drawn = None if days is None else PathDays(file, {}, claim="as-given", most=days, purpose="band")
    beside = {"scenario": scenario, "altitude_m": altitude_m, "corner_m": corner_m}
    differs = [(name, str(value)) for name, value in beside.items() if value is not None]
    apart = distinct_suffix([*differs, *replaced], named=("aircraft.model",))
    folder = out or Path("runs") / "check" / f"{check.scenario.name}-{Path(aircraft).name}{apart}"
    length_m = float(np.hypot(*np.diff(check.given.points_m, axis=0).T).sum())
    with flying_into(folder, length_m, quiet) as report:
        metrics = fly_check(check, folder, not no_recording, report)
    drop_other_days(folder / "days", file, days)
    if as_json:
        print_json(metrics)
    elif not quiet:
        verdict, *rows = verdict_rows(metrics).items()
        conditions = ("conditions", plain(conditions_text(check.scenario)))
        title = f"{path.name}: {aircraft}, {check.scenario.aircraft.airspeed_mps:g} m/s"
        notes = [(name, plain(note)) for name, note in world_notes(check.scenario).items()]
        print_table(title, dict([verdict, conditions, *rows, *notes]))
        say(f"run folder: {folder}")
    if drawn is not None:
        fly_path_days(drawn, folder, silent=quiet or as_json)
    return 0 if metrics["check"]["ok"] else FAILED
