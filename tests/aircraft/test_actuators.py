"""Servos: what they do to a command, what they change of an aircraft, what is refused."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from aircraft.actuators import Actuator, Actuators
from aircraft.airframes import AircraftError, airframe
from aircraft.autopilot import NEEDED_MARGIN_DEG, gains, pitch_margin_deg, roll_margin_deg
from aircraft.deviation import Deviation
from aircraft.frames import LocalPlane
from aircraft.jsbsim_loading import linearised, surface_travel_deg, trimmed
from aircraft.jsbsim_model import JsbsimModel
from aircraft.model_files import model_files
from aircraft.start import StartConditions
from aircraft.trials import in_flight

SERVO = Actuator(lag_s=0.05, rate_limit_degps=600.0, deadband_deg=0.2)
START = StartConditions(0.0, 0.0, 300.0, 0.0, 25.0)


def flown(actuators: Actuators) -> JsbsimModel:
    """An Aerosonde in level flight, half a second under way."""
    model = JsbsimModel(airframe("aerosonde", actuators), START, LocalPlane(47.0, 8.0), step_rate_hz=120)
    model.advance(60)
    return model


def test_surfaces_move_as_far_as_their_models_say() -> None:
    travel_deg = {"aileron": 25.0, "elevator": 25.0, "rudder": 25.0, "throttle": 60.0}
    assert surface_travel_deg(model_files("aerosonde")) == pytest.approx(travel_deg, abs=0.01)


@pytest.mark.flights
def test_a_command_moves_a_surface_no_faster_than_the_rate_limit_and_counts_the_time() -> None:
    model = flown(Actuators(aileron=Actuator(rate_limit_degps=50.0)))
    assert model.state().actuator_limited_s == 0.0
    before = model._fdm["fcs/aileron-cmd-norm"]
    model.command(math.radians(30.0), 300.0, 25.0)
    model.advance(13)  # the command is read in the first of them
    assert 25.0 * (model._fdm["fcs/aileron-cmd-norm"] - before) == pytest.approx(50.0 * 12 / 120, rel=0.1)
    assert model.state().actuator_limited_s == pytest.approx(12 / 120, abs=1.5 / 120)


@pytest.mark.flights
def test_a_lag_is_of_first_order() -> None:
    model = flown(Actuators(elevator=Actuator(lag_s=0.5)))
    fdm = model._fdm
    # What is asked for is held still, as if the loops did nothing.
    model.command(0.0, 320.0, 25.0)
    rows = []
    for _ in range(24):
        model.advance(1)
        rows.append((fdm["wayproof/elevator-asked-norm"], fdm["wayproof/elevator-servo-norm"]))
    servo = rows[0][1]
    for (before, _), (asked, told) in pairwise(rows):
        servo += (1.0 - math.exp(-1.0 / (0.5 * 120))) * (0.5 * (before + asked) - servo)
        assert told == pytest.approx(servo, abs=2e-4)
    assert abs(rows[-1][1]) < 0.6 * abs(rows[-1][0])


@pytest.mark.flights
def test_a_deadband_lies_about_the_trim() -> None:
    """About no throttle it would take a tenth of it away."""
    model = flown(Actuators(throttle=Actuator(deadband_deg=12.0)))
    trim = model._fdm["wayproof/trim/throttle-norm"]
    assert trim > 0.5
    assert model._fdm["fcs/throttle-cmd-norm"] == trim
    model.command(0.0, 300.0, 25.05)
    model.advance(60)
    assert abs(model._fdm["wayproof/throttle-norm"] - trim) > 0.001
    assert model._fdm["fcs/throttle-cmd-norm"] == trim


def test_an_ideal_servo_changes_nothing() -> None:
    assert airframe("aerosonde", Actuators.alike(Actuator())) == airframe("aerosonde")
    assert airframe("aerosonde").files.actuators == ()


@pytest.mark.flights
def test_figures_are_flown_anew_with_servos_and_the_cache_tells_them_apart() -> None:
    plain, real = airframe("aerosonde"), airframe("aerosonde", Actuators.alike(SERVO))
    assert plain.files.digest() != real.files.digest()
    assert real.roll_delay_s == pytest.approx(plain.roll_delay_s + SERVO.lag_s, abs=0.011)
    assert real.weave_error_m > plain.weave_error_m
    assert real.gains.roll <= plain.gains.roll


@pytest.mark.flights
def test_gains_keep_a_phase_margin_behind_a_lag() -> None:
    at = linearised(trimmed(model_files("aerosonde"), 25.0))
    real = airframe("aerosonde", Actuators.alike(SERVO))
    assert roll_margin_deg(at, real.gains, SERVO.lag_s) > NEEDED_MARGIN_DEG
    assert pitch_margin_deg(at, real.gains, SERVO.lag_s) > NEEDED_MARGIN_DEG
    for lag_s in (0.02, 0.1, 0.2):
        assert roll_margin_deg(at, gains(at), lag_s) < roll_margin_deg(at, gains(at), 0.5 * lag_s)
        assert roll_margin_deg(at, gains(at, 0.5), lag_s) > roll_margin_deg(at, gains(at), lag_s)


def test_servos_that_are_too_slow_are_refused() -> None:
    with pytest.raises(AircraftError, match=r"cannot be held at 25 m/s: .*lag of the aileron of 3 s.*must have 45"):
        airframe("aerosonde", Actuators(aileron=Actuator(lag_s=3.0)))


def test_degrees_mean_nothing_where_a_model_shows_no_surface() -> None:
    with pytest.raises(AircraftError, match=r"T38: its model does not show how far the aileron moves"):
        airframe("T38", Actuators.alike(SERVO))


@pytest.mark.flights
def test_a_flying_wing_has_servos_and_a_day_of_its_own_without_a_rudder() -> None:
    frame = airframe("x8", Actuators.alike(SERVO))
    assert [control for control, _ in frame.files.actuators] == ["aileron", "elevator", "throttle"]
    other = replace(frame, files=replace(frame.files, deviation=Deviation(rudder=0.1, aileron=0.1)))
    assert in_flight(other, 18.0).state().airspeed_mps == pytest.approx(18.0, abs=0.1)
