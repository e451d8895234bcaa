"""The check of a given path: the scenario that it is flown in, the limits, and the flight."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from hashlib import sha256
from operator import attrgetter
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from aircraft.interface import FloatArray
from harness.files import strict_yaml
from harness.files.input_file import InputError
from harness.files.strict_yaml import COMMAND_LINE, IN_PATH, Loc, Node, key_path, node_of
from harness.flight.observer import Progress
from harness.run import scenario_flight
from harness.run.path_flight import PathCheck, fly_along, plan_path
from harness.run.path_verdict import measure
from harness.run_files.given_path import GIVEN, SAME_PLACE_M
from harness.run_files.path_files import PathAsGiven, read_path
from harness.run_files.run_folder import MANIFEST
from harness.scenario.files_resolved import spec_of
from harness.scenario.kinds import source_digests
from harness.scenario.obstacles import Obstacle
from harness.scenario.performance import performance_of
from harness.scenario.scenario import Scenario, overridden, validated, with_key

if TYPE_CHECKING:
    from harness.world_files.parts import FileSpec

MARGIN_M, MARGIN_SHARE = 1000.0, 0.25
"""The area of a checked path reaches this far beyond it: this length, and this share of its span."""
SHOWN_RADII: Final = 1.5  # turn radii about the path that its recording shows, unless the area is given
WORLD_SECTIONS: Final = (
    *("seed", "area", "obstacles", "ground", "sources"),
    *("environment", "conditions", "navigation", "uncertainty", "normals"),
)
"""Sections that a check takes from the scenario in which it flies a path; mission, aircraft and sensor are its own."""
WORLD_KEYS: Final = (
    *(("mission", "altitude_m"), ("trackability", "altitude_m")),
    *(("trackability", "airspeed_mps"), ("trackability", "load_factor")),
    *(("planner", "clearance_m"), ("trackability", "cross_track_m")),
)
"""Single keys that a check takes from that scenario: the altitude, and the keys from which its limits follow."""
UNUSED_KEYS: Final = r"(sensor|planner|mission)\b(?!\.(clearance|altitude|goal_radius)_m$)"
"""Keys that have no effect on a given path begin so: the sensor, the planner, start and goal, the time limit."""


def origin_of(world: FilePath | None, settings: Sequence[tuple[str, str]]) -> tuple[float, float] | None:
    """Reads latitude and longitude of a world's origin; None if it gives none. An InputError says it is no scenario."""
    origin = _world_root(world, settings).at(("area", "origin"))
    return None if origin is None else (origin.plain()["latitude_deg"], origin.plain()["longitude_deg"])


@dataclass(frozen=True)
class CheckedFile:
    """The file of a path and what `wayproof check` is given with it: keys of a scenario, `aircraft.model` among them.

    World, altitude and corner are as `prepare_check` has them; `laws` are guidance laws as FILE.py:NAME or MODULE:NAME.
    """

    file: FilePath
    settings: Sequence[tuple[str, str]]
    world: FilePath | None = None
    altitude_m: float | None = None
    corner_m: float | None = None
    laws: tuple[str, ...] = ()

    @cached_property
    def given(self) -> PathAsGiven:
        """The path; its altitudes are left out where another is set."""
        level = self.altitude_m is not None or "mission.altitude_m" in dict(self.settings)
        return read_path(self.file, level, origin_of(self.world, self.settings))

    def prepared(self, day: Sequence[tuple[str, str]] = ()) -> PathCheck:
        """Prepares its check, with further keys of a day; errors as `prepare_check`."""
        name = (re.sub(r"[^a-z0-9._-]+", "-", self.file.stem.lower()).strip("-.") or "path")[:100]
        beside: dict[str, Any] = {"altitude_m": self.altitude_m, "corner_m": self.corner_m}
        return prepare_check(self.given, [*self.settings, *day], world=self.world, name=name, **beside)

    def command(self, day: Sequence[tuple[str, str]] = ()) -> list[str]:
        """Returns the command that checks it again, with further keys of a day, without what these replace."""
        model = strict_yaml.parse(dict(self.settings)["aircraft.model"], "aircraft.model").plain()
        beside = {"--scenario": self.world, "--altitude-m": self.altitude_m, "--corner-m": self.corner_m}
        options = [("--aircraft", model), *(("--guidance", law) for law in self.laws)]
        options += [(option, str(value)) for option, value in beside.items() if value is not None]
        own = ("aircraft.model", *("guidance.kind" for _ in self.laws))
        every = [*self.settings, *day]
        options += [
            ("--set", f"{key}={value}")
            for number, (key, value) in enumerate(every, start=1)
            if key not in own and not any(f"{key}.".startswith(f"{later}.") for later, _ in every[number:])
        ]
        return ["wayproof", "check", str(self.file), *(each for pair in options for each in pair)]

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of all that it consists of, also files of laws and obstacles: a change of it makes other days."""
        files = [each.sha256 for each in self.prepared().scenario.sources or ()], source_digests(self.laws)
        beside = self.settings, self.altitude_m, self.corner_m, self.world and self.world.read_text(), files
        return sha256(f"{self.file.read_bytes().hex()} {beside}".encode()).hexdigest()


def prepare_check(
    given: PathAsGiven,
    settings: Sequence[tuple[str, str]] = (),
    *,
    world: FilePath | None = None,
    altitude_m: float | None = None,
    corner_m: float | None = None,
    name: str = "path",
) -> PathCheck:
    """Prepares the check of a path; an InputError names the key that cannot be used.

    `settings` are keys of a scenario, by key path, and values as YAML, `aircraft.model` among them. `world` is a
    scenario file with obstacles, area, air, altitude, clearance and seed; without it nothing is there. The altitude is
    that of the path, else of the world, else 300 m, unless it or its key is given. `corner_m` is as `PathCheck` has it.
    """
    if corner_m is not None and not 0.0 <= corner_m < math.inf:
        raise InputError(f"command line: --corner-m: is {corner_m:g}; must be at least 0, and finite")
    refuse_unused(settings, UNUSED_KEYS, "a given path")
    base, folder = _world_root(world, settings), None if world is None else world.parent
    keys = {("name",): name, **_own_keys(given, base, altitude_m)}
    if given.origin_deg is not None and world and base.at(("area", "origin")) is None:
        raise InputError(f"{world}: area.origin: is missing; a path in degrees needs it")
    validly = partial(validated, source=str(world or "command line"), folder=folder, ends_checked=False)
    root = overridden(_with_keys(base, {**_mission_keys(given.points_m, base), **keys}), settings)
    scenario = validly(root)
    origin = scenario.area.origin
    if given.origin_deg not in (None, (origin.latitude_deg, origin.longitude_deg)):
        raise InputError("command line: area.origin: is not that of the path in degrees; leave it out")
    altitude_m = _set_altitude_m(settings, scenario, altitude_m)
    ground = None if scenario.ground is None else scenario.ground.field().at
    plan, first = plan_path(given, scenario, altitude_m, ground, corner_m), scenario
    files: tuple[FileSpec, ...] = ()
    course_deg = math.degrees(math.atan2(*plan.way.segments[0, 2:4].tolist())) % 360.0
    level = given.mission is None and not given.above_ground and plan.profile.level
    if not (level and math.isclose(course_deg, scenario.mission.course_deg, abs_tol=1e-3)):
        # Now it is known where and how high it begins, and how high the obstacles matter.
        keys["mission", "course_deg"] = course_deg
        keys["mission", "altitude_m"] = Node(float(plan.profile.altitude_m[0]), IN_PATH)
        given_m = plan.way.given_m[:, :2]
        root = overridden(_with_keys(base, {**_mission_keys(given_m, base), **keys}), settings)
        if not plan.profile.level:
            root, files = _without_files(root, folder, scenario)
        scenario = validly(root)
        if (scenario.environment, performance_of(scenario)) != (first.environment, performance_of(first)):
            plan = plan_path(given, scenario, altitude_m, ground, corner_m)
    named = [key for key, _ in settings if key.strip().startswith("area") and "origin" not in key]
    again = partial(prepare_check, given, settings, world=world, altitude_m=altitude_m, name=name)
    return PathCheck(given, scenario, plan, again, bool(named or world), corner_m, files)


def refuse_unused(settings: Sequence[tuple[str, str]], unused: str, flown: str) -> None:
    """Raises InputError for a key that begins as the pattern `unused`: it has no effect on what is flown."""
    for key, text in settings:
        given = strict_yaml.parse(text, f"command line: {key}").plain()
        for name in [f"{key.strip()}.{each}" for each in given] if isinstance(given, dict) else [key.strip()]:
            if re.match(unused, name):
                raise InputError(f"command line: {name}: has no effect on {flown}; leave it out")


def _set_altitude_m(settings: Sequence[tuple[str, str]], scenario: Scenario, altitude_m: float | None) -> float | None:
    """Returns the altitude that is given, as an argument or by its key; None if by neither."""
    if not any(key.strip() == "mission.altitude_m" for key, _ in settings):
        return altitude_m
    if altitude_m not in (None, set_m := scenario.mission.altitude_m):
        text = f"is {set_m:g} beside --altitude-m {altitude_m:g}; leave one out"
        raise InputError(f"command line: mission.altitude_m: {text}")
    return set_m


def _own_keys(given: PathAsGiven, base: Node, altitude_m: float | None) -> dict[Loc, Any]:
    """Returns the keys of a scenario that a path gives itself: altitude, origin."""
    keys: dict[Loc, Any] = {("schema",): "wayproof/scenario/1"}
    if altitude_m is not None:
        keys["mission", "altitude_m"] = altitude_m
    elif len(given.altitudes_m) and not given.above_ground:
        keys["mission", "altitude_m"] = Node(float(given.altitudes_m[0]), IN_PATH)
    if base.at(("area", "origin")) is None and given.origin_deg is not None:
        latitude, longitude = given.origin_deg
        keys["area", "origin"] = {"latitude_deg": latitude, "longitude_deg": longitude}
    return keys


def _world_root(world: FilePath | None, settings: Sequence[tuple[str, str]]) -> Node:
    """Reads the keys of the world's scenario that a check takes over; without an aircraft it has that of the check."""
    if world is None:
        return Node({}, COMMAND_LINE)
    root = strict_yaml.read(world)
    own = [each for each in settings if each[0].startswith("aircraft") and not root.at(("aircraft",))]
    # Its faults are reported as those of a scenario; how near to obstacles it may begin depends on its own aircraft.
    whole = validated(overridden(root, own), str(world), world.parent, ends_checked=not own)
    if layered := [each.path for each in whole.sources or () if each.in_layers]:
        text = f"the obstacles of {layered[0]} were looked at in layers along a path, and none stand here"
        raise InputError(f"{world}: sources: {text}; give the scenario that names the file")
    derived = _derived_keys(whole) if (world.parent / MANIFEST).is_file() else ()
    base = Node({}, root.line)
    for loc in (*((section,) for section in WORLD_SECTIONS), *WORLD_KEYS):
        if (written := root.at(loc)) is not None and loc not in derived:
            base = with_key(base, loc, written)
    return base


def _derived_keys(world: Scenario) -> tuple[Loc, ...]:
    """Returns keys of limits, and navigation, of a run folder's scenario that say what they would be if left out."""
    found: list[Loc] = []
    for keys in (WORLD_KEYS[-2:], WORLD_KEYS[-1:], WORLD_KEYS[2:3], WORLD_KEYS[3:4], (("navigation",),)):
        names = [key_path(key) for key in keys]
        values = attrgetter(*names)
        with suppress(InputError):  # with another clearance start and goal may be too near to obstacles
            if values(world.with_(dict.fromkeys(names))) == values(world):
                found += keys
    return tuple(found)


def _with_keys(root: Node, keys: Mapping[Loc, Any]) -> Node:
    for loc, value in keys.items():
        root = with_key(root, loc, value if isinstance(value, Node) else node_of(value, COMMAND_LINE))
    return root


def _mission_keys(points_m: FloatArray, base: Node) -> dict[Loc, Any]:
    """Returns the keys of a mission from the start of a path (n, 2) to its end, or its point furthest from there.

    Start and goal may lie anywhere, in an obstacle too: that is then what the flight finds.
    """
    if np.ptp(points_m, axis=0).max() <= SAME_PLACE_M:  # all in one place, as a mission's may be
        points_m = np.concatenate((points_m, points_m[:1] + 1000.0))
    start, far = points_m[0], np.hypot(*(points_m - points_m[0]).T)
    goal_radius = min(100.0, float(0.25 * far.max()))
    goal = points_m[-1] if far[-1] > 2.0 * goal_radius else points_m[int(far.argmax())]
    out = points_m[int(np.argmax(far > SAME_PLACE_M))] - start
    keys: dict[Loc, Any] = {
        ("mission", "start_m"): start.tolist(),
        ("mission", "course_deg"): math.degrees(math.atan2(out[0], out[1])) % 360.0,
        ("mission", "goal_m"): goal.tolist(),
        ("mission", "goal_radius_m"): goal_radius,
    }
    if base.at(("area", "bounds_m")) is None:
        lowest, highest = points_m.min(axis=0), points_m.max(axis=0)
        margin = MARGIN_M + MARGIN_SHARE * float((highest - lowest).max())
        keys["area", "bounds_m"] = [*(lowest - margin).tolist(), *(highest + margin).tolist()]
    return keys


def _without_files(root: Node, folder: FilePath | None, whole: Scenario) -> tuple[Node, tuple[FileSpec, ...]]:
    """Takes the files out of the obstacles, for a path of several altitudes; returns the keys left, and the files."""

    def entries(section: str) -> tuple[Node, ...]:
        listed = root.at((section,))
        return listed.value if listed is not None and isinstance(listed.value, tuple) else ()

    if whole.ground is not None:
        root = _with_keys(root, {("ground",): whole.ground.model_dump()})
    if any(each.at(("altitude_m",)) for each in entries("sources")):
        held = "files cut at one altitude, as a run folder has them, and the path has several"
        raise InputError(f"command line: the obstacles are {held}: give the scenario that names the files")
    nodes = tuple(each for each in entries("obstacles") if each.at(("file", "path")) is None)
    named = (each for each in entries("obstacles") if each.at(("file", "path")) is not None)
    made = (Obstacle.model_validate(each.plain()) for each in named)
    specs = tuple(replace(spec_of(each.file, folder), active_s=each.active_s) for each in made if each.file)
    if specs:
        plain = {"polygons": 0, "altitude_m": None, "in_layers": True}
        layered = [{**each.model_dump(), **plain} for each in whole.sources or ()]
        root = _with_keys(root, {("sources",): layered})
    return with_key(root, ("obstacles",), Node(nodes, root.line)), specs


def fly_check(
    check: PathCheck,
    out: FilePath | None = None,
    recording: bool = False,
    progress: Progress | None = None,
    command: str | None = None,
) -> dict[str, Any]:
    """Flies a path, into a run folder if one is named, and returns its `metrics.json`; errors as `fly_to_folder`.

    With a folder, the corner limit that a no tells has been flown.
    """
    scenario, profile = check.scenario, check.plan.profile
    model = partial(scenario_flight.jsbsim_aircraft, scenario, climb_limit_mps=check.plan.climb_limit_mps)
    make = partial(scenario_flight.make_loop, make_model=model)
    if out is None:
        flight = fly_along(check, make(scenario), (), progress)
        return measure(check, flight, scenario_flight.flight_limits(scenario, planned=False))

    given_m, room_m = check.plan.way.given_m[:, :2], SHOWN_RADII * performance_of(scenario).turn_radius_m
    around_m = *(given_m.min(axis=0) - room_m).tolist(), *(given_m.max(axis=0) + room_m).tolist()
    shown_m = None if check.bounded else around_m

    def flown_at(corner_m: float) -> dict[str, Any]:
        return fly_check(check.again(corner_m=corner_m), progress=progress)

    return scenario_flight.fly_to_folder(
        scenario,
        out,
        recording,
        progress,
        make=make,
        named=scenario_flight.RunNames(command),
        flown=scenario_flight.FlownAs(
            GIVEN,
            partial(fly_along, check),
            partial(measure, check, flown_at=flown_at),
            {"profile": None if profile.level else profile.altitudes, "shown_m": shown_m},
        ),
    )
