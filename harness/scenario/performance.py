"""What a scenario's aircraft can do, how its flight begins, and what its planner knows of both."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Final

from aircraft.airframe import Airframe
from aircraft.airframes import PROVEN_TO_M, AircraftError, level_bank_deg, turn_fault
from aircraft.envelope import performance
from aircraft.frames import LocalPlane
from aircraft.interface import Performance
from aircraft.model_files import ModelFiles, TrimError
from aircraft.start import Atmosphere, StartConditions, VerticalGusts, profile_share
from harness.scenario.environment import Wind
from harness.scenario.keys import ScenarioKeys
from harness.scenario.parts import airframe_of, card_of, flown_airframe
from harness.scenario.sections import Bounds, DeviationSpec
from harness.scenario.validation import KeyFault
from planner.interface import Mission

LEAST_CLEARANCE_RADII: Final = 0.02  # planners keep this share of the turn radius, also where less is wanted
MAX_WIND_FRACTION: Final = 0.9  # wind above this share of the airspeed is refused: hardly any way is made
INSIDE_M: Final = 1e-3  # a flight begins this far inside: the model keeps its place in degrees, to 1e-9 m
SURVEY_ALTITUDE_M: Final = 300.0  # altitude above the sea at which an aircraft's airspeeds are measured
PROVEN_FROM_M: Final = 50.0  # altitude from which, up to `PROVEN_TO_M`, the survey proves level flight
PROVEN_FACTOR: Final = 1.05  # airspeeds lie this far inside the range, as the air's density differs by 7 %
PROVEN_SHARE, PROVEN_SHIFT = 0.25, 0.01  # and with deviations up to these; the shift over mass^1/3 (m/kg^1/3)
ALTITUDE_STEP_M: Final = 50.0  # a limit of the altitude of level flight is named as a multiple of this


def performance_of(scenario: ScenarioKeys) -> Performance:
    """Returns what the aircraft can do at its airspeed under its law, in its wind and gusts, or raises a KeyFault."""
    spec, air = scenario.aircraft, scenario.environment
    wind_mps = wind_mps_of(scenario)
    try:
        frame = airframe_of(spec)
        frame.check_airspeed(spec.airspeed_mps)
        if wind_mps >= MAX_WIND_FRACTION * spec.airspeed_mps:
            speed_mps = (air.wind or Wind()).speed_mps
            most = "" if speed_mps == wind_mps else f", and up to {wind_mps:g} at the mission's altitude"
            bound = f"{MAX_WIND_FRACTION:g} of the airspeed {spec.airspeed_mps:g} m/s"
            raise KeyFault(("environment", "wind", "speed_mps"), f"is {speed_mps:g}{most}; must be below {bound}")
        law = card_of(scenario.guidance, spec)
        at = spec.airspeed_mps, scenario.mission.altitude_m
        if turn_fault(frame, *at) is None:  # else `check_level_flight` names the altitude
            frame = replace(frame, level_banks=((spec.airspeed_mps, level_bank_deg(frame, *at)),))
        return performance(frame, spec.airspeed_mps, wind_mps, air.gusts, law=law)
    except AircraftError as error:
        raise KeyFault(("aircraft", "airspeed_mps"), str(error)) from error


def wind_mps_of(scenario: ScenarioKeys, altitude_m: float | None = None) -> float:
    """Largest speed of the wind at any time (m/s), by default at the mission's altitude, the ground at sea level."""
    wind = scenario.environment.wind or Wind()
    up_m = scenario.mission.altitude_m if altitude_m is None else altitude_m
    return wind.fastest_mps * (1.0 if wind.measured_at_m is None else profile_share(up_m, wind.measured_at_m))


def mission_of(scenario: ScenarioKeys, performance: Performance | None = None) -> Mission:
    """Returns what a planner knows before the flight; `performance` is looked up unless it is given.

    The clearance is `planner.clearance_m` and, on top, the margin for the error of the believed position. It is no less
    than `LEAST_CLEARANCE_RADII` of the turn radius: maps and searches have cells of its size.
    """
    performance = performance or performance_of(scenario)
    margin_m, radius_m = scenario.navigation.margin_m or 0.0, performance.turn_radius_m
    clearance_m = max(scenario.planner.clearance_m + margin_m, LEAST_CLEARANCE_RADII * radius_m)
    half_beam_m = 0.5 * math.radians(scenario.sensor.beam_deg) * scenario.sensor.range_m
    return Mission(
        goal_m=scenario.mission.goal_m,
        goal_radius_m=scenario.mission.goal_radius_m,
        bounds_m=_inset(scenario, margin_m, performance.tracking_error_m),
        clearance_m=clearance_m,
        turn_radius_m=radius_m,
        speed_mps=performance.airspeed_mps,
        roll_in_s=performance.roll_in_s,
        tracking_error_m=performance.tracking_error_m,
        sensor_range_m=scenario.sensor.range_m,
        compute_latency_s=scenario.planner.compute_latency_s,
        sensor_latency_s=scenario.sensor.latency_s,
        wind_mps=wind_mps_of(scenario),
        least_hold_radius_m=performance.hold_radius_m,
        least_spaced_radius_m=performance.spaced_radius_m,
        edge_error_m=half_beam_m + scenario.sensor.range_noise_m + margin_m,
    )


def _inset(scenario: ScenarioKeys, margin_m: float, tracking_m: float) -> Bounds:
    """Moves bounds in by a margin, not past the ends, and by the tracking error if no end is nearer than twice that."""
    xmin, ymin, xmax, ymax = scenario.area.bounds_m
    east, north = zip(scenario.mission.start_m, scenario.mission.goal_m, strict=True)
    xmin, xmax = min(xmin + margin_m, *east), max(xmax - margin_m, *east)
    ymin, ymax = min(ymin + margin_m, *north), max(ymax - margin_m, *north)
    return (
        xmin + tracking_m * (min(east) - xmin >= 2.0 * tracking_m),
        ymin + tracking_m * (min(north) - ymin >= 2.0 * tracking_m),
        xmax - tracking_m * (xmax - max(east) >= 2.0 * tracking_m),
        ymax - tracking_m * (ymax - max(north) >= 2.0 * tracking_m),
    )


def start_conditions(scenario: ScenarioKeys) -> StartConditions:
    """Returns where and how a flight begins: a hair inside the area if its start lies on the boundary."""
    mission, (xmin, ymin, xmax, ymax) = scenario.mission, scenario.area.bounds_m
    east, north = mission.start_m
    if xmin <= east <= xmax and ymin <= north <= ymax:
        inside_m = min(INSIDE_M, 0.5 * (xmax - xmin), 0.5 * (ymax - ymin))
        east = min(max(east, xmin + inside_m), xmax - inside_m)
        north = min(max(north, ymin + inside_m), ymax - inside_m)
    course_rad = math.radians(mission.course_deg)
    return StartConditions(east, north, mission.altitude_m, course_rad, scenario.aircraft.airspeed_mps)


def air_of(scenario: ScenarioKeys, seed: int = 0) -> Atmosphere:
    """The air of a scenario, its turbulence from a seed."""
    air = scenario.environment
    wind, vertical = air.wind or Wind(), air.vertical_gusts
    return Atmosphere(
        *_wind_components(wind.speed_mps, wind.from_deg),
        turbulence=air.turbulence.model if air.turbulence and air.gusts else None,
        intensity=air.gusts,
        seed=seed,
        changes=tuple((time_s, *_wind_components(speed, degrees)) for time_s, speed, degrees in wind.changes),
        measured_at_m=wind.measured_at_m,
        vertical_gusts=VerticalGusts(**dict(vertical)) if vertical else None,
    )


def _wind_components(speed_mps: float, from_deg: float) -> tuple[float, float]:
    blows = math.radians(from_deg) + math.pi
    return speed_mps * math.sin(blows), speed_mps * math.cos(blows)


def check_level_flight(scenario: ScenarioKeys) -> None:
    """Raises a KeyFault if the aircraft cannot fly level or turn at the altitude, trimmed as for its flight."""
    start, origin = start_conditions(scenario), scenario.area.origin
    place = origin.latitude_deg, origin.longitude_deg
    try:
        heading_rad = start.heading_rad(Atmosphere(*air_of(scenario).start_wind(start.altitude_m)))
        frame = flown_airframe(scenario.aircraft)
        if _is_proven(frame, start, scenario.aircraft.deviation):
            return
        nominal = airframe_of(scenario.aircraft)
        fault = _trim_fault(frame.files, place, start, heading_rad)
        fault = fault or turn_fault(nominal, start.airspeed_mps, start.altitude_m)
    except (AircraftError, ValueError) as error:
        raise KeyFault(("aircraft", "model"), str(error)) from error
    if fault is None:
        return
    from aircraft.trials import farthest  # loads JSBSim

    def flies(altitude_m: float, files: ModelFiles = frame.files) -> bool:
        trims = _trim_fault(files, place, replace(start, altitude_m=altitude_m), heading_rad) is None
        return trims and turn_fault(nominal, start.airspeed_mps, altitude_m) is None

    if (deviation := scenario.aircraft.deviation) and flies(start.altitude_m, nominal.files):
        off = ", ".join(f"{name} {each:.3g}" for name, each in deviation if each)
        drawn = " as drawn; another seed, airspeed_mps or uncertainty may do" if scenario.uncertainty else ""
        raise KeyFault(("aircraft", "deviation"), f"is {off}{drawn}; must be smaller: {fault}")
    if not flies(SURVEY_ALTITUDE_M):
        raise KeyFault(("aircraft", "airspeed_mps"), f"is {start.airspeed_mps:g}; must be another: {fault}")
    whole, bound = (math.floor, "most") if start.altitude_m > SURVEY_ALTITUDE_M else (math.ceil, "least")
    ends = SURVEY_ALTITUDE_M / ALTITUDE_STEP_M, start.altitude_m / ALTITUDE_STEP_M
    limit_m = ALTITUDE_STEP_M * whole(farthest(lambda each: flies(ALTITUDE_STEP_M * whole(each)), *ends, 1.0))
    text = f"must be at {bound} {limit_m:g}: {fault}"
    raise KeyFault(("mission", "altitude_m"), f"is {start.altitude_m:g}; {text}")


def _is_proven(frame: Airframe, start: StartConditions, deviation: DeviationSpec | None) -> bool:
    """Whether the survey of the model without deviations proves level flight: all is as near to it as need be."""
    slowest, fastest = frame.airspeed_range_mps
    near = PROVEN_FROM_M <= start.altitude_m <= PROVEN_TO_M
    near &= PROVEN_FACTOR * slowest <= start.airspeed_mps <= fastest / PROVEN_FACTOR
    most = {"centre_of_gravity_m": PROVEN_SHIFT * frame.mass_kg ** (1.0 / 3.0)}
    return near and all(abs(each or 0.0) <= most.get(name, PROVEN_SHARE) for name, each in deviation or ())


@lru_cache(maxsize=512)
def _trim_fault(
    files: ModelFiles, place: tuple[float, float], start: StartConditions, heading_rad: float
) -> str | None:
    """Returns why the aircraft cannot be trimmed in level flight; None if it can."""
    from aircraft.jsbsim_loading import load_trimmed

    plane = LocalPlane(*place)
    true_rad = heading_rad + plane.convergence_rad(start.east_m, start.north_m)
    try:
        load_trimmed(files, plane, start, true_rad)
    except TrimError as error:
        return str(error)
    return None
