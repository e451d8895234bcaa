"""The autopilot at the edges of what an aircraft can do: it loses height, and does not stall by itself."""

import math

import numpy as np
import pytest

from aircraft.airframes import airframe
from aircraft.frames import LocalPlane
from aircraft.interface import GRAVITY_MPS2, FloatArray
from aircraft.jsbsim_model import JsbsimModel
from aircraft.start import Atmosphere, StartConditions


def started(airspeed_mps: float, altitude_m: float = 300.0, name: str = "aerosonde", **keys: object) -> JsbsimModel:
    start = StartConditions(0.0, 0.0, altitude_m, 0.0, airspeed_mps)
    return JsbsimModel(airframe(name), start, LocalPlane(45.0, 0.0), **keys)  # type: ignore[arg-type]


def flown(model: JsbsimModel, bank_deg: float, altitude_m: float, speed: float, seconds: float) -> FloatArray:
    """(n, 6) time, altitude, airspeed, pitch (deg), throttle, alpha (deg) at 10 Hz; control must not be lost."""
    rows = []
    for _ in range(round(10 * seconds)):
        model.command(math.radians(bank_deg), altitude_m, speed)
        model.advance(model.step_rate_hz // 10)
        assert model.fault() is None
        s = model.state()
        rows.append((s.time_s, s.up_m, s.airspeed_mps, s.pitch_rad, s.throttle, s.angle_of_attack_rad))
    return np.array(rows) * (1.0, 1.0, 1.0, math.degrees(1.0), 1.0, math.degrees(1.0))


def test_level_after_a_turn_that_cannot_be_held() -> None:
    """At 20 m/s and 45 degrees of bank the elevator is at its stop; then wings level, far below the altitude."""
    model = started(20.0)
    flown(model, 45.0, 300.0, 20.0, 60.0)
    after = flown(model, 0.0, model.state().up_m - 7.0, 20.0, 20.0)
    assert after[:, 3].max() < 15.0
    assert after[-1, 2] == pytest.approx(20.0, abs=0.3)
    climbing = flown(model, 0.0, model.state().up_m + 60.0, 20.0, 20.0)
    assert climbing[:, 3].max() < 20.0
    assert climbing[:, 2].min() > 19.0


def test_near_the_lowest_speed_a_turn_and_the_level_flight_after_it_are_held() -> None:
    model = started(17.7)
    assert np.abs(flown(model, 18.6, 300.0, 17.7, 60.0)[:, 1] - 300.0).max() < 5.0
    level = flown(model, 0.0, 300.0, 17.7, 60.0)
    assert level[:, 3].max() < 15.0
    assert np.abs(level[-100:, 1] - 300.0).max() < 0.5


def test_a_climb_that_is_too_steep_is_flown_at_the_commanded_airspeed() -> None:
    """At 5,000 m there is less than 5 m/s of climb: the rest is missing from the height, not from the airspeed.

    The climb at full throttle is that of the energy balance, (thrust - drag) V / weight, taken from the energy
    that a level acceleration at full throttle gains.
    """
    model = started(25.0, 5000.0, climb_limit_mps=5.0)
    flown(model, 0.0, 5600.0, 25.0, 20.0)
    climb = flown(model, 0.0, 5600.0, 25.0, 60.0)
    assert np.ptp(climb[:, 2]) < 0.3
    assert np.abs(climb[:, 2] - 25.0).max() < 0.3
    flown_mps = (climb[-1, 1] - climb[0, 1]) / (climb[-1, 0] - climb[0, 0])
    altitude_m = float(climb[len(climb) // 2, 1])
    level = flown(started(24.0, altitude_m), 0.0, altitude_m, 30.0, 5.0)
    energy_m = level[:, 1] + level[:, 2] ** 2 / (2.0 * GRAVITY_MPS2)
    full = (level[:, 4] == 1.0) & (np.abs(level[:, 2] - 25.0) < 0.6)
    assert full.sum() > 4
    assert flown_mps == pytest.approx(np.polyfit(level[full, 0], energy_m[full], 1)[0], rel=0.1)


@pytest.mark.parametrize("intensity", ["moderate", "severe"])
@pytest.mark.parametrize("seed", [1, 3])
def test_the_lowest_speeds_are_flown_in_turbulence(intensity: str, seed: int) -> None:
    model = started(18.0, atmosphere=Atmosphere(turbulence="tustin", intensity=intensity, seed=seed))
    track = flown(model, 15.0, 300.0, 18.0, 120.0)
    assert np.abs(track[:, 1] - 300.0).max() < 25.0
    assert track[:, 2].min() > 15.0


def test_a_light_aircraft_keeps_its_height_in_moderate_turbulence() -> None:
    """Long downdraughts are no stall: the angle of attack is in the lift, not in pitch and flight path over ground."""
    air = Atmosphere(turbulence="tustin", intensity="moderate", seed=3)
    model = started(17.0, name="ultrastick25e", atmosphere=air)
    assert np.abs(flown(model, 15.0, 300.0, 17.0, 200.0)[:, 1] - 300.0).max() < 10.0


@pytest.mark.flights
@pytest.mark.parametrize(("name", "stops_deg"), [("A320", -7.0), ("t6texan2", -7.0)])
def test_levelling_off_stays_short_of_the_negative_stall(name: str, stops_deg: float) -> None:
    """In bare JSBSim, put at one angle of attack after the other, their lift falls down to these and no further."""
    speed = airframe(name).cruise_mps
    model = started(speed, 1000.0, name, climb_limit_mps=18.0)
    flown(model, 0.0, 5000.0, speed, 15.0)
    after = flown(model, 0.0, (level := model.state().up_m), speed, 30.0)
    assert stops_deg + 1.5 < after[:, 5].min() < 0.0
    assert (after[:, 1] - level).max() < 18.0**2 / (2.0 * GRAVITY_MPS2) + 25.0
    assert after[-1, 1] == pytest.approx(level, abs=1.0)


@pytest.mark.flights
@pytest.mark.parametrize(("name", "speed"), [("c172p", 27.5), ("DHC6", 46.0)])
def test_levelling_off_slowly_stays_short_of_the_stall(name: str, speed: float) -> None:
    """Their lift per degree becomes less before it stops rising at 16 degrees: 13 are not where a line has them."""
    sunk = flown(started(speed, 360.0, name), 0.0, 300.0, speed, 60.0)
    assert sunk[:, 5].max() < 15.0
    assert sunk[-1, 1] == pytest.approx(300.0, abs=1.0)


def test_pitch_stays_within_its_limits() -> None:
    model = started(25.0)
    model._fdm["wayproof/limit/most-pitch-rad"] = math.radians(6.0)
    model._fdm["wayproof/limit/least-pitch-rad"] = math.radians(1.0)
    assert flown(model, 0.0, 400.0, 25.0, 15.0)[20:, 3].max() < 6.3
    assert flown(model, 0.0, 0.0, 25.0, 15.0)[30:, 3].min() > 0.7
