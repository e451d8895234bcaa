"""Scenario files: the type that is the file format, reading and writing it, and what a planner is told of it.

A loaded scenario is complete: defaults that depend on other keys are filled in, and keys that contradict each
other have been refused.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from pydantic import FailFast, Strict, ValidationError, ValidationInfo, model_validator

from harness.files import strict_yaml
from harness.files.strict_yaml import COMMAND_LINE, Node
from harness.files.wording import counted
from harness.files.yaml_pieces import dump_in_pieces
from harness.scenario import guidance_keys, planner_keys
from harness.scenario.checks import check_local_plane, check_start_and_goal
from harness.scenario.files_resolved import plane_point, resolved
from harness.scenario.ground import GroundSpec, SourceSpec
from harness.scenario.navigation import Navigation, planning_margin_m
from harness.scenario.obstacles import Obstacle
from harness.scenario.overrides import Given, changed, overridden
from harness.scenario.sections import (
    AircraftSpec,
    Area,
    Bounds,
    Environment,
    GuidanceSpec,
    MissionSpec,
    PlannerSpec,
    Section,
    Sensor,
    TrackabilitySpec,
    key,
)
from harness.scenario.shipped import scenario_path
from harness.scenario.simulation import Simulation, step_rate_hz
from harness.scenario.validation import KeyFault, input_error
from planner.geometry.margin import tolerance_m

if TYPE_CHECKING:
    from aircraft.interface import Performance
    from planner.interface import Mission

LEAST_CLEARANCE: Final = 0.02
"""Share of the turn radius that planners keep from obstacles at the least, where less is wanted."""
MAX_WIND_FRACTION: Final = 0.9
"""Wind from this fraction of the airspeed on is refused: against it an aircraft makes hardly any way."""

POUND_KG: Final = 0.45359237


class Scenario(Section):
    """One flight, completely described; flying it twice gives the same track bit for bit.

    Attributes equal the keys of the file, except `schema_`, which is `schema` there.
    """

    schema_: Literal["wayproof/scenario/1"] = key("Format and version.", alias="schema")
    name: str = key("Names the run folder.", pattern=r"^[a-z0-9._-]*[a-z0-9_-][a-z0-9._-]*$", max_length=100)
    seed: int = key("Root seed; every random stream derives from it.", unit="1", default=1, ge=0, le=2**53)
    area: Area = key("The area of operations.")
    obstacles: Annotated[tuple[Obstacle, ...], Strict(False), FailFast()] = key(
        "Unknown to the planner until sensed.", default=()
    )
    ground: GroundSpec | None = key(
        "The true ground. Default: that of terrain files among the obstacles.", default=None
    )
    sources: Annotated[tuple[SourceSpec, ...], Strict(False)] | None = key(
        "Files that obstacles and ground were made of. Default: none.", default=None
    )
    mission: MissionSpec = key("From where to where.")
    aircraft: AircraftSpec = key("What flies.", default_factory=AircraftSpec)
    sensor: Sensor = key("What it senses with.", default_factory=Sensor)
    planner: PlannerSpec = key("What plans.", default_factory=PlannerSpec)
    guidance: GuidanceSpec = key("What steers along the plan.", default_factory=GuidanceSpec)
    navigation: Navigation = key("What it believes of its state.", default_factory=Navigation)
    simulation: Simulation = key("How finely it is integrated.", default_factory=Simulation)
    environment: Environment = key("The air.", default_factory=Environment)
    trackability: TrackabilitySpec = key(
        "What a leg may be off before it counts as not trackable.", default_factory=TrackabilitySpec
    )

    @model_validator(mode="after")
    def _complete(self, info: ValidationInfo) -> Scenario:
        """Fills in derived defaults, each after those it depends on, and checks across sections."""
        folder = (info.context or {}).get("folder")
        given = Given({name: getattr(self, name) for name in self.model_fields_set}, folder)
        object.__setattr__(self, "_given", given)
        self._set("simulation", rate_hz=step_rate_hz(self.simulation.rate_hz, self.sensor))
        self._place_ends()
        found = model_or_folder(self.aircraft.model, folder)
        object.__setattr__(self, "aircraft", self.aircraft.model_copy(update={"model": found}))
        self._set("aircraft", airspeed_mps=_cruise_mps(self.aircraft))
        object.__setattr__(self, "guidance", guidance_keys.resolved(self.guidance, self.aircraft))
        performance = performance_of(self)
        radius_m = performance.turn_radius_m
        (x0, y0), (x1, y1) = self.mission.start_m, self.mission.goal_m
        wind_mps = self.environment.wind.speed_mps if self.environment.wind else 0.0
        slowest_s = math.hypot(x1 - x0, y1 - y0) / (self.aircraft.airspeed_mps - wind_mps)
        field_deg, rays = self.sensor.field_of_view_deg, self.sensor.rays
        self._set("sensor", range_m=_rounded_up(10 * radius_m, 100), beam_deg=field_deg / rays)
        self._set(
            "mission",
            course_deg=math.degrees(math.atan2(x1 - x0, y1 - y0)) % 360,
            goal_radius_m=_rounded_up(radius_m, 10),
            time_limit_s=_rounded_up(10 * slowest_s + 60, 60),
        )
        self._set("planner", clearance_m=_rounded_up(radius_m, 10))
        self._set("navigation", margin_m=self._navigation_margin_m(wind_mps, radius_m))
        self._set("sensor", least_width_m=max(self.planner.clearance_m, LEAST_CLEARANCE * radius_m))
        allowed_m = tolerance_m(self.planner.clearance_m, performance.tracking_error_m)
        self._set("trackability", cross_track_m=allowed_m)
        self._set(
            "trackability",
            altitude_m=max(10.0, self.trackability.cross_track_m),
            airspeed_mps=0.1 * self.aircraft.airspeed_mps,
            load_factor=_limit_load_factor(self.aircraft),
        )
        check_local_plane(self.area)
        names = self._expand_files(radius_m, folder)
        if (info.context or {}).get("ends_checked", True):
            check_start_and_goal(self.area, self.obstacles, self.mission, self.planner.clearance_m, names)
        object.__setattr__(self, "planner", planner_keys.resolved(self.planner, mission_of(self)))
        return self

    def _place_ends(self) -> None:
        """Puts start and goal that are given in degrees into the plane."""
        ends = {name: getattr(self.mission, name) for name in ("start", "goal")}
        given = {f"{name}_m": plane_point(place, self.area) for name, place in ends.items() if place}
        if given:
            update = {"start": None, "goal": None, **given}
            object.__setattr__(self, "mission", self.mission.model_copy(update=update))

    def _expand_files(self, turn_radius_m: float, folder: Path | None) -> tuple[str, ...]:
        """Makes obstacles and ground of files; returns what messages call each obstacle."""
        room_m = turn_radius_m + self.planner.clearance_m
        found = resolved(self.obstacles, self.area, self.ground, self.mission.altitude_m, room_m, folder)
        if found.sources:
            object.__setattr__(self, "obstacles", found.obstacles)
            object.__setattr__(self, "ground", found.ground)
            object.__setattr__(self, "sources", (*(self.sources or ()), *found.sources))
        return found.names

    def _navigation_margin_m(self, wind_mps: float, turn_radius_m: float) -> float:
        assert self.aircraft.airspeed_mps is not None
        assert self.mission.time_limit_s is not None
        return planning_margin_m(
            self.navigation,
            self.aircraft.airspeed_mps + wind_mps,
            self.mission.time_limit_s,
            unseen_m=math.pi * turn_radius_m,
        )

    def _set(self, name: str, **defaults: float) -> None:
        """Fills in those keys of a section that the file leaves out."""
        section: Section = getattr(self, name)
        missing = {key: value for key, value in defaults.items() if getattr(section, key) is None}
        object.__setattr__(self, name, section.model_copy(update=missing))

    def with_(self, keys: Mapping[str, Any]) -> Scenario:
        """This scenario with some keys changed, checked anew; defaults that follow from others are derived anew.

        A key counts as given where the scenario's file, or an earlier `with_`, named it; all others follow. A new
        `planner.kind` drops the own keys of the planner before. This scenario stays as it is.

        Args:
            keys: values by key path, as `{"seed": 3, "planner.clearance_m": 400, "obstacles[0].circle.radius_m": 50}`;
                plain values, numpy's, or sections. None stands for the default.

        Raises:
            InputError: the changed scenario is none that can be flown; the fault names the key.
        """
        given: Given = self.__dict__["_given"]
        return validated(changed(given, keys), "with_", given.folder)

    def __repr__(self) -> str:
        """A line for people; `dump_scenario` gives all of it."""
        return (
            f"Scenario({self.name}: {self.planner.kind}, {Path(self.aircraft.model).name}, seed {self.seed}, "
            f"{counted(len(self.obstacles), 'obstacle')})"
        )

    __str__ = __repr__


def load_scenario(path: str | Path, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """Reads a scenario file, every default filled in.

    Args:
        path: the file, or the name of a scenario that comes with wayproof, such as `paper_circles`.
        overrides: keys to replace before anything is checked, as (`"sensor.range_m"`, `"5000"`): key path and
            value as YAML; `obstacles[0].circle.radius_m` reaches into a list. A new `planner.kind` drops
            the own keys of the planner that the file names.

    Raises:
        InputError: the file cannot be read or is not a scenario; a line of its text names file, line and key.
    """
    path = scenario_path(str(path))
    root = strict_yaml.read(path)
    return validated(overridden(root, overrides), str(path), path.parent)


def parse_scenario(
    text: str, source: str = "scenario", ends_checked: bool = True, folder: Path | None = None
) -> Scenario:
    """Reads a scenario from text.

    Args:
        text: YAML.
        source: what faults name it.
        ends_checked: start and goal must keep the clearance; False for a scenario that a path was checked in.
        folder: files that it names are looked for there first.

    Raises:
        InputError: it is not a scenario.
    """
    return validated(strict_yaml.parse(text, source), source, folder, ends_checked=ends_checked)


def node_of_keys(keys: Mapping[str, Any]) -> Node:
    """Keys that a command has put together, as if they had been read; their faults name the command line.

    Raises:
        InputError: a value cannot be written in a scenario.
    """
    return strict_yaml.parse(strict_yaml.dump(dict(keys)), "command line").moved(COMMAND_LINE)


def scenario_of(keys: Mapping[str, Any], overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """A scenario from keys that a command has put together, every default filled in.

    Args:
        keys: as in a file; plain values.
        overrides: as `load_scenario` takes them.

    Raises:
        InputError: it is not a scenario; its faults name the command line.
    """
    return validated(overridden(node_of_keys(keys), overrides), "command line")


def dump_scenario(scenario: Scenario) -> str:
    """The YAML text of a scenario, all defaults written out; it loads back to an equal one, bit for bit."""
    return dump_in_pieces(scenario.model_dump(by_alias=True, exclude_none=True))


def packed(scenario: Scenario) -> bytes:
    """A complete scenario in few bytes, to be kept or sent; to make it again takes a millisecond."""
    return zlib.compress(scenario.model_dump_json(by_alias=True).encode(), level=1)


def unpacked(kept: bytes) -> Scenario:
    """What `packed` was given."""
    return Scenario.model_validate_json(zlib.decompress(kept))


def mission_of(scenario: Scenario) -> Mission:
    """What a planner is told before the flight.

    The clearance is that of `planner.clearance_m` and, on top, the margin for the error of the believed position. It is
    no less than `LEAST_CLEARANCE` of the turn radius: maps and searches have cells of its size. The same margin is kept
    from the border of the area, as far as start and goal lie within it.
    """
    from planner.interface import Mission

    performance, margin_m = performance_of(scenario), scenario.navigation.margin_m or 0.0
    return Mission(
        goal_m=scenario.mission.goal_m,
        goal_radius_m=scenario.mission.goal_radius_m,
        bounds_m=_inside(scenario.area.bounds_m, margin_m, scenario.mission.start_m, scenario.mission.goal_m),
        clearance_m=max(
            scenario.planner.clearance_m + margin_m,
            LEAST_CLEARANCE * performance.turn_radius_m,
        ),
        turn_radius_m=performance.turn_radius_m,
        speed_mps=performance.airspeed_mps,
        roll_in_s=performance.roll_in_s,
        tracking_error_m=performance.tracking_error_m,
        sensor_range_m=scenario.sensor.range_m,
        compute_latency_s=scenario.planner.compute_latency_s,
        sensor_latency_s=scenario.sensor.latency_s,
        wind_mps=_wind_mps(scenario.environment),
    )


def _inside(bounds_m: Bounds, margin_m: float, *places_m: tuple[float, float]) -> Bounds:
    """Bounds that are smaller by a margin on each side, but hold some places."""
    xmin, ymin, xmax, ymax = bounds_m
    return (
        min(xmin + margin_m, *(east for east, _ in places_m)),
        min(ymin + margin_m, *(north for _, north in places_m)),
        max(xmax - margin_m, *(east for east, _ in places_m)),
        max(ymax - margin_m, *(north for _, north in places_m)),
    )


def performance_of(scenario: Scenario) -> Performance:
    """What the scenario's aircraft can do at its airspeed under its guidance, in its wind, gust and turbulence.

    Raises:
        KeyFault: there is no such aircraft, it cannot hold the airspeed, the wind is too strong for it, or the guidance
            law does not track with it.
    """
    from aircraft.airframes import AircraftError
    from aircraft.envelope import performance

    spec, air = scenario.aircraft, scenario.environment
    wind_mps = _wind_mps(air)
    if wind_mps >= MAX_WIND_FRACTION * spec.airspeed_mps:
        raise KeyFault(
            ("environment", "wind", "speed_mps"),
            f"is {wind_mps:g}; must be below {MAX_WIND_FRACTION:g} of the airspeed {spec.airspeed_mps:g} m/s",
        )
    try:
        gusts = air.turbulence.intensity if air.turbulence else None
        front_mps = air.gust.speed_mps if air.gust else 0.0
        frame = guidance_keys.airframe_of(spec)
        frame.check_airspeed(spec.airspeed_mps)
        law = guidance_keys.card_of(scenario.guidance, spec)
        return performance(frame, spec.airspeed_mps, wind_mps, gusts, front_mps, law)
    except AircraftError as error:
        raise KeyFault(("aircraft", "airspeed_mps"), str(error)) from error


def _wind_mps(air: Environment) -> float:
    return air.wind.speed_mps if air.wind else 0.0


def scenario_schema() -> dict[str, Any]:
    """JSON Schema of the format, the own keys of every known planner included."""
    schema = Scenario.model_json_schema()
    schema["properties"]["planner"] = planner_keys.json_schema(schema["$defs"].pop("PlannerSpec"))
    schema["properties"]["guidance"] = guidance_keys.json_schema(schema["$defs"].pop("GuidanceSpec"))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def validated(root: Node, source: str, folder: Path | None = None, ends_checked: bool = True) -> Scenario:
    """A scenario from what was read, every default filled in.

    Args:
        root: its keys.
        source: what faults name it.
        folder: where the folder of an aircraft, and files of obstacles, are sought first.
        ends_checked: start and goal must keep the clearance from obstacles and lie in the area.

    Raises:
        InputError: it is not a scenario.
    """
    try:
        context = {"folder": folder, "ends_checked": ends_checked}
        return Scenario.model_validate(root.plain(), context=context)
    except ValidationError as error:
        raise input_error(error, Scenario, root, source) from error


def model_or_folder(model: str, folder: Path | None) -> str:
    """The aircraft's name, or the absolute path of its folder: beside the scenario file, or from here."""
    if "/" not in model and model in _aircraft_names():
        return model
    for place in (Path() if folder is None else folder, Path()):
        try:
            if (place / model).expanduser().is_dir():
                return str((place / model).expanduser().resolve())
        except (OSError, RuntimeError):  # too long, not allowed, or the home of nobody: no folder
            continue
    return model


def _aircraft_names() -> tuple[str, ...]:
    from aircraft.airframes import aircraft_names

    return aircraft_names()


def _cruise_mps(spec: AircraftSpec) -> float:
    from aircraft.airframes import AircraftError, airframe

    try:
        airframe(spec.model)
    except AircraftError as error:
        raise KeyFault(("aircraft", "model"), str(error)) from error
    try:
        return guidance_keys.airframe_of(spec).cruise_mps
    except AircraftError as error:
        raise KeyFault(("aircraft", "actuators"), str(error)) from error


def _limit_load_factor(spec: AircraftSpec) -> float:
    weight_lb = guidance_keys.airframe_of(spec).mass_kg / POUND_KG
    return min(3.8, 2.1 + 24000.0 / (weight_lb + 10000.0))


def _rounded_up(value: float, step: int) -> float:
    return float(math.ceil(value / step) * step)
