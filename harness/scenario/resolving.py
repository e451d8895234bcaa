"""A complete scenario of what a file says, in the order in which defaults depend; the aircraft may have to fly."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

import numpy as np

from aircraft.airframe import Airframe
from aircraft.airframes import AircraftError, aircraft_names
from aircraft.frames import LocalPlane
from aircraft.interface import GRAVITY_MPS2
from harness.scenario import performance as performances
from harness.scenario.conditions import with_day, with_servos
from harness.scenario.files_resolved import file_beside, with_files_expanded
from harness.scenario.keys import ScenarioKeys, step_rate_hz
from harness.scenario.kinds import GUIDANCE
from harness.scenario.navigation import planning_margin_m
from harness.scenario.obstacles import Obstacle
from harness.scenario.parts import airframe_of, limits_of, resolved_guidance, resolved_planner
from harness.scenario.sections import AircraftSpec, Area, AutopilotSpec, MissionSpec, Point
from harness.scenario.validation import KeyFault, shown
from planner.keys import MARGIN_SHARE

POUND_KG: Final = 0.45359237
TOLERANCE_M: Final = 10.0  # allowed error of altitude, and off the path where no clearance is written
PLANE_REACH_M: Final = 400_000.0  # the plane is right to 0.9 m this far from any origin within 85 degrees
COURSE_STEP_DEG: Final = 5  # step of courses, and of places on an arc, tested for a start that leads out
ROUNDING_M: Final = 1e-3  # a place outside of the area by at most this counts as inside


def resolve(
    keys: ScenarioKeys, folder: Path | None = None, ends_checked: bool = True, as_flown: bool = False
) -> ScenarioKeys:
    """Fills in every default of a scenario and expands its files of obstacles; arguments as `validated` has them."""
    sensor = keys.sensor
    simulation = keys.simulation.filled(rate_hz=step_rate_hz(keys.simulation.rate_hz, sensor))
    mission = _ends_in_plane(keys.mission, keys.area)
    ends = {f"{end}_m": end if getattr(keys.mission, end) else f"{end}_m" for end in ("start", "goal")}
    aircraft = keys.aircraft.model_copy(update={"model": model_or_folder(keys.aircraft.model, folder)})
    nominal = _airframe(aircraft.model_copy(update={"actuators": None, "autopilot": None}))
    keys = with_servos(keys.updated(simulation=simulation, mission=mission, aircraft=aircraft), nominal)
    aircraft = keys.aircraft.filled(airspeed_mps=_airframe(keys.aircraft).cruise_mps)
    keys = with_day(keys.updated(aircraft=aircraft), nominal)
    aircraft, latency_s = keys.aircraft, keys.navigation.latency_s
    if latency_s or aircraft.autopilot is not None:
        autopilot = (aircraft.autopilot or AutopilotSpec()).filled(state_latency_s=latency_s)
        aircraft = aircraft.model_copy(update={"autopilot": autopilot})
        _airframe(aircraft, latency_s)
    scenario = keys.updated(aircraft=aircraft)
    if as_flown and GUIDANCE.find(keys.guidance.kind) is None:
        return scenario  # what follows from how the law tracks stands there
    scenario = scenario.updated(guidance=resolved_guidance(keys.guidance, aircraft))

    performance = performances.performance_of(scenario)
    radius_m, wind_mps = performance.turn_radius_m, performances.wind_mps_of(scenario)
    (x0, y0), (x1, y1) = mission.start_m, mission.goal_m
    slowest_s = math.hypot(x1 - x0, y1 - y0) / (aircraft.airspeed_mps - wind_mps)
    mission = mission.filled(
        course_deg=math.degrees(math.atan2(x1 - x0, y1 - y0)) % 360,
        goal_radius_m=rounded_up(radius_m, 10),
        time_limit_s=rounded_up(10 * slowest_s + 60, 60),
    )
    planner = keys.planner.filled(clearance_m=rounded_up(radius_m, 10))
    clearance_m = planner.clearance_m
    sensor = sensor.filled(
        # A given path has no key for it, whatever clearance is wanted.
        range_m=rounded_up(max(10 * radius_m, 0.0 if ends_checked else 8 * radius_m + 2 * clearance_m), 100),
        beam_deg=sensor.field_of_view_deg / sensor.rays,
        least_width_m=max(clearance_m, performances.LEAST_CLEARANCE_RADII * radius_m),
    )
    fastest_mps = aircraft.airspeed_mps + wind_mps
    margin_m = planning_margin_m(keys.navigation, fastest_mps, mission.time_limit_s, clearance_m, radius_m)
    navigation = keys.navigation.filled(margin_m=margin_m)
    limits = keys.trackability.filled(
        cross_track_m=MARGIN_SHARE * keys.planner.clearance_m if keys.planner.clearance_m else TOLERANCE_M,
        altitude_m=TOLERANCE_M,
        airspeed_mps=0.1 * aircraft.airspeed_mps,
        load_factor=min(3.8, max(2.5, 2.1 + 24000.0 / (airframe_of(aircraft).mass_kg / POUND_KG + 10000.0))),
    )
    parts = {"mission": mission, "sensor": sensor, "planner": planner, "navigation": navigation}
    scenario = scenario.updated(**parts, trackability=limits)

    check_local_plane(scenario.area)
    if not as_flown:
        performances.check_level_flight(scenario)
    scenario, names = with_files_expanded(scenario, folder)
    if ends_checked:
        check_start_and_goal(scenario, names, ends)
        sideways_mps2 = GRAVITY_MPS2 * math.tan(limits_of(aircraft).bank_limit_rad)
        check_start_leads_in(scenario.area, mission, fastest_mps**2 / sideways_mps2)  # downwind
    flown = performances.mission_of(scenario, performance)
    return scenario.updated(planner=resolved_planner(planner, flown, as_flown))


def _ends_in_plane(mission: MissionSpec, area: Area) -> MissionSpec:
    """Returns a mission with start and goal in metres, to a millimetre where they were given in degrees."""
    plane, given = LocalPlane(area.origin.latitude_deg, area.origin.longitude_deg), {}
    for name, place in {"start_m": mission.start, "goal_m": mission.goal}.items():
        if place:
            east, north = plane.plane(place.latitude_deg, place.longitude_deg)
            given[name] = round(east, 3), round(north, 3)
    return mission.model_copy(update={"start": None, "goal": None, **given})


def model_or_folder(model: str, folder: Path | None) -> str:
    """Returns the name of a known aircraft as it is, or the absolute path of its folder, sought from `folder` first."""
    if "/" not in model and model in aircraft_names():
        return model
    found = file_beside(model, folder) or file_beside(model, Path())
    return str(found.resolve()) if found and found.is_dir() else model


def _airframe(spec: AircraftSpec, latency_s: float | None = None) -> Airframe:
    """Returns the airframe; if there is none, a KeyFault names a latency that is given, else the aircraft's key."""
    try:
        return airframe_of(spec)
    except AircraftError as error:
        if latency_s is not None:
            text = f"is {latency_s:g}; must be less, or aircraft.autopilot.state_latency_s be given: {error}"
            raise KeyFault(("navigation", "latency_s"), text) from error
        for section in ("actuators", "autopilot"):
            if getattr(spec, section) is not None:
                _airframe(spec.model_copy(update={section: None}))
                raise _fault_in(section, spec, error) from error
        raise KeyFault(("aircraft", "model"), str(error)) from error


def _fault_in(section: str, spec: AircraftSpec, error: Exception) -> KeyFault:
    """Returns the fault of a section of the aircraft: of the key without which it could be flown, if there is one."""
    part = getattr(spec, section)
    for key, value in part.model_dump(exclude_defaults=True).items():
        other = part.model_copy(update={key: type(part).model_fields[key].default})
        with suppress(AircraftError):
            airframe_of(spec.model_copy(update={section: other}))
            return KeyFault(("aircraft", section, key), f"is {shown(value)}; must be another, or left out: {error}")
    return KeyFault(("aircraft", section), str(error))


def rounded_up(value: float, step: int) -> float:
    """The least multiple of a step that is no smaller."""
    return float(math.ceil(value / step) * step)


def check_local_plane(area: Area) -> None:
    """Raises a KeyFault unless the plane about the area's origin is right to a metre wherever the area reaches."""
    xmin, ymin, xmax, ymax = area.bounds_m
    if (reach_m := math.hypot(max(abs(xmin), abs(xmax)), max(abs(ymin), abs(ymax)))) > PLANE_REACH_M:
        text = f"reaches {reach_m / 1e3:.0f} km from area.origin; the plane is right to a metre up to "
        text += f"{PLANE_REACH_M / 1e3:.0f} km: lay the origin nearer to the area's middle, or take a smaller area"
        raise KeyFault(("area", "bounds_m"), text)


def check_start_and_goal(keys: ScenarioKeys, names: Sequence[str], written: Mapping[str, str]) -> None:
    """Raises a KeyFault unless start and goal lie in the area and clear of obstacles, which messages call by `names`.

    The start must be clear of what is there at time 0, the goal of what is there for ever. `written` has the keys of
    `start_m` and `goal_m` in the file, where they may stand in degrees.
    """
    mission, obstacles, clearance_m = keys.mission, keys.obstacles, keys.planner.clearance_m
    xmin, ymin, xmax, ymax = bounds_m = keys.area.bounds_m
    ends = {"start_m": mission.start_m, "goal_m": mission.goal_m}
    for name, (east, north) in ends.items():
        if min(east - xmin, xmax - east, north - ymin, ymax - north) < 0.0:
            lies, about = ("is", "") if name in written.values() else ("lies at", " m from area.origin")
            text = f"{lies} {[east, north]}{about}; must lie inside area.bounds_m {list(bounds_m)}"
            raise KeyFault(("mission", written[name]), text)
    if (straight_m := math.dist(mission.start_m, mission.goal_m)) <= mission.goal_radius_m:
        text = f"is {straight_m:g} m from {written['start_m']}, inside goal_radius_m {mission.goal_radius_m:g} m;"
        raise KeyFault(("mission", written["goal_m"]), f"{text} must be further away")
    at_first = [each.active_s is None or each.active_s[0] <= 0.0 for each in obstacles]
    there = {"start_m": at_first, "goal_m": [each.fixed for each in obstacles]}
    for end, point in ends.items():
        for obstacle, text, counts in zip(obstacles, names, there[end], strict=True):
            if counts and (distance_m := _distance_to(obstacle, point, clearance_m)) < clearance_m:
                where = f"{distance_m:.6g} m from" if distance_m > 0 else "inside"
                wanted = f"must be {clearance_m:g} m (planner.clearance_m) away"
                raise KeyFault(("mission", written[end]), f"lies {where} {text}; {wanted}")


def _distance_to(obstacle: Obstacle, point: Point, wanted_m: float) -> float:
    """Distance in metres from a point to the edge of an obstacle, negative inside; inf if its box is far away."""
    if obstacle.circle:
        return math.dist(point, obstacle.circle.center_m) - obstacle.circle.radius_m
    assert obstacle.polygon
    (x, y), (east, north) = point, zip(*obstacle.polygon.vertices_m, strict=True)
    if max(min(east) - x, x - max(east), min(north) - y, y - max(north)) > wanted_m:
        return math.inf
    import shapely

    place = shapely.Point(point)
    polygon = shapely.Polygon(obstacle.polygon.vertices_m, obstacle.polygon.holes_m)
    return float(shapely.distance(polygon, place) or -shapely.distance(polygon.boundary, place))


def check_start_leads_in(area: Area, mission: MissionSpec, turn_radius_m: float) -> None:
    """Raises a KeyFault, with a course that would do, if straight on and tightest turns to both sides lead out."""
    if _stays_inside(area, mission.start_m, mission.course_deg, turn_radius_m):
        return
    courses = range(0, 360, COURSE_STEP_DEG)
    good = (each for each in courses if _stays_inside(area, mission.start_m, each, turn_radius_m))
    others = (f"must be another, as {each}" for each in good)
    wanted = next(others, "none would do: start farther from the border")
    text = f"is {mission.course_deg:.0f}, which leads out of area.bounds_m at once: no turn of {turn_radius_m:.0f} m"
    text += f" from start_m {list(mission.start_m)} stays inside; {wanted}"
    raise KeyFault(("mission", "course_deg"), text)


def _stays_inside(area: Area, start: Point, course_deg: float, radius_m: float) -> bool:
    """Whether a turn to some side, or none, stays in the area up to where two radii straight ahead are inside."""
    xmin, ymin, xmax, ymax = area.bounds_m
    turned = np.radians(np.arange(0, 361, COURSE_STEP_DEG))
    for side in (1.0, -1.0):  # to the right, to the left
        ahead = np.exp(1j * (math.radians(90.0 - course_deg) - side * turned))  # east and north
        places = complex(*start) - side * 1j * radius_m * (ahead[0] - ahead)
        both = np.stack((places, places + 2.0 * radius_m * ahead))
        beside = both.real - xmin, xmax - both.real, both.imag - ymin, ymax - both.imag
        inside = np.min(beside, axis=0) >= -ROUNDING_M
        inside[1, -1] = True  # a whole circle
        if (np.logical_and.accumulate(inside[0]) & inside[1]).any():
            return True
    return False
