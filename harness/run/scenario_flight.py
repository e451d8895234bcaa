"""Makes a flight of a scenario, and a run folder of a flight."""

from __future__ import annotations

import hashlib
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from aircraft.frames import LocalPlane
from aircraft.interface import AircraftState, FlightModel
from aircraft.start import Atmosphere, StartConditions
from harness.analysis.flight_limits import FlightLimits
from harness.analysis.metrics import metrics
from harness.files.errors import WriteError
from harness.files.versions import versions
from harness.flight.closed_loop import Loop, fly
from harness.flight.navigation import Navigator, pose_error_m
from harness.flight.observer import Caution, Observer, Progress
from harness.flight.record import AcceptedPlan, Flight, Track
from harness.flight.signals import held_back
from harness.flight.termination import MissionEnd
from harness.mapping.sensed_map import ScanErrors, SensedMap
from harness.recording.properties import run_properties
from harness.run_files.run_folder import RECORDING, RunFolder
from harness.scenario.navigation import planning_margin_m
from harness.scenario.parts import airframe_of, flown_airframe, law_of, planner_of
from harness.scenario.performance import air_of, mission_of, performance_of, start_conditions, wind_mps_of
from harness.scenario.resolving import rounded_up
from harness.scenario.scenario import Scenario, dump_scenario
from harness.scenario.sections import GuidanceSpec
from harness.world.ground import Ground
from harness.world.range_sensor import RangeSensor
from harness.world.world import World

if TYPE_CHECKING:
    from harness.recording.blueprint import Scene

SENSOR_STREAM, TURBULENCE_STREAM, NAVIGATION_STREAM = 1, 2, 3
"""Numbers of the random streams that derive from the scenario's seed."""


def make_loop(
    scenario: Scenario, make_model: Callable[[StartConditions, Atmosphere], FlightModel] | None = None
) -> Loop:
    """Makes all parts of a scenario's flight; an AircraftError says why its aircraft cannot be loaded or trimmed."""
    mission = mission_of(scenario)
    world = World.from_scenario(scenario)
    start, air = start_conditions(scenario), atmosphere(scenario)
    held = scenario.mission.altitude_m, mission.speed_mps
    return Loop(
        world=world,
        sensor=RangeSensor(world, scenario.sensor, _stream(scenario.seed, SENSOR_STREAM)),
        seen=SensedMap(
            mission.bounds_m,
            mission.clearance_m,
            mission.sensor_range_m,
            ScanErrors(
                scenario.sensor.range_noise_m,
                scenario.sensor.false_return > 0.0,
                1.0 - (1.0 - scenario.sensor.dropout) * (1.0 - scenario.sensor.false_return),
                pose_error_m(scenario.navigation, mission.sensor_range_m),
            ),
            scenario.sensor.least_width_m,
        ),
        planner=planner_of(scenario.planner, mission),
        model=make_model(start, air) if make_model else jsbsim_aircraft(scenario, start, air),
        guidance=law_of(scenario.guidance, scenario.aircraft),
        termination=MissionEnd(world, mission, scenario.mission.time_limit_s),
        mission=mission,
        vertical=lambda believed, arc_length_m: held,
        scan_rate_hz=scenario.sensor.rate_hz,
        navigator=Navigator(scenario.navigation, _stream(scenario.seed, NAVIGATION_STREAM)),
    )


def atmosphere(scenario: Scenario) -> Atmosphere:
    """Returns the air of a scenario's flight."""
    return air_of(scenario, int(_stream(scenario.seed, TURBULENCE_STREAM).generate_state(1)[0]) & 0x7FFFFFFF)


def jsbsim_aircraft(
    scenario: Scenario, start: StartConditions, air: Atmosphere, climb_limit_mps: float | None = None
) -> FlightModel:
    """Returns the scenario's aircraft, deviations included, trimmed and in the air.

    See `aircraft.jsbsim_model` for the limit of its climb.
    """
    from aircraft.jsbsim_model import JsbsimModel

    origin = scenario.area.origin
    plane = LocalPlane(origin.latitude_deg, origin.longitude_deg)
    frame = flown_airframe(scenario.aircraft)
    depends_on_height = air.turbulence is not None or air.measured_at_m is not None
    ground = Ground(scenario.ground.field()).height_m if scenario.ground and depends_on_height else None
    return JsbsimModel(frame, start, plane, air, scenario.simulation.rate_hz, climb_limit_mps, ground)


def flight_limits(scenario: Scenario, planned: bool = True) -> FlightLimits:
    """Returns the limits of a flight; unless `planned`, no navigation margin, and no clearance that is not written."""
    performance, limits = performance_of(scenario), scenario.trackability
    frame = airframe_of(scenario.aircraft)
    guidance = frame.guidance_limits()
    speed, sensor = performance.airspeed_mps, scenario.sensor
    margin_m, clearance_m = scenario.navigation.margin_m, scenario.planner.clearance_m
    written = scenario.__dict__["_given"].sections.get("planner")
    wanted = planned or (written is not None and written.clearance_m is not None)
    blind_s = scenario.planner.compute_latency_s + sensor.latency_s + 1.0 / sensor.rate_hz
    seen_late_m = (speed + wind_mps_of(scenario)) * (blind_s + performance.roll_in_s)
    return FlightLimits(
        altitude_m=scenario.mission.altitude_m,
        clearance_m=clearance_m if wanted else 0.0,
        bank_limit_rad=guidance.bank_limit_rad,
        turn_radius_m=performance.turn_radius_m,
        airspeed_mps=speed,
        roll_rate_radps=guidance.roll_rate_radps,
        stall_angle_deg=frame.stall_angle_deg,
        sensor_range_m=sensor.range_m,
        no_wind=scenario.environment.wind is None,
        scan_period_s=1.0 / sensor.rate_hz,
        compute_latency_s=scenario.planner.compute_latency_s,
        horizon_m=performance.turn_radius_m + (clearance_m + margin_m) + seen_late_m,
        max_cross_track_m=limits.cross_track_m,
        max_altitude_error_m=limits.altitude_m,
        max_airspeed_error_mps=limits.airspeed_mps,
        max_load_factor=limits.load_factor,
        airspeed_sigma_mps=scenario.navigation.airspeed_sigma_mps,
        navigation_margin_m=_margin_of_any_law_m(scenario, performance.turn_radius_m) if planned else 0.0,
    )


def _margin_of_any_law_m(scenario: Scenario, radius_m: float) -> float:
    """The margin that planners keep for navigation errors, less what a law adds by its wide turns; or what was set."""
    plain_m = performance_of(scenario.model_copy(update={"guidance": GuidanceSpec()})).turn_radius_m
    clearance_m, kept_m = scenario.planner.clearance_m, scenario.navigation.margin_m
    fastest_mps = scenario.aircraft.airspeed_mps + wind_mps_of(scenario)
    errors = scenario.navigation, fastest_mps, scenario.mission.time_limit_s
    was_set = not np.isclose(kept_m, planning_margin_m(*errors, clearance_m, radius_m))
    plain_clearance_m = rounded_up(plain_m, 10) if clearance_m == rounded_up(radius_m, 10) else clearance_m
    return kept_m if was_set else planning_margin_m(*errors, plain_clearance_m, plain_m)


def fly_and_measure(scenario: Scenario) -> dict[str, Any]:
    """Flies a scenario without a run folder, and returns the content of its `metrics.json`."""
    return metrics(fly(make_loop(scenario)), flight_limits(scenario))


class RunNames(NamedTuple):
    """Names that a run folder and its recording give themselves.

    The manifest says that `command` was called, by default the command line. A recording is called `identity`, by
    default its name with a hash of all settings and versions, and names the keys that a campaign `varied`; a `thin` one
    has no more than track, plans and obstacles.
    """

    command: str | None = None
    identity: str | None = None
    varied: Mapping[str, str | float | int | bool] | None = None
    thin: bool = False


class FlownAs(NamedTuple):
    """How a flight is flown to its end and measured; a `pilot` is named in place of the planner's kind."""

    pilot: str | None = None
    flown_by: Callable[[Loop, Sequence[Observer], Progress | None], Flight] = fly
    measured_by: Callable[[Flight, FlightLimits], dict[str, Any]] = metrics
    scene: Mapping[str, Any] = {}  # fields of its `Scene` that are not those of a planner's flight


def fly_to_folder(
    scenario: Scenario,
    out: Path,
    recording: bool,
    progress: Progress | None = None,
    *,
    make: Callable[[Scenario], Loop] = make_loop,
    watching: Sequence[Observer] = (),
    named: RunNames = RunNames(),
    flown: FlownAs = FlownAs(),
) -> dict[str, Any]:
    """Flies a complete scenario into a run folder and returns the content of its `metrics.json`.

    `make` makes the parts of the flight, `watching` are further observers.

    Raises:
        AircraftError: the aircraft cannot be loaded or trimmed; nothing is written.
        RunFolderError: the folder holds something else or cannot be written.
        WriteError: it could not be written to the end, a full disk perhaps.
    """
    place = out.absolute()  # what flies may change the working directory
    loop, text, pilot = make(scenario), dump_scenario(scenario), flown.pilot
    out = out if out.absolute() == place else place
    try:
        with ExitStack() as stack:
            command = [named.command or shlex.join(sys.argv)]
            sources = [{"path": each.path, "sha256": each.sha256} for each in scenario.sources or ()]
            radius_m = loop.mission.turn_radius_m
            folder = stack.enter_context(RunFolder.create(out, text, command, sources, radius_m))
            folder.path = place
            so_far, log = _PartialFlight(), None
            if recording:
                scene = replace(scene_of(scenario, loop, text, pilot), **flown.scene)
                with held_back():  # an interrupt in rerun's first calls is lost there, or crashes the process
                    log = _recording(scene, loop, folder, named)
                    stack.callback(log.end)
            try:
                flight = flown.flown_by(loop, [so_far, *watching, *([log] if log else [])], progress)
            except KeyboardInterrupt:
                so_far.write_into(folder)
                raise
            figures = flown.measured_by(flight, flight_limits(scenario, planned=pilot is None))
            if (ended := figures["outcome"]) != flight.outcome.value:  # it touched something on the way
                so_far.on_event(flight.sim_s, Caution(f"{ended}: {figures['reason']}"))
            if log is not None:
                log.close(figures, run_properties(scenario, figures), named.varied)
            folder.log_events(so_far.events)
            folder.finish(flight.track, flight.plans, figures)
    except OSError as error:
        raise WriteError.of("the run", out, error) from error
    return figures


class _PartialFlight(Observer):
    """An observer that keeps the events, and the rows and plans so far in case the flight is broken off."""

    def __init__(self) -> None:
        self._blocks: list[Track] = []
        self._plans: list[AcceptedPlan] = []
        self.events: list[tuple[float, str, str]] = []  # simulated time (s), level and sentence

    def on_event(self, time_s: float, text: str) -> None:
        self.events.append((time_s, "warning" if isinstance(text, Caution) else "info", str(text)))

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        self._plans.append(accepted)
        self.events.append((accepted.time_s, "info", f"plan {accepted.plan_index}: {accepted.plan.reason}"))

    def on_block(self, block: Track) -> None:
        self._blocks.append(block)

    def write_into(self, folder: RunFolder) -> None:
        """Writes what it keeps into a folder that stays marked incomplete."""
        if self._blocks:
            folder.log_events(self.events)
            folder.leave(Track.joined(self._blocks), self._plans)


def _recording(scene: Scene, loop: Loop, folder: RunFolder, named: RunNames) -> Any:
    from harness.recording.log import RerunLog

    settings = hashlib.sha256(f"{scene.scenario_yaml}{versions()}".encode()).hexdigest()
    identity = named.identity or f"{scene.name} ({settings[:8]})"
    return RerunLog(folder.path / RECORDING, scene, identity, lambda: loop.seen.moving, named.thin)


def scene_of(scenario: Scenario, loop: Loop, text: str, pilot: str | None = None) -> Scene:
    """Returns what a recording shows before the flight."""
    from harness.recording.blueprint import Scene

    wind = scenario.environment.wind
    return Scene(
        f"{scenario.name}, {pilot or scenario.planner.label}, {scenario.aircraft.model}, seed {scenario.seed}",
        loop.mission,
        scenario.mission.start_m,
        flight_limits(scenario, planned=pilot is None),
        tuple(loop.world.obstacles),
        text,
        searches=pilot is None,
        ground=loop.world.ground.field if loop.world.ground else None,
        believes=scenario.navigation.kind != "perfect",
        wind=(wind.from_deg, wind.text) if wind else (0.0, ""),
    )


def _stream(seed: int, number: int) -> np.random.SeedSequence:
    return np.random.SeedSequence(seed, spawn_key=(number,))
