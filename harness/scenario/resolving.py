"""From what a scenario file says to a complete scenario: defaults that follow from other keys or from the aircraft.

`resolve` reads top to bottom in the order in which defaults depend on one another. To learn what an aircraft can do
under a guidance law it may have to be flown, which is then kept on disk, and it is trimmed as its flight begins.
Reading a file (`ScenarioKeys`) does neither.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aircraft.interface import GRAVITY_MPS2
from harness.scenario.checks import check_local_plane, check_start_and_goal, check_start_leads_in
from harness.scenario.conditions import with_day, with_servos
from harness.scenario.craft import airframe_of, limits_of
from harness.scenario.files_resolved import plane_point, with_files_expanded
from harness.scenario.keys import ScenarioKeys, step_rate_hz
from harness.scenario.navigation import planning_margin_m
from harness.scenario.parts import is_here, resolved_guidance, resolved_planner
from harness.scenario.performance import LEAST_CLEARANCE, mission_of, performance_of, wind_mps_of
from harness.scenario.sections import AircraftSpec, Area, AutopilotSpec, MissionSpec
from harness.scenario.start import check_level_flight
from harness.scenario.validation import KeyFault
from planner.geometry.clearance import TOLERATED_SHARE

if TYPE_CHECKING:
    from aircraft.airframe import Airframe

POUND_KG: Final = 0.45359237

TOLERANCE_M: Final = 10.0
"""What a flight may be off in altitude, and off its path where no clearance is written (m)."""


def resolve(
    keys: ScenarioKeys, folder: Path | None = None, ends_checked: bool = True, as_flown: bool = False
) -> ScenarioKeys:
    """The same flight with every default filled in and every file of obstacles expanded.

    The arguments are those of `scenario.validated`. A KeyFault says that keys contradict each other, or that the
    aircraft cannot do what they ask for.
    """
    sensor = keys.sensor
    simulation = keys.simulation.filled(rate_hz=step_rate_hz(keys.simulation.rate_hz, sensor))
    mission = _ends_in_plane(keys.mission, keys.area)
    aircraft = keys.aircraft.model_copy(update={"model": model_or_folder(keys.aircraft.model, folder)})
    card = aircraft.model_copy(update={"actuators": None, "autopilot": None})
    nominal = _airframe(card, "model")
    keys = with_servos(keys.updated(simulation=simulation, mission=mission, aircraft=aircraft), nominal)
    aircraft = keys.aircraft.filled(airspeed_mps=_airframe(keys.aircraft, "actuators").cruise_mps)
    keys = with_day(keys.updated(aircraft=aircraft), nominal)
    aircraft, latency_s = keys.aircraft, keys.navigation.latency_s
    if latency_s or aircraft.autopilot is not None:
        autopilot = (aircraft.autopilot or AutopilotSpec()).filled(state_latency_s=latency_s)
        aircraft = aircraft.model_copy(update={"autopilot": autopilot})
    guidance = resolved_guidance(keys.guidance, aircraft, as_flown)
    scenario = keys.updated(aircraft=aircraft, guidance=guidance)
    if as_flown and not is_here(guidance):
        return scenario  # what follows from how the law tracks stands there

    performance = performance_of(scenario)
    radius_m, wind_mps = performance.turn_radius_m, wind_mps_of(scenario)
    (x0, y0), (x1, y1) = mission.start_m, mission.goal_m
    slowest_s = math.hypot(x1 - x0, y1 - y0) / (aircraft.airspeed_mps - wind_mps)
    mission = mission.filled(
        course_deg=math.degrees(math.atan2(x1 - x0, y1 - y0)) % 360,
        goal_radius_m=_rounded_up(radius_m, 10),
        time_limit_s=_rounded_up(10 * slowest_s + 60, 60),
    )
    planner = keys.planner.filled(clearance_m=_rounded_up(radius_m, 10))
    sensor = sensor.filled(
        range_m=_rounded_up(10 * radius_m, 100),
        beam_deg=sensor.field_of_view_deg / sensor.rays,
        least_width_m=max(planner.clearance_m, LEAST_CLEARANCE * radius_m),
    )
    fastest_mps = aircraft.airspeed_mps + wind_mps
    margin_m = planning_margin_m(
        keys.navigation,
        fastest_mps,
        mission.time_limit_s,
        unseen_m=math.pi * radius_m,
        clearance_m=planner.clearance_m,
        turn_radius_m=radius_m,
    )
    navigation = keys.navigation.filled(margin_m=margin_m)
    weight_lb = airframe_of(aircraft).mass_kg / POUND_KG
    limits = keys.trackability.filled(
        cross_track_m=TOLERATED_SHARE * keys.planner.clearance_m if keys.planner.clearance_m else TOLERANCE_M,
        altitude_m=TOLERANCE_M,
        airspeed_mps=0.1 * aircraft.airspeed_mps,
        load_factor=min(3.8, 2.1 + 24000.0 / (weight_lb + 10000.0)),
    )
    scenario = scenario.updated(
        mission=mission, sensor=sensor, planner=planner, navigation=navigation, trackability=limits
    )

    check_local_plane(scenario.area)
    if not as_flown:
        check_level_flight(scenario)
    scenario, names = with_files_expanded(scenario, folder)
    if ends_checked:
        check_start_and_goal(scenario.area, scenario.obstacles, mission, planner.clearance_m, names)
        tightest_m = fastest_mps**2 / (
            GRAVITY_MPS2 * math.tan(limits_of(aircraft).bank_limit_rad)
        )  # downwind
        check_start_leads_in(scenario.area, mission, tightest_m)
    told = mission_of(scenario, performance)
    return scenario.updated(planner=resolved_planner(planner, told, as_flown))


def _ends_in_plane(mission: MissionSpec, area: Area) -> MissionSpec:
    """A mission whose start and goal are in metres, where they were given in degrees."""
    ends = {name: getattr(mission, name) for name in ("start", "goal")}
    given = {f"{name}_m": plane_point(place, area) for name, place in ends.items() if place}
    return mission.model_copy(update={"start": None, "goal": None, **given}) if given else mission


def model_or_folder(model: str, folder: Path | None) -> str:
    """The aircraft's name, or the absolute path of its folder: beside the scenario file, or from here."""
    from aircraft.airframes import aircraft_names

    if "/" not in model and model in aircraft_names():
        return model
    for place in (Path() if folder is None else folder, Path()):
        try:
            if (place / model).expanduser().is_dir():
                return str((place / model).expanduser().resolve())
        except (OSError, RuntimeError):  # too long, not allowed, or the home of nobody: no folder
            continue
    return model


def _airframe(spec: AircraftSpec, key: str) -> Airframe:
    """The airframe of a scenario; where there is none, that is the fault of a key."""
    from aircraft.airframes import AircraftError

    try:
        return airframe_of(spec)
    except AircraftError as error:
        raise KeyFault(("aircraft", key), str(error)) from error


def _rounded_up(value: float, step: int) -> float:
    return float(math.ceil(value / step) * step)
