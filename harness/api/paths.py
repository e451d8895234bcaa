"""A given path, and a flown log, from Python: `check`, `replay`."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.api.flights import as_input_errors, flown_into, in_python
from harness.api.results import FlightResult
from harness.files.input_file import InputError
from harness.files.strict_yaml import dump
from harness.run_files.run_folder import MANIFEST
from harness.scenario.files_resolved import spec_of
from harness.scenario.scenario import Given, Scenario, changed, plain
from harness.scenario.shipped import scenario_path

if TYPE_CHECKING:
    from harness.replays.measures import Replay

    Points = Sequence[Sequence[float]] | np.ndarray[Any, Any]


def check(
    path: str | Path | Points,
    aircraft: str = "aerosonde",
    scenario: Scenario | str | Path | None = None,
    *,
    airspeed_mps: float | None = None,
    altitude_m: float | None = None,
    wind: tuple[float, float] | None = None,
    tolerance_m: float | None = None,
    corner_m: float | None = None,
    settings: Mapping[str, Any] | None = None,
    out: str | Path | None = None,
    recording: bool = False,
) -> FlightResult:
    """Flies a given path with the simulated aircraft and says whether it can be flown as given.

        run = wayproof.check("survey.plan", aircraft="aerosonde", wind=(8, 270))
        run.metrics.check.ok, run.metrics.check.verdict

    `path` is a file that `wayproof check` takes, or points (n, 2 or 3): east, north, perhaps altitude, in metres; of a
    table with names of columns, as of pandas, those columns count that a CSV file may have.
    `scenario` gives obstacles, bounds, air, navigation, seed, altitude and written limits; None: an empty calm world.
    `airspeed_mps` is true airspeed, by default the aircraft's cruising speed; `altitude_m` is above mean sea level, by
    default the path's, else the scenario's, else 300 m; `wind` is a speed (m/s) and the direction it blows from (deg).
    `tolerance_m` is allowed off the path, by default a tenth of a written clearance, else 10 m; `corner_m` at corners,
    by default the same, of a mission its acceptance radius or 90 m. `settings` are further keys of a scenario, by key
    path, text as YAML. `out` is the run folder; `recording`: for rerun. An InputError says what cannot be used.
    """
    from harness.run.path_check import fly_check, origin_of, prepare_check
    from harness.run_files.path_files import given_points, read_path

    air = wind if wind is None or np.size(wind) != 2 else {"speed_mps": wind[0], "from_deg": wind[1]}
    keys: dict[str, Any] = {
        "aircraft.model": json.dumps(str(aircraft)),
        "aircraft.airspeed_mps": airspeed_mps,
        "environment.wind": air,
        "trackability.cross_track_m": tolerance_m,
    }
    file = Path(path) if isinstance(path, str | Path) else None
    with as_input_errors(), TemporaryDirectory(prefix="wayproof-world-") as scratch:
        world = _world_file(scenario, Path(scratch))
        given, level = _as_text(keys, settings or {}), altitude_m is not None
        origin = origin_of(world, given)
        points = read_path(file, level, origin) if file else given_points(path, level, origin)
        corner_m = None if corner_m is None else float(corner_m)
        check = prepare_check(points, given, world=world, altitude_m=altitude_m, corner_m=corner_m)
        command = in_python(f"wayproof.check({'points' if file is None else str(path)!r}, {aircraft!r})")
        flown = flown_into(out, check.scenario, lambda to: fly_check(check, to, recording, command=command))
    if flown._scratch is None or recording:
        return flown
    flown._scratch.cleanup()
    return replace(flown, folder=None, _scratch=None)


def replay(
    log: str | Path,
    aircraft: str,
    mission: str | Path | None = None,
    *,
    out: str | Path | None = None,
    settings: Mapping[str, Any] | None = None,
    recording: bool = False,
) -> Replay:
    """Flies the mission of a flown log with the simulated aircraft, in the wind of that day, and compares the two.

        found = wayproof.replay("flight.parquet", "ultrastick25e", "mission.json")
        found.results["simulated"]["lap_mean_s"] - found.results["flown"]["lap_mean_s"]

    `log` is a table (.parquet, .csv) of flown columns, or a flight log (.ulg, .bin, ...); `mission` a file that
    `wayproof check` takes, or a JSON with `mission.corners_east_north_m`, by default the one that an ArduPilot log has.
    `settings` are keys of the simulated flight's scenario, by key path, text as YAML. `out` is the folder, by default
    `runs/replay/NAME` of the log; `recording`: both flights for rerun. An InputError says that one of them cannot be
    used; nothing was flown.
    """
    from harness.replays.replay import replay as flown_anew

    with as_input_errors():
        folder = Path(out or Path("runs/replay") / Path(log).stem)
        file, keys = None if mission is None else Path(mission), _as_text({}, settings or {})
        return flown_anew(Path(log), aircraft, folder, file, keys, recording)


def _as_text(own: Mapping[str, Any], settings: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Keys given by arguments and by settings, values as YAML; an InputError names a key that is given by both."""
    given = [f"{key}." for key, value in own.items() if value is not None]
    if twice := [key for key in settings if any(each.startswith(f"{key.strip()}.") for each in given)]:
        raise InputError(f"wayproof: {twice[0]}: is given in settings and as an argument; leave one out")
    every = ((key, plain(value)) for key, value in {**own, **settings}.items() if value is not None)
    return [(k, str(v) if isinstance(v, str) else json.dumps(v, default=float)) for k, v in every]


def _world_file(scenario: Scenario | str | Path | None, folder: Path) -> Path | None:
    """Returns the file of a scenario, None for none; the keys that an object was given are written into `folder`."""
    if not isinstance(scenario, Scenario):
        return None if scenario is None else scenario_path(str(scenario))
    given: Given = scenario.__dict__["_given"]
    files = [(k, each.file) for k, each in enumerate(given.sections.get("obstacles", ())) if each.file]
    paths = {f"obstacles[{k}].file.path": spec_of(file, given.folder).path.absolute() for k, file in files}
    root = changed(given, {"aircraft.model": scenario.aircraft.model, **paths})
    if given.folder is None:  # of a run folder, where defaults are filled in
        (folder / MANIFEST).touch()
    path = folder / f"{scenario.name}.yaml"
    path.write_text(dump(root.plain()), encoding="utf-8")
    return path
