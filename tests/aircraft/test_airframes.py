"""The table of airframes and what planning derives from it."""

from __future__ import annotations

import math
from importlib.resources import files

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aircraft.airframes import AircraftError, aircraft_names, airframe, parse_airframes
from aircraft.envelope import performance

TABLE = files("aircraft").joinpath("airframes.yaml").read_text("utf-8")


def test_known_aircraft() -> None:
    assert aircraft_names()[:2] == ("aerosonde", "c172p")
    assert airframe("aerosonde").mass_kg == 11.0


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(AircraftError, match=r"unknown aircraft 'nope'; known are: aerosonde, c172p"):
        airframe("nope")


def test_guidance_limits_are_in_radians() -> None:
    limits = airframe("aerosonde").guidance_limits
    assert limits.bank_limit_rad == pytest.approx(math.pi / 4)
    assert limits.roll_rate_radps == pytest.approx(math.pi / 3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass_kg: 11.0", "mas_kg: 11.0", "aerosonde: unknown key 'mas_kg'"),
        ("  mass_kg: 11.0\n", "", "aerosonde: missing key 'mass_kg'"),
        ("mass_kg: 11.0", "mass_kg: -1", "aerosonde.mass_kg: must be a positive number; got -1"),
        ("mass_kg: 11.0", "mass_kg: 11.0\n  mass_kg: 12.0", "'mass_kg' is given twice"),
        ("cruise_mps: 25.0", "cruise_mps: 55.0", r"aerosonde.cruise_mps: must lie in airspeed_range_mps"),
        ("verified: true", "verified: 1", "aerosonde.verified: must be true or false"),
        ("[17.3, 32.4]", "17.3", "aerosonde.airspeed_range_mps: must be"),
        ("    climb: 2.4", "    climbing: 2.4", "aerosonde.gains: unknown gain 'climbing'"),
        ("    climb: 2.4", "    climb: high", "aerosonde.gains.climb: must be a finite number; got 'high'"),
    ],
)
def test_a_broken_table_is_refused(old: str, new: str, message: str) -> None:
    assert old in TABLE
    with pytest.raises(ValueError, match=message):
        parse_airframes(TABLE.replace(old, new, 1))


def test_turn_radius_of_the_aerosonde() -> None:
    calm = performance(airframe("aerosonde"), 25.0)
    assert calm.turn_radius_m == pytest.approx(110.4, abs=0.1)
    windy = performance(airframe("aerosonde"), 25.0, wind_mps=7.5)
    assert windy.turn_radius_m == pytest.approx(calm.turn_radius_m * 1.3**2)


@given(st.sampled_from(aircraft_names()), st.floats(0.0, 1.0), st.floats(0.0, 0.9))
def test_more_wind_or_turbulence_never_tightens_the_turn(name: str, share: float, wind_share: float) -> None:
    frame = airframe(name)
    low, high = frame.airspeed_range_mps
    airspeed = low + share * (high - low)
    wind = wind_share * low
    levels = (None, "light", "moderate", "severe")
    radii = [performance(frame, airspeed, wind, level).turn_radius_m for level in levels]
    errors = [performance(frame, airspeed, wind, level).tracking_error_m for level in levels]
    assert radii == sorted(radii)
    assert errors == sorted(errors)
    assert performance(frame, airspeed).turn_radius_m <= radii[0]


def test_a_speed_out_of_range_names_the_range() -> None:
    with pytest.raises(AircraftError, match=r"cannot hold 40 m/s; its .* is 17.3 to 32.4 m/s"):
        performance(airframe("aerosonde"), 40.0)


def test_wind_that_cannot_be_made_good_is_refused() -> None:
    with pytest.raises(AircraftError, match="cannot make way against a wind of 25 m/s"):
        performance(airframe("aerosonde"), 25.0, wind_mps=25.0)


def test_wrong_air_is_refused() -> None:
    with pytest.raises(ValueError, match="wind_mps must be"):
        performance(airframe("aerosonde"), 25.0, wind_mps=-1.0)
    with pytest.raises(ValueError, match="turbulence must be"):
        performance(airframe("aerosonde"), 25.0, turbulence="wild")
