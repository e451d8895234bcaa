"""What a scenario's aircraft can do, and what its planner is told of it and of the mission."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from aircraft.start import profile_share
from harness.scenario.craft import airframe_of
from harness.scenario.keys import ScenarioKeys
from harness.scenario.parts import card_of
from harness.scenario.sections import Bounds
from harness.scenario.validation import KeyFault

if TYPE_CHECKING:
    from aircraft.interface import Performance
    from planner.interface import Mission

LEAST_CLEARANCE: Final = 0.02
"""Share of the turn radius that planners keep from obstacles at the least, where less is wanted."""
MAX_WIND_FRACTION: Final = 0.9
"""Wind from this fraction of the airspeed on is refused: against it an aircraft makes hardly any way."""


def performance_of(scenario: ScenarioKeys) -> Performance:
    """What the scenario's aircraft can do at its airspeed under its guidance, in its wind and turbulence.

    A KeyFault says that it cannot hold the airspeed, its wind is too strong, or the law does not track with it.
    """
    from aircraft.airframes import AircraftError
    from aircraft.envelope import performance

    spec, air = scenario.aircraft, scenario.environment
    wind_mps = wind_mps_of(scenario)
    try:
        frame = airframe_of(spec)
        frame.check_airspeed(spec.airspeed_mps)
        if wind_mps >= MAX_WIND_FRACTION * spec.airspeed_mps:
            told = f"is {wind_mps:g}; must be below {MAX_WIND_FRACTION:g} of the airspeed {spec.airspeed_mps:g} m/s"
            raise KeyFault(("environment", "wind", "speed_mps"), told)
        law = card_of(scenario.guidance, spec)
        return performance(frame, spec.airspeed_mps, wind_mps, air.gusts, law=law)
    except AircraftError as error:
        raise KeyFault(("aircraft", "airspeed_mps"), str(error)) from error


def wind_mps_of(scenario: ScenarioKeys) -> float:
    """Largest speed of the wind at the mission's altitude at any time (m/s); the ground is taken to be at sea level."""
    wind = scenario.environment.wind
    if wind is None:
        return 0.0
    if wind.measured_at_m is None:
        return wind.fastest_mps
    return wind.fastest_mps * profile_share(scenario.mission.altitude_m, wind.measured_at_m)


def mission_of(scenario: ScenarioKeys, performance: Performance | None = None) -> Mission:
    """What a planner is told before the flight; what the aircraft can do is looked up unless it is given.

    The clearance is `planner.clearance_m` and, on top, the margin for the error of the believed position. It is no less
    than `LEAST_CLEARANCE` of the turn radius: maps and searches have cells of its size. The same margin is kept from
    the border of the area, as far as start and goal lie within it. The tracking error is kept as well, but from a side
    that start or goal is near to.
    """
    from planner.interface import Mission

    performance = performance or performance_of(scenario)
    margin_m, radius_m = scenario.navigation.margin_m or 0.0, performance.turn_radius_m
    clearance_m = max(scenario.planner.clearance_m + margin_m, LEAST_CLEARANCE * radius_m)
    return Mission(
        goal_m=scenario.mission.goal_m,
        goal_radius_m=scenario.mission.goal_radius_m,
        bounds_m=_inset(scenario, margin_m, performance.tracking_error_m, near_m=radius_m),
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
    )


def _inset(scenario: ScenarioKeys, margin_m: float, tracking_m: float, near_m: float) -> Bounds:
    """The area's bounds moved in by a margin, but not past start and goal, and by the tracking error.

    The latter is not kept from sides that start or goal is nearer to than `near_m`.
    """
    xmin, ymin, xmax, ymax = scenario.area.bounds_m
    east, north = zip(scenario.mission.start_m, scenario.mission.goal_m, strict=True)
    xmin, xmax = min(xmin + margin_m, *east), max(xmax - margin_m, *east)
    ymin, ymax = min(ymin + margin_m, *north), max(ymax - margin_m, *north)
    return (
        xmin + tracking_m * (min(east) - xmin >= near_m),
        ymin + tracking_m * (min(north) - ymin >= near_m),
        xmax - tracking_m * (xmax - max(east) >= near_m),
        ymax - tracking_m * (ymax - max(north) >= near_m),
    )
