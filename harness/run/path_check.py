"""Whether a path can be flown as it was given: flies it and says so, and what was touched or crossed on the way."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from harness.analysis.breaches import Kept, kept
from harness.analysis.deviation import allowed_m, deviation
from harness.analysis.metrics import metrics
from harness.analysis.smoothness import polyline_profile, smoothness
from harness.analysis.trackability import AsGiven, FlightLimits
from harness.flight.closed_loop import Loop
from harness.flight.observer import Progress
from harness.flight.record import Flight, Outcome
from harness.run.path_flight import fly_along
from harness.run.path_scenario import has_bounds, scenario_for
from harness.run.path_verdict import verdict
from harness.run.scenario_flight import flight_limits, fly_to_folder, make_loop
from harness.run_files.given_path import GIVEN, CutCorner, FlyBy, fly_by
from harness.run_files.path_files import GivenPath, given_points, read_path
from harness.scenario.scenario import Scenario, performance_of
from harness.world.world import World

FREE_SHARE = 0.25
"""Share of the cross-track threshold by which a corner may be passed off only to make its arc wider."""

SPACING_SHARE = 0.25
"""Points along the given path are measured so close together, in thresholds of the cross-track error."""

WINDOW_RADII = 4.0
"""Track and path are compared where they are no further apart than this along the path, in turn radii."""


@dataclass(frozen=True, eq=False)
class PathCheck:
    """A path, and what it is to be flown and judged with.

    Attributes:
        given: the path, with its fences.
        scenario: aircraft, air, obstacles, altitude and thresholds.
        bounded: the bounds of the area were named, and must not be crossed.
        corner_m: how far off a corner may be passed; None: what `allowed_cut_m` says.
    """

    given: GivenPath
    scenario: Scenario
    bounded: bool = False
    corner_m: float | None = None

    @cached_property
    def way(self) -> FlyBy:
        """What guidance follows."""
        threshold = self.scenario.trackability.cross_track_m
        radius = performance_of(self.scenario).turn_radius_m
        return fly_by(self.given.points_m, radius, FREE_SHARE * threshold)

    def allowed_cut_m(self, waypoint: int) -> float:
        """How far off a corner may be passed.

        At a waypoint of a mission it is the acceptance radius of the file, else `corner_m`, else the clearance that
        the scenario wants, by default one turn radius. A drawn path is to be flown as drawn: it is `corner_m`, else
        the cross-track threshold.
        """
        accepted = self.given.acceptance_m[waypoint] if len(self.given.acceptance_m) else 0.0
        if accepted > 0.0:
            return float(accepted)
        if self.corner_m is not None:
            return self.corner_m
        own = self.scenario.trackability.cross_track_m
        return own if self.given.drawn else self.scenario.planner.clearance_m


@dataclass(frozen=True, eq=False)
class CheckedPath:
    """A path that was flown.

    Attributes:
        check: what was asked.
        metrics: what came of it, as in `metrics.json`; `check.ok` and `check.verdict` in there are the answer.
        folder: the run folder; None where none was written.
    """

    check: PathCheck
    metrics: dict[str, Any]
    folder: FilePath | None = None

    @property
    def ok(self) -> bool:
        """Whether it can be flown: tracked, no contact, no fence or bound crossed."""
        return bool(self.metrics["check"]["ok"])

    @property
    def verdict(self) -> str:
        """The answer as a sentence."""
        return str(self.metrics["check"]["verdict"])

    def __repr__(self) -> str:
        return f"CheckedPath({self.verdict!r})"


def check(
    path: str | FilePath | Sequence[Sequence[float]] | np.ndarray[Any, Any],
    aircraft: str = "aerosonde",
    scenario: str | FilePath | None = None,
    *,
    airspeed_mps: float | None = None,
    altitude_m: float | None = None,
    wind: tuple[float, float] | None = None,
    corner_m: float | None = None,
    settings: Sequence[tuple[str, str]] = (),
    out: FilePath | None = None,
    recording: bool = False,
) -> CheckedPath:
    """Flies a path and says whether it can be flown as given.

    Args:
        path: a file that `wayproof check` takes, or points (n, 2): east and north in metres.
        aircraft: a name that `wayproof list aircraft` prints, or a folder.
        scenario: a scenario file whose obstacles, bounds and air the path is flown in; None: nothing is there.
        airspeed_mps: true airspeed; None: the aircraft's cruising speed.
        altitude_m: above mean sea level; None: the file's, else the scenario's, else 300 m.
        wind: speed (m/s) and the direction it blows from (degrees); None: the scenario's, else calm.
        corner_m: how far off corners may be passed; None: as `PathCheck.allowed_cut_m` says.
        settings: further keys of a scenario, as `harness.scenario.scenario.load_scenario` takes them.
        out: the run folder; None: none is written.
        recording: whether to write `flight.rrd` there.

    Raises:
        InputError: the path or the scenario cannot be used.
        AircraftError: the aircraft cannot be loaded or trimmed.
        RunFolderError: the folder holds something else or cannot be written.
    """
    world = FilePath(scenario) if scenario is not None else None
    sections: dict[str, dict[str, Any]] = {
        "aircraft": {"model": aircraft},
        "environment": {"wind": {"speed_mps": wind[0], "from_deg": wind[1]}} if wind else {},
    }
    if airspeed_mps is not None:
        sections["aircraft"]["airspeed_mps"] = airspeed_mps
    any_altitude = altitude_m is not None
    if isinstance(path, str | FilePath):
        given = read_path(FilePath(path), any_altitude, origin_of(world))
    else:
        given = given_points(path)
    return fly_check(
        asked(given, sections, settings, world=world, altitude_m=altitude_m, corner_m=corner_m),
        out,
        recording,
    )


def origin_of(world: FilePath | None) -> tuple[float, float] | None:
    """Latitude and longitude of a world's origin; None where it does not say.

    Raises:
        InputError: it is not a scenario.
    """
    if world is None:
        return None
    from harness.scenario.scenario import load_scenario

    area = load_scenario(world).area
    return (
        (area.origin.latitude_deg, area.origin.longitude_deg) if "origin" in area.model_fields_set else None
    )


def asked(
    given: GivenPath,
    sections: dict[str, dict[str, Any]],
    settings: Sequence[tuple[str, str]] = (),
    *,
    world: FilePath | None = None,
    altitude_m: float | None = None,
    corner_m: float | None = None,
    name: str = "path",
) -> PathCheck:
    """Puts together what a path is flown with.

    Args:
        given: the path.
        sections: of a scenario: `aircraft`, `environment`, `planner`, `trackability`.
        settings: keys to replace.
        world: a scenario file, see `scenario_for`.
        altitude_m: above mean sea level; None: the path's, else the world's.
        corner_m: see `PathCheck`.
        name: of the scenario.

    Raises:
        InputError: they contradict each other; the fault names the key.
    """
    altitude = altitude_m if altitude_m is not None else given.altitude_m
    mission = {} if altitude is None else {"altitude_m": altitude}
    own = {**sections, "mission": {**mission, **sections.get("mission", {})}}
    if world is None and given.origin_deg is not None:
        latitude, longitude = given.origin_deg
        own["area"] = {"origin": {"latitude_deg": latitude, "longitude_deg": longitude}}
    scenario = scenario_for(name, given.points_m, own, settings, world)
    return PathCheck(given, scenario, has_bounds(own, settings, world), corner_m)


def fly_check(
    check: PathCheck,
    out: FilePath | None = None,
    recording: bool = False,
    progress: Progress | None = None,
    command: str | None = None,
) -> CheckedPath:
    """Flies a path, into a run folder if one is named.

    Args:
        check: the path, and what it is flown with.
        out: the run folder; None: none is written.
        recording: whether to write `flight.rrd` there.
        progress: told of the flight as it goes on.
        command: what the manifest says was called; default: the command line.

    Raises:
        AircraftError: the aircraft cannot be loaded or trimmed; nothing is written.
        RunFolderError: the folder holds something else or cannot be written.
    """
    flown_by = partial(fly_along, check.way)
    if out is None:
        loop: Loop = make_loop(check.scenario)
        return CheckedPath(
            check, measured(check, flown_by(loop, (), progress), flight_limits(check.scenario))
        )
    figures = fly_to_folder(
        check.scenario,
        out,
        recording,
        progress,
        pilot=GIVEN,
        flown_by=flown_by,
        measured_by=partial(measured, check),
        command=command,
    )
    return CheckedPath(check, figures, out)


@dataclass(frozen=True)
class _Corner:
    """A corner and what it may be cut by."""

    corner: CutCorner
    allowed_cut_m: float

    @property
    def arc_length_m(self) -> float:
        return self.corner.arc_length_m

    @property
    def cut_m(self) -> float:
        return self.corner.cut_m

    @property
    def half_m(self) -> float:
        return self.corner.half_m


def measured(check: PathCheck, flight: Flight, limits: FlightLimits) -> dict[str, Any]:
    """The content of `metrics.json` of a path that was flown.

    On top of what a flight has: `deviation_from_given_m`, `contact`, `breaches`, and under `check` the verdict, the
    corners that had to be cut, and what was given.

    Args:
        check: what was asked.
        flight: what was flown.
        limits: what it is measured against.
    """
    track, tolerance = flight.track, limits.cross_track_threshold_m
    corners = [_Corner(corner, check.allowed_cut_m(corner.waypoint)) for corner in check.way.corners]
    window = WINDOW_RADII * limits.turn_radius_m
    found = deviation(track, check.way.given_m, SPACING_SHARE * tolerance, window)
    as_given = AsGiven(corners, found.by_row_m, allowed_m(track, tolerance, corners))
    figures = metrics(flight, limits, as_given)
    world = World.from_scenario(check.scenario)
    seen = kept(track, world, check.given.fences, check.bounded)
    if seen.contacts and flight.outcome is not Outcome.COLLISION:
        first = seen.contacts[0]
        figures["outcome"] = Outcome.COLLISION.value
        figures["reason"] = f"touched {first.name} after {first.start_s:.0f} s; {flight.reason}"
    figures["trackable"] = figures["trackable"] and figures["outcome"] == Outcome.REACHED.value
    given = polyline_profile(check.way.waypoints_m, float(track.groundspeed_mps.mean()))
    ok, sentence = verdict(figures, seen, check.given.drawn, tolerance)
    return {
        **figures,
        **_kept_figures(seen),
        "deviation_from_given_m": found.figures(),
        "check": {
            "ok": ok,
            "verdict": sentence,
            "drawn": check.given.drawn,
            "points": len(check.given.points_m),
            "given": dataclasses.asdict(smoothness(given, max(float(track.groundspeed_mps.mean()), 1e-3))),
            "corners": [_passed(corner, flight) for corner in corners],
            "fences": [fence.plain() for fence in check.given.fences.every],
            "notes": list(check.given.notes),
        },
    }


def _kept_figures(seen: Kept) -> dict[str, Any]:
    return {
        "min_clearance_m": seen.margin_m if np.isfinite(seen.margin_m) else None,
        "contact": bool(seen.contacts),
        "contacts": [each.plain() for each in seen.contacts],
        "breaches": [each.plain() for each in seen.crossings],
    }


def _passed(corner: _Corner, flight: Flight) -> dict[str, Any]:
    """What is told of a corner; `flown_cut_m` is None where the aircraft did not get there."""
    track, place = flight.track, corner.corner
    about = np.abs(track.arc_length_m - corner.arc_length_m) <= corner.half_m + corner.allowed_cut_m
    away_m = np.hypot(track.east_m - place.east_m, track.north_m - place.north_m)[about]
    flown = float(away_m.min()) if len(away_m) else None
    return {
        **dataclasses.asdict(place),
        "flown_cut_m": flown,
        "allowed_cut_m": corner.allowed_cut_m,
        "kept": flown is not None and flown <= corner.allowed_cut_m,
    }
