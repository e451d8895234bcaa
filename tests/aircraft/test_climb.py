"""How fast aircraft climb and sink, and the guidance that holds within it."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aircraft.airframe import AutopilotKeys
from aircraft.airframes import airframe
from aircraft.climb import ClimbRates, climb_rates, holds
from aircraft.guidance.altitude import AltitudeGuidance, VerticalProfile, flat, slewed
from aircraft.interface import AircraftState


@pytest.mark.flights
def test_a_rate_that_is_promised_is_flown_and_a_faster_one_is_not() -> None:
    rates = climb_rates(frame := airframe("aerosonde"))
    climb, descent = rates.at(25.0)
    assert 4.0 < climb < 8.0
    assert 5.0 < descent < 10.0
    for share, held in ((0.95, True), (1.2, False)):
        assert holds(frame, 25.0, share * climb) is held
        assert holds(frame, 25.0, -share * descent) is held
    assert holds(airframe("c172x"), 36.0, 4.0), "JSBSim's trim has 4.4; the throttle swings for a minute"
    assert rates.at(rates.airspeeds_mps[-1])[0] < 1.0, "at the fastest there is no throttle left"
    limited = climb_rates(airframe("aerosonde", None, AutopilotKeys(pitch_limits_deg=(-3.0, 6.0))))
    lift = 11.0 * 9.80665 / (0.5 * 1.19 * 26.2**2 * 0.55)
    alpha = (lift - 0.23) / 5.61  # CL = 0.23 + 5.61 alpha, the book's
    assert limited.at(26.2)[0] == pytest.approx(26.2 * math.sin(math.radians(6.0) - alpha), abs=0.2)
    for name, speed in (("DHC6", 50.0), ("penguin_b", 20.0)):
        assert min(climb_rates(airframe(name)).at(speed)) > 1.5, "JSBSim's trims: 5.1 and 5.0, 2.7 and 2.1"


def test_rates_are_kept_and_made_anew_where_the_cache_is_spoilt(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("aircraft.climb.fastest_mps", lambda frame, speed, side: 3.0 + side)
    frame = airframe("aerosonde")
    rates = climb_rates(frame)
    assert (rates.climb_mps[0], rates.descent_mps[0]) == (4.0, 2.0)
    (kept,) = tmp_path.rglob("aerosonde-climb-*.json")
    kept.write_text(kept.read_text().replace("4.0", "-4.0"))
    assert climb_rates(frame) == rates
    assert ClimbRates((10.0, 20.0), (1.0, 3.0), (2.0, 2.0)).at(15.0) == (2.0, 2.0)


def state(up_m: float, airspeed_mps: float = 25.0) -> AircraftState:
    return AircraftState(0, 0, 0, up_m, 0, airspeed_mps, 0, 0, 0, 0, airspeed_mps, 1.0)


RAMP = VerticalProfile(
    np.array([0.0, 1000.0, 2000.0, 3000.0]),
    np.array([300.0, 300.0, 400.0, 400.0]),
    np.array([0.0, 2500.0]),
    np.array([25.0, 20.0]),
)


def test_a_profile_is_linear_between_its_points_and_level_beyond_them() -> None:
    places = np.array([-10.0, 500.0, 1500.0, 2999.0, 9999.0])
    assert RAMP.altitudes(places).tolist() == [300.0, 300.0, 350.0, 400.0, 400.0]
    assert RAMP.slopes(places).tolist() == [0.0, 0.0, 0.1, 0.0, 0.0]
    assert RAMP.airspeeds(places).tolist() == [25.0, 25.0, 25.0, 20.0, 20.0]
    # A pole of 100 m between two places of a flight at 300 m.
    pole = replace(RAMP, arc_length_m=np.arange(4.0), altitude_m=RAMP.altitude_m[[0, 0, 2, 0]])
    wanted, slopes = pole.passed(np.array([0.5, 3.5]), np.full(2, 300.0))
    assert (wanted.tolist(), slopes.tolist()) == ([300.0, 400.0], [0.0, 100.0])
    assert not RAMP.level
    assert flat(300.0, 25.0).level


def test_the_command_gives_the_climb_of_the_profile_within_what_can_be_flown() -> None:

    def climb(up_m: float, along_m: float) -> float:
        """What the inner loop makes of the command, on average until the next."""
        altitude, _ = AltitudeGuidance(RAMP, 0.8, lambda speed: (5.0, 6.0)).command(state(up_m), along_m)
        return 0.8 * (altitude - up_m) / (1.0 + 0.8 * 0.05)

    assert climb(350.0, 1500.0) == pytest.approx(2.5)
    assert climb(348.0, 1500.0) == pytest.approx(2.5 + 1.6)
    assert climb(300.0, 1500.0) == pytest.approx(5.0)
    assert climb(400.0, 1500.0) == pytest.approx(-6.0)
    assert climb(400.0, 2800.0) == pytest.approx(0.0)


def test_speed_goes_before_height() -> None:
    guidance = AltitudeGuidance(RAMP, 0.8, lambda speed: (5.0, 6.0))

    def climb(airspeed_mps: float) -> float:
        altitude, _ = guidance.command(state(300.0, airspeed_mps), 1500.0)
        return 0.8 * (altitude - 300.0) / (1.0 + 0.8 * 0.05)

    assert climb(24.0) == pytest.approx(5.0)
    assert 0.0 < climb(23.0) < 4.0
    assert climb(21.0) == pytest.approx(0.0)


def test_a_level_profile_is_commanded_as_it_is() -> None:
    guidance = AltitudeGuidance(flat(321.0, 25.0), 0.8, lambda speed: (math.nan, math.nan))
    assert guidance.command(state(300.0), 0.0) == (321.0, 25.0)


def test_airspeeds_change_slowly_in_command_and_in_what_they_are_held_against() -> None:
    guidance = AltitudeGuidance(RAMP, 0.8, lambda speed: (5.0, 6.0))
    commanded = [guidance.command(state(400.0), 2600.0)[1] for _ in range(200)]
    assert commanded[0] == pytest.approx(25.0 - 0.05)
    assert commanded[-1] == 20.0
    time_s = np.arange(1, 201) / 10.0
    asked = np.append(25.0, np.full(200, 20.0))
    assert slewed(asked, np.append(0.0, time_s), float(asked[0]))[1:] == pytest.approx(commanded)
