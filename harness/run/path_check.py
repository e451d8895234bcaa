"""Whether a path can be flown as it was given: flies it and says so, and what was touched or crossed on the way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.files.input_file import InputError
from harness.flight.closed_loop import Loop
from harness.flight.observer import Progress
from harness.run.path_flight import fly_along
from harness.run.path_plan import PathPlan, planned
from harness.run.path_scenario import files_of, has_bounds, scenario_for
from harness.run.path_verdict import measured
from harness.run.scenario_flight import flight_limits, fly_to_folder, jsbsim_aircraft, make_loop
from harness.run_files.given_path import GIVEN, SAME_PLACE_M, FloatArray
from harness.run_files.mission.flying import corner_limit_m
from harness.run_files.path_files import PathAsGiven, given_points, read_path
from harness.scenario.scenario import Scenario

if TYPE_CHECKING:
    from harness.world_files.expansion import FileSpec


@dataclass(frozen=True, eq=False)
class PathCheck:
    """A path, and what it is to be flown and judged with.

    Attributes:
        given: the path, with its fences.
        scenario: aircraft, air, obstacles, altitude and thresholds.
        plan: what is flown.
        bounded: the bounds of the area were named, and must not be crossed.
        corner_m: how far off a corner may be passed; None: what `allowed_cut_m` says.
        files: among the obstacles, for a path that is not flown at one altitude.
    """

    given: PathAsGiven
    scenario: Scenario
    plan: PathPlan
    bounded: bool = False
    corner_m: float | None = None
    files: tuple[FileSpec, ...] = ()

    @cached_property
    def _accepted_m(self) -> dict[int, float]:
        """How far from it an item lets the aircraft pass."""
        if self.given.mission is None:
            return {}
        return {step.item: step.acceptance_m for step in self.given.mission.program.steps}

    def allowed_cut_m(self, waypoint: int) -> float:
        """How far off a corner may be passed; nothing of the aircraft or its guidance enters.

        It is `corner_m` where that is given. Else a drawn path is to be flown as drawn: it is the cross-track limit. At
        a waypoint of a mission it is the acceptance radius of the file, else `CORNER_M`.
        """
        if self.corner_m is not None:
            return self.corner_m
        if self.given.drawn:
            return self.scenario.trackability.cross_track_m
        return corner_limit_m(self._accepted_m.get(waypoint, 0.0), None)


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
    given: PathAsGiven,
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
    if world is not None and given.origin_deg is not None and origin_of(world) is None:
        raise InputError(f"{world}: area.origin: is missing; a path in degrees needs it")
    own: dict[str, dict[str, Any]] = {key: dict(section) for key, section in sections.items()}
    mission = own.setdefault("mission", {})
    if altitude_m is not None:
        mission["altitude_m"] = altitude_m
    elif len(given.altitudes_m) and not given.above_ground:
        mission["altitude_m"] = float(given.altitudes_m[0])
    if world is None and given.origin_deg is not None:
        latitude, longitude = given.origin_deg
        own["area"] = {"origin": {"latitude_deg": latitude, "longitude_deg": longitude}}
    scenario = scenario_for(name, about(given.points_m), own, settings, world)
    field = None if scenario.ground is None else scenario.ground.field()
    plan = planned(given, scenario, altitude_m, None if field is None else field.at, corner_m)
    files: tuple[FileSpec, ...] = ()
    if not given.drawn or given.above_ground or not plan.profile.level:
        # Now it is known where and how high it begins, and how high the obstacles matter.
        east, north = plan.way.segments[0, 2:4].tolist()
        mission["course_deg"] = math.degrees(math.atan2(east, north)) % 360.0
        mission["altitude_m"] = float(plan.profile.altitude_m[0])
        level, line = plan.profile.level, plan.way.given_m[:, :2]
        scenario = scenario_for(name, line, own, settings, world, files=level, ground=scenario.ground)
        files = () if level else files_of(sections, settings, world)
    return PathCheck(given, scenario, plan, has_bounds(own, settings, world), corner_m, files)


def about(points_m: FloatArray) -> FloatArray:
    """Points, and one more where they are all in one place, as a mission's may be."""
    if np.ptp(points_m, axis=0).max() > SAME_PLACE_M:
        return points_m
    return np.concatenate((points_m, points_m[:1] + 1000.0))


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
    flown_by = partial(fly_along, check.plan, check.scenario.guidance.kind)
    make = partial(_loop, check.plan.climb_limit_mps)
    if out is None:
        flight = flown_by(make(check.scenario), (), progress)
        return CheckedPath(check, measured(check, flight, flight_limits(check.scenario)))
    figures = fly_to_folder(
        check.scenario,
        out,
        recording,
        progress,
        make=make,
        pilot=GIVEN,
        flown_by=flown_by,
        measured_by=partial(measured, check),
        command=command,
        profile=None if check.plan.profile.level else check.plan.profile.altitudes,
    )
    return CheckedPath(check, figures, out)


def _loop(climb_limit_mps: float | None, scenario: Scenario) -> Loop:
    """The parts of a flight whose altitude loop may climb and sink by so much."""
    if climb_limit_mps is None:
        return make_loop(scenario)
    return make_loop(scenario, partial(jsbsim_aircraft, scenario, climb_limit_mps=climb_limit_mps))
