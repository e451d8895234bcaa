"""A flown log beside the same mission simulated: the differences as a table, a page and a recording of both."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from aircraft.frames import LocalPlane
from harness.files.folder_lock import claim_folder
from harness.files.input_file import InputError
from harness.files.whole_file import replace_text
from harness.files.wording import counted
from harness.flight.record import FloatArray
from harness.replays.flown import AIRSPEED_COLUMNS, TABLES, FlownFlight, check_kind, read_flown
from harness.replays.measures import Replay, Side, compare, legs_of, no_whole_lap, rows_of
from harness.replays.mission import FlownMission, mission_of_log, mission_of_targets, placed, read_mission
from harness.replays.simulated import Task, altitude_flown_m, fly_anew, scenario_for
from harness.replays.wind import FittedWind, fit_wind, fit_windows, true_over_indicated
from harness.run_files.run_folder import load_run

INDEX, RECORDING, SCHEMA = "replay.json", "flight.rrd", "wayproof/replay/1"
WORST_RESIDUAL: Final = 0.2  # share of the mean speed that a fit of wind which is sound may leave
SIMULATED: Final = "simulated"  # the run folder of the simulated flight, in the folder of a replay


def replay(
    log: Path,
    aircraft: str,
    out: Path,
    mission: Path | None = None,
    overrides: Sequence[tuple[str, str]] = (),
    recording: bool = True,
) -> Replay:
    """Flies the mission of a log with the simulated aircraft in the wind that the log shows, as it changes.

    `log` is as `read_flown` takes it, `mission` as `read_mission`, None for that of the log or of its `target_index`;
    `overrides` replace keys of the simulated flight's scenario, and `out` is the folder of the replay.

    Raises:
        InputError: log, mission or aircraft cannot be used; nothing was flown.
        RunFolderError: the folder holds something else or cannot be written.
        AircraftError: the aircraft cannot be loaded or trimmed.
    """
    flown_mission, flight, notes = _read(log, mission)
    height_m = float(np.nanmedian(flight["up_m"]))  # that was commanded, as `up_m` has it
    if flown_mission.height_m is not None and "baro_height_m" in flight:
        height_m = flown_mission.height_m + float(np.nanmedian(flight["up_m"] - flight["baro_height_m"]))
    altitude_m = altitude_flown_m(flight, flown_mission, height_m, notes)
    flight = _with_both_airspeeds(flight, flown_mission, altitude_m)
    wind = fit_wind(flight)
    winds = [] if any("environment.wind" in name for name, _ in overrides) else fit_windows(flight, wind)
    if wind.residual_mps > WORST_RESIDUAL * np.hypot(flight["ve_mps"], flight["vn_mps"]).mean():
        notes.append(f"wind: it leaves {wind.residual_mps:.1f} m/s (rms) unexplained; is the airspeed right?")
    first, commanded_mps = _first_corner(flight, flown_mission), _commanded_mps(flight, flown_mission, wind)
    task = Task(flight, flown_mission, first, winds or [wind], commanded_mps, height_m, altitude_m)
    scenario = scenario_for(task, aircraft, overrides)
    flown, numbers = _prepare(task)
    if "" not in flown.lacks.values():
        raise no_whole_lap(f"{log}:", flown, _never_reached(flown, task))
    with closing(claim_folder(out, "replay", INDEX, SCHEMA)):
        replace_text(out / INDEX, json.dumps({"schema": SCHEMA, "complete": False}) + "\n")
        (out / RECORDING).unlink(missing_ok=True)  # of an earlier replay
        columns = fly_anew(scenario, task, len(numbers), out / SIMULATED)
        corners_m, legs = flown_mission.corners_m, columns["leg"]
        ended = bool(legs[-1] >= len(numbers) * len(corners_m))
        laps = np.append(numbers, 0.0)[np.minimum(_laps(legs, task), len(numbers)).astype(np.int64)]
        simulated = Side(columns, corners_m, legs, laps, scenario.mission.altitude_m, flown.begun, ended)
        comparison = compare(flown, simulated, load_run(out / SIMULATED).metrics["reason"])
        unended, settled = "is not flown to its end in the simulation", comparison["settled_laps"]
        lacks = [(lap, lack or unended) for lap, lack in flown.lacks.items() if lap not in settled]
        results = {
            "schema": SCHEMA,
            "complete": True,
            "log": str(log),
            "aircraft": aircraft,
            "guidance": dict(scenario.guidance),
            "wind": wind.figures(),
            "wind_windows": [{"time_s": each.time_s, **each.figures()} for each in winds],
            "airspeed_mps": task.airspeed_mps,
            "latency_s": scenario.navigation.latency_s,
            **comparison,
            "notes": [*notes, *flight.notes, *(f"lap {lap} is left out: it {lack}" for lap, lack in lacks)],
        }
        found = Replay(results, flown.columns, columns, corners_m, out)
        _write(found, {"flown": flown, "simulated": simulated}, recording)
    return found


def _never_reached(flown: Side, task: Task) -> str:
    """Says which corner a flight does not reach, and how near it comes to it; "" where its log has targets."""
    if "target_index" in flown.columns:
        return ""
    reached, columns = int(flown.legs[-1]), flown.columns
    corner = (task.first + reached) % len(flown.corners_m)
    east, north = flown.corners_m[corner]
    away_m = np.hypot(columns["east_m"] - east, columns["north_m"] - north)
    near, radius_m = away_m[flown.legs == reached].min(), task.mission.acceptance_m
    within = "" if radius_m is None else f", which counts as reached from {radius_m:g} m"
    comes = f"comes to {counted(reached, 'corner')} in turn, then no nearer than {near:.0f} m"
    return f"; it {comes} to corner {corner + 1}{within}"


def _read(log: Path, mission: Path | None) -> tuple[FlownMission, FlownFlight, list[str]]:
    """Returns the mission from where laps begin, the flown flight, and notes on the mission."""
    check_kind(log)
    if mission is None and log.suffix.lower() in TABLES:
        flight = read_flown(log)
        found, notes, _ = mission_of_targets(flight)
    else:
        found, notes, origins = read_mission(mission) if mission else mission_of_log(log)
        origin = found.origin
        plane = LocalPlane(origin.latitude_deg, origin.longitude_deg) if origin else LocalPlane(0.0, 0.0)
        flight = read_flown(log, plane, degrees=bool(origins))
        if origin is None and flight.in_degrees:
            text = "is in degrees and the mission in metres; give a mission in degrees, or with frame.origin"
            raise InputError(f"{log}: {text} (latitude_deg, longitude_deg)")
        if mission and origins and not flight.in_degrees:
            found = placed(mission, origins, flight, notes)
    found.check_flown(flight)
    return _from_where_laps_begin(found, flight, notes), flight, notes


def _from_where_laps_begin(mission: FlownMission, flight: FlownFlight, notes: list[str]) -> FlownMission:
    """Returns the mission with its corners from that at which the column `lap` changes; notes it."""
    laps = flight.columns.get("lap", np.zeros(0))
    begins = np.flatnonzero((np.diff(laps) != 0.0) & (np.minimum(laps[:-1], laps[1:]) >= 1.0)) + 1
    first, away_m = mission.corner_at(flight, begins, 0) if begins.size else (0, 0.0)
    if first:
        where = f"{away_m:.0f} m from where lap changes"
        notes.append(f"laps begin at corner {first + 1} of the mission, {where}")
    return mission.model_copy(update={"corners_m": np.roll(mission.corners_m, -first, axis=0)})


def _with_both_airspeeds(flight: FlownFlight, mission: FlownMission, altitude_m: float) -> FlownFlight:
    """Fills in true or indicated airspeed, of which a log has one alone, if it is wanted; with a note."""
    true, indicated = AIRSPEED_COLUMNS
    known, other = (true, indicated) if true in flight else (indicated, true)
    if known not in flight or other in flight or (known == true and mission.airspeed_mps is None):
        return flight
    ratio = true_over_indicated(altitude_m)
    columns = {**flight.columns, other: flight[known] * (ratio if other == true else 1.0 / ratio)}
    note = f"airspeed: {other} from {known} by the standard atmosphere at {altitude_m:.0f} m"
    return replace(flight, columns=columns, notes=(*flight.notes, note))


def _commanded_mps(flight: FlownFlight, mission: FlownMission, wind: FittedWind) -> float:
    if flight.airspeed_mps is None:
        return wind.airspeed_mps
    if mission.airspeed_mps is None:
        return float(np.nanmedian(flight.airspeed_mps))
    indicated = np.where(flight["airspeed_ias_mps"] > 0.0, flight["airspeed_ias_mps"], np.nan)
    return mission.airspeed_mps * float(np.nanmedian(flight["airspeed_tas_mps"] / indicated))


def _first_corner(flight: FlownFlight, mission: FlownMission) -> int:
    """Number of the corner that a flight heads for: where its first target is reached, else after the nearest."""
    targets, corners = flight.columns.get("target_index", np.zeros(0)), len(mission.corners_m)
    known = np.flatnonzero(targets >= 0.0)
    if (reached := known[targets[known] != targets[known[:1]]][:1]).size:
        return mission.corner_at(flight, reached, int(targets[known[0]]) % corners)[0]
    away = np.hypot(*(mission.corners_m - (flight["east_m"][0], flight["north_m"][0])).T)
    return (int(away.argmin()) + 1) % corners


def _prepare(task: Task) -> tuple[Side, FloatArray]:
    """Returns the flown flight ready to be measured, and (k,) the numbers of the laps to simulate, as `_numbers`."""
    flight, mission = task.flight, task.mission
    columns = dict(flight.columns)
    legs = legs_of(columns, mission.corners_m, task.first, mission.acceptance_m)
    mission.check_order(flight, legs, task.first)
    by_corners = _laps(legs, task)
    laps = columns.get("lap", 1.0 + by_corners)
    # The log begins or ends where a lap does: as near to corner 0, in two rows, as counts as reached or as laps ended.
    ends = [0, -1]
    steps_m = np.hypot(flight["ve_mps"], flight["vn_mps"])[ends] * np.diff(flight["time_s"])[ends]
    away_m = np.hypot(*(mission.corners_m[:1] - np.column_stack((flight["east_m"], flight["north_m"]))).T)
    turned_m = away_m[1:][(np.diff(laps) != 0) & (np.minimum(laps[:-1], laps[1:]) >= 1)]
    near_m = mission.acceptance_m if mission.acceptance_m is not None else turned_m.max(initial=0.0)
    begun, ended = (away_m[ends] <= near_m + 2.0 * steps_m).tolist()
    columns["time_s"] = columns["time_s"] - columns["time_s"][0]
    if flight.airspeed_mps is not None:
        columns["airspeed_mps"] = flight.airspeed_mps
    side = Side(columns, mission.corners_m, legs, laps, task.height_m, begun, ended)
    return side, _numbers(laps, by_corners)


def _numbers(laps: FloatArray, by_corners: FloatArray) -> FloatArray:
    """(k,) the log's number of each lap that `_laps` counts, in the order flown; 0 for one before its first."""
    begins = np.flatnonzero((np.diff(laps, prepend=0.0) != 0.0) & (laps >= 1.0))
    before = float(np.median(by_corners[laps == laps[begins[0]]])) if begins.size else 1.0
    return np.append(np.zeros(int(before)), laps[begins])


def _laps(legs: FloatArray, task: Task) -> FloatArray:
    """(n,) number of laps begun after the first; each begins when corner 0 is reached."""
    corners = len(task.mission.corners_m)
    return (legs + (task.first - 1) % corners) // corners


def _write(found: Replay, sides: Mapping[str, Side], recording: bool) -> None:
    """Writes the recording of both, the page and, last, the index."""
    from harness.replays.replay_figure import replay_figure
    from harness.report.figure_style import svg
    from harness.report.page import Picture, rendered

    results = found.results
    if recording:
        from harness.recording.tracks import write_tracks

        tracks = {
            name: {**s.columns, "height_m": s.columns["up_m"] - s.height_m, "outside_m": s.outside}
            for name, s in sides.items()
        }
        write_tracks(f"replay of {results['log']}", found.corners_m, tracks, found.folder / RECORDING)
    between = results["distance_between_m"]
    apart = f"{between['p50']:.1f} m apart in the median, {between['p95']:.1f} m at 95 %"
    laps = ", ".join(map(str, results["settled_laps"]))
    caption = f"The settled laps {laps}: flown and simulated, {apart}."
    picture = Picture(svg(replay_figure(found)), "Flown and simulated track from above", caption)
    page = rendered("replay.html", results=results, rows=rows_of(results), picture=picture)
    replace_text(found.folder / "report.html", page)
    replace_text(found.folder / INDEX, json.dumps(results, indent=2) + "\n")
