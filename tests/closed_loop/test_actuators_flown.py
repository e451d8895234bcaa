"""Flights with servos: the scenario's keys, the verdict's cause, and what a flight without them has."""

import numpy as np
import pytest

from harness.analysis.metrics import metrics
from harness.flight.closed_loop import fly
from harness.run.scenario_flight import flight_limits, make_loop
from harness.scenario.performance import performance_of
from tests.scenarios import scenario_of
from wayproof import InputError, Scenario, dump_scenario

TEXT = """\
schema: wayproof/scenario/1
name: servos
area: {bounds_m: [0, 0, 10000, 10000]}
mission: {start_m: [1000, 1000], course_deg: 90, goal_m: [1000, 2500]}
sensor: {range_m: 2000, rays: 90}
"""
SERVO = "aircraft: {actuators: {lag_s: 0.05, rate_limit_degps: 600, deadband_deg: 0.2}}\n"


def scenario(aircraft: str = "") -> Scenario:
    return scenario_of(TEXT + aircraft)


@pytest.mark.flights
def test_servos_are_flown_and_planning_knows_of_them() -> None:
    plain, real = scenario(), scenario(SERVO)
    assert scenario_of(dump_scenario(real)) == real
    slow = plain.with_({"aircraft.actuators": {"lag_s": 0.3}})
    assert performance_of(slow).tracking_error_m > performance_of(plain).tracking_error_m
    flight = fly(make_loop(real))
    assert flight.outcome.value == "reached"
    assert (np.diff(flight.track.actuator_limited_s) >= 0.0).all()
    without = fly(make_loop(plain)).track.actuator_limited_s
    assert without is not None
    assert not without.any()


@pytest.mark.parametrize(
    ("aircraft", "said"),
    [
        ("aircraft: {actuators: {lag_s: -1}}", "6: aircraft.actuators.lag_s: is -1; must be at least 0"),
        ("aircraft: {actuators: {rate: 3}}", "6: aircraft.actuators.rate"),
        ("aircraft: {actuators: {lag_s: 3}}", "6: aircraft.actuators.lag_s: is 3; must be another, or left"),
        ("aircraft: {model: T38, actuators: {rate_limit_degps: 60}}",
            "its model does not show how far the aileron"),
    ],
)  # fmt: skip
def test_servos_that_cannot_be_flown_are_refused(aircraft: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        scenario(aircraft + "\n")
    assert said in str(refused.value)


def causes(flown: Scenario) -> set[str | None]:
    """Why legs of a flight were not trackable."""
    told = metrics(fly(make_loop(flown)), flight_limits(flown))["trackability"]
    return {leg["cause"] for leg in told if not leg["trackable"]}


@pytest.mark.flights
def test_altitude_lost_behind_a_slow_elevator_is_the_servo_s() -> None:
    """In severe turbulence an elevator of 20 deg/s is at its rate limit, and 20 m are lost; a fast one loses 1 m."""
    severe = scenario().with_(
        {
            "environment.turbulence": {"model": "tustin", "intensity": "severe"},
            "trackability": {"altitude_m": 4.0, "cross_track_m": 50.0},
        }
    )
    assert causes(severe.with_({"aircraft.actuators": {"rate_limit_degps": 20.0}})) == {"actuator"}
    assert causes(severe.with_({"aircraft.actuators": {"rate_limit_degps": 600.0}})) == set()
