"""A given path and what it is flown with: the scenario about it, what is asked of it, and the flight."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from harness.files import strict_yaml
from harness.files.input_file import InputError
from harness.files.strict_yaml import Node, node_of
from harness.flight.closed_loop import Loop
from harness.flight.observer import Progress
from harness.run.path_flight import PathPlan, fly_along, planned
from harness.run.path_verdict import measured
from harness.run.scenario_flight import flight_limits, fly_to_folder, jsbsim_aircraft, make_loop
from harness.run_files.given_path import GIVEN, SAME_PLACE_M, FloatArray
from harness.run_files.mission.vertices import corner_limit_m
from harness.run_files.path_files import PathAsGiven
from harness.scenario.environment import GroundSpec
from harness.scenario.files_resolved import spec_of
from harness.scenario.obstacles import WorldFile
from harness.scenario.overrides import overridden, with_key
from harness.scenario.scenario import Scenario, validated

if TYPE_CHECKING:
    from harness.world_files.expansion import FileSpec

MARGIN_M, MARGIN_SHARE = 1000.0, 0.25
"""The area of a checked path reaches this far beyond it: this length, and this share of its span."""

OF_THE_WORLD: Final = (
    "seed",
    "area",
    "obstacles",
    "ground",
    "sources",
    "environment",
    "conditions",
    "uncertainty",
)
"""Sections that a check takes from a scenario that it flies a path in; mission, aircraft and sensor are its own."""

KEYS_OF_THE_WORLD: Final = (
    *(("mission", "altitude_m"), ("planner", "clearance_m")),
    *(("trackability", "cross_track_m"), ("trackability", "altitude_m")),
)
"""Single keys that it takes from there too: the altitude, and what sets the limits."""


@dataclass(frozen=True, eq=False)
class _Keys:
    """What the scenario of a path is made of, beside the path."""

    name: str
    sections: Mapping[str, Mapping[str, Any]]
    """`aircraft`, `environment`, ... as in a file; what is left out has its default."""
    overrides: Sequence[tuple[str, str]]
    world: FilePath | None
    """A scenario file with obstacles, area, air, altitude, clearance and seed; None: nothing is there."""

    @property
    def folder(self) -> FilePath | None:
        """Where files are that the world names."""
        return None if self.world is None else self.world.parent

    @property
    def has_bounds(self) -> bool:
        """Whether somebody named the bounds of the area; else they only reach beyond the path."""
        named = any(key.strip().startswith("area") and "origin" not in key for key, _ in self.overrides)
        return named or self.world is not None or "bounds_m" in self.sections.get("area", {})

    def scenario(
        self, points_m: FloatArray, files: bool = True, ground: GroundSpec | None = None
    ) -> Scenario:
        """The mission of a path (n, 2) as a scenario: from its start to its end, or to where it is furthest from there.

        Start and goal may lie anywhere, in an obstacle too: that is then what the flight finds. Without `files` those
        among the obstacles are left out, for a path that is not flown at one altitude, and `ground` stands in place of
        what they say of it.

        Raises:
            InputError: the keys contradict each other; the fault names the key.
        """
        root = self._root(points_m)
        if not files:
            kept = tuple(each for each in _obstacles(root) if each.at(("file",)) is None)
            root = with_key(root, ("obstacles",), Node(kept, root.line))
            if ground is not None:
                root = with_key(root, ("ground",), node_of(ground.model_dump(), strict_yaml.COMMAND_LINE))
        source = "command line" if self.world is None else str(self.world)
        return validated(root, source, self.folder, ends_checked=False)

    def files(self, points_m: FloatArray) -> tuple[FileSpec, ...]:
        """The files among the obstacles."""
        found = [each.at(("file",)) for each in _obstacles(self._root(points_m))]
        return tuple(spec_of(WorldFile.model_validate(file.plain()), self.folder) for file in found if file)

    def _root(self, points_m: FloatArray) -> Node:
        root = self._of_the_world()
        start, far = points_m[0], np.hypot(*(points_m - points_m[0]).T)
        goal_radius = min(100.0, float(0.25 * far.max()))
        goal = points_m[-1] if far[-1] > 2.0 * goal_radius else points_m[int(far.argmax())]
        out = points_m[int(np.argmax(far > SAME_PLACE_M))] - start
        mission = {
            "start_m": start.tolist(),
            "course_deg": math.degrees(math.atan2(out[0], out[1])) % 360.0,
            "goal_m": goal.tolist(),
            "goal_radius_m": goal_radius,
        }
        lowest, highest = points_m.min(axis=0), points_m.max(axis=0)
        margin = MARGIN_M + MARGIN_SHARE * float((highest - lowest).max())
        bounds_m = [*(lowest - margin).tolist(), *(highest + margin).tolist()]
        area = {} if root.at(("area", "bounds_m")) else {"bounds_m": bounds_m}
        every: dict[str, Any] = {"schema": "wayproof/scenario/1", "name": self.name, **self.sections}
        every["area"] = {**area, **self.sections.get("area", {})}
        every["mission"] = {**mission, **self.sections.get("mission", {})}
        for key, section in every.items():
            if isinstance(section, Mapping):
                for name, value in section.items():
                    root = with_key(root, (key, name), node_of(value, strict_yaml.COMMAND_LINE))
            else:
                root = with_key(root, (key,), node_of(section, strict_yaml.COMMAND_LINE))
        return overridden(root, self.overrides)

    def _of_the_world(self) -> Node:
        """What is taken from the world."""
        if self.world is None:
            return Node({}, strict_yaml.COMMAND_LINE)
        root = strict_yaml.read(self.world)
        validated(root, str(self.world), self.world.parent)  # its faults are told as those of a scenario
        assert isinstance(root.value, dict)
        base = Node({key: node for key, node in root.value.items() if key in OF_THE_WORLD}, root.line)
        for section, key in KEYS_OF_THE_WORLD:
            written = root.at((section, key))
            base = base if written is None else with_key(base, (section, key), written)
        return base


def _obstacles(root: Node) -> tuple[Node, ...]:
    listed = root.at(("obstacles",))
    return listed.value if listed is not None and isinstance(listed.value, tuple) else ()


@dataclass(frozen=True, eq=False)
class PathCheck:
    """A path, and what it is to be flown and judged with."""

    given: PathAsGiven
    scenario: Scenario
    plan: PathPlan
    bounded: bool = False
    """The bounds of the area were named, and must not be crossed."""
    corner_m: float | None = None
    """How far off a corner may be passed; None: what `allowed_cut_m` says."""
    files: tuple[FileSpec, ...] = ()
    """Files among the obstacles, for a path that is not flown at one altitude."""

    @cached_property
    def _accepted_m(self) -> dict[int, float]:
        """How far from it an item lets the aircraft pass."""
        return (
            {step.item: step.acceptance_m for step in self.given.mission.steps} if self.given.mission else {}
        )

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
    """A path that was flown, its metrics as in `metrics.json`, and the run folder, where one was written."""

    check: PathCheck
    metrics: dict[str, Any]
    folder: FilePath | None = None

    @property
    def ok(self) -> bool:
        """Whether it can be flown: tracked, no contact, no fence or bound crossed."""
        return bool(self.metrics["check"]["ok"])


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

    Raises:
        InputError: they contradict each other; the fault names the key.
    """
    if world is not None and given.origin_deg is not None and origin_of(world) is None:
        raise InputError(f"{world}: area.origin: is missing; a path in degrees needs it")
    own = {key: dict(section) for key, section in sections.items()}
    mission = own["mission"] = {**own.get("mission", {}), **_altitude(given, altitude_m)}
    if world is None and given.origin_deg is not None:
        latitude, longitude = given.origin_deg
        own["area"] = {"origin": {"latitude_deg": latitude, "longitude_deg": longitude}}
    keys = _Keys(name, own, settings, world)
    scenario = keys.scenario(about(given.points_m))
    field = None if scenario.ground is None else scenario.ground.field()
    plan = planned(given, scenario, altitude_m, None if field is None else field.at, corner_m)
    files: tuple[FileSpec, ...] = ()
    if not given.drawn or given.above_ground or not plan.profile.level:
        # Now it is known where and how high it begins, and how high the obstacles matter.
        east, north = plan.way.segments[0, 2:4].tolist()
        mission["course_deg"] = math.degrees(math.atan2(east, north)) % 360.0
        mission["altitude_m"] = float(plan.profile.altitude_m[0])
        level, line = plan.profile.level, plan.way.given_m[:, :2]
        scenario = keys.scenario(line, files=level, ground=scenario.ground)
        files = () if level else keys.files(line)
    return PathCheck(given, scenario, plan, keys.has_bounds, corner_m, files)


def _altitude(given: PathAsGiven, altitude_m: float | None) -> dict[str, float]:
    """The key of the altitude, where it is asked for or the path has one."""
    if altitude_m is None and len(given.altitudes_m) and not given.above_ground:
        altitude_m = float(given.altitudes_m[0])
    return {} if altitude_m is None else {"altitude_m": altitude_m}


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

    Raises:
        AircraftError: the aircraft cannot be loaded or trimmed; nothing is written.
        RunFolderError: the folder holds something else or cannot be written.
    """
    flown_by = partial(fly_along, check.plan)
    make = partial(_loop, check.plan.climb_limit_mps)
    if out is None:
        flight = flown_by(make(check.scenario), (), progress)
        return CheckedPath(check, measured(check, flight, flight_limits(check.scenario, planned=False)))
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
