"""The table of airframes and what planning derives from it."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aircraft.airframes import AircraftError, aircraft_names, airframe
from aircraft.envelope import LEAST_BANK_DEG, performance
from wayproof import InputError, load_scenario

VERIFIED = ("aerosonde", "c172p", "T38")


def test_known_aircraft() -> None:
    assert aircraft_names()[:2] == ("aerosonde", "ultrastick25e")
    assert airframe("aerosonde").mass_kg == 11.0


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        *(("model", name, "unknown aircraft '.*'; known are: aerosonde") for name in ("no", "x" * 300, "~no/no")),
        ("airspeed_mps", 40, "aerosonde cannot hold 40 m/s; its .* is 17.4 to 32.3 m/s"),
    ],
)  # fmt: skip
def test_what_no_aircraft_is_or_holds_is_told_with_what_would_do(key: str, value: object, said: str) -> None:
    with pytest.raises(InputError, match=said):
        load_scenario("paper_circles").with_({f"aircraft.{key}": value})


def test_turn_radius_of_the_aerosonde() -> None:
    calm = performance(airframe("aerosonde"), 25.0)
    assert calm.turn_radius_m == pytest.approx(110.4, abs=0.1)
    windy = performance(airframe("aerosonde"), 25.0, wind_mps=7.5)
    assert windy.turn_radius_m == pytest.approx(calm.turn_radius_m * 1.3**2)


def test_a_hold_is_tighter_than_a_turn() -> None:
    frame = airframe("aerosonde")
    calm_by_hand = 25.0**2 / (9.80665 * math.tan(math.radians(35.0)))  # the limit of 45 less 10
    assert performance(frame, 25.0).hold_radius_m == pytest.approx(calm_by_hand)
    for wind_mps in (8.0, 12.0):  # (Va + W)^2 / (g tan 40 deg): the limit of 45 less 5
        by_hand = (25.0 + wind_mps) ** 2 / (9.80665 * math.tan(math.radians(40.0)))
        assert performance(frame, 25.0, wind_mps).hold_radius_m == pytest.approx(by_hand)
    assert performance(frame, 25.0, 1.0).hold_radius_m == pytest.approx(calm_by_hand)  # no tighter than that


@pytest.mark.parametrize(("turbulence", "bank_deg"), [(None, 38.0), ("moderate", 33.0)])
def test_turns_with_room_to_roll_between_are_tighter_in_wind(turbulence: str | None, bank_deg: float) -> None:
    frame = airframe("aerosonde")
    calm = performance(frame, 25.0, 0.0, turbulence)
    assert calm.spaced_radius_m == calm.turn_radius_m
    assert performance(frame, 25.0, 1.0, turbulence).spaced_radius_m == calm.turn_radius_m  # no tighter than that
    for wind_mps in (8.0, 12.0):  # the limit of 45 less 7, in moderate turbulence 12
        windy = performance(frame, 25.0, wind_mps, turbulence)
        by_hand = (25.0 + wind_mps) ** 2 / (9.80665 * math.tan(math.radians(bank_deg)))
        assert windy.spaced_radius_m == pytest.approx(by_hand)
        assert windy.hold_radius_m < windy.spaced_radius_m < windy.turn_radius_m


@pytest.mark.flights
@given(st.sampled_from(VERIFIED), st.floats(0.0, 1.0), st.floats(0.0, 0.9))
def test_more_wind_or_turbulence_never_tightens_the_turn(name: str, share: float, wind_share: float) -> None:
    frame = airframe(name)
    low, high = frame.airspeed_range_mps
    airspeed = low + share * (high - low)
    wind = wind_share * low
    levels = (None, "light", "moderate", "severe")
    if frame.level_bank_deg(airspeed) < LEAST_BANK_DEG:
        return
    radii = [performance(frame, airspeed, wind, level).turn_radius_m for level in levels]
    errors = [performance(frame, airspeed, wind, level).tracking_error_m for level in levels]
    assert radii == sorted(radii)
    assert errors == sorted(errors)
    assert performance(frame, airspeed).turn_radius_m <= radii[0]


def test_wind_that_cannot_be_made_good_is_refused() -> None:
    with pytest.raises(AircraftError, match="cannot make way against a wind of 25 m/s"):
        performance(airframe("aerosonde"), 25.0, wind_mps=25.0)


def test_planning_banks_no_steeper_than_speed_and_altitude_allow() -> None:
    assert airframe("x8").level_bank_deg(12.0) == 45.0, "1.25 of its slowest: lift for 50 degrees"
    frame, slow = airframe("aerosonde"), 18.0
    bank = math.radians(frame.level_bank_deg(slow))
    assert math.degrees(bank) < frame.bank_limit_deg - 15.0
    assert performance(frame, slow).turn_radius_m == pytest.approx(slow**2 / (9.80665 * math.tan(bank)))
    with pytest.raises(AircraftError, match=r"cannot turn at 18 m/s: .* up to 3.0 degrees"):
        performance(replace(frame, level_banks=((18.0, 3.0),)), slow)


@pytest.mark.parametrize(("limit_deg", "bank_deg"), [(5.0, 2.5), (12.0, 5.0), (15.0, 5.0), (22.0, 7.0)])
def test_a_small_bank_limit_is_planned_for(limit_deg: float, bank_deg: float) -> None:
    frame = replace(airframe("aerosonde"), bank_limit_deg=limit_deg)
    by_hand = 25.0**2 / (9.80665 * math.tan(math.radians(bank_deg)))
    assert performance(frame, 25.0).turn_radius_m == pytest.approx(by_hand)
    for turbulence in ("light", "moderate", "severe"):
        gusty = performance(frame, 25.0, 5.0, turbulence)
        assert 0.0 < gusty.hold_radius_m <= gusty.spaced_radius_m <= gusty.turn_radius_m < math.inf


def test_level_banks_are_joined_by_lines() -> None:
    frame = replace(airframe("aerosonde"), level_banks=((20.0, 10.0), (30.0, 40.0), (40.0, 20.0)))
    flown = [frame.level_bank_deg(speed) for speed in (15.0, 20.0, 25.0, 30.0, 35.0, 45.0)]
    assert flown == pytest.approx([10.0, 10.0, 25.0, 40.0, 30.0, 20.0])


def test_what_rolls_slowly_is_planned_to_turn_wide() -> None:
    frame = replace(airframe("aerosonde"), roll_rate_dps=8.0)
    wide = 25.0**2 / (9.80665 * math.tan(math.radians(12.0)))
    assert performance(frame, 25.0).turn_radius_m == pytest.approx(wide)


def test_an_aircraft_that_was_seen_to_track_badly_is_given_more_room() -> None:
    frame = airframe("aerosonde")
    assert performance(frame, 25.0).tracking_error_m >= 1.5 * frame.weave_error_m > 0.0
    assert performance(replace(frame, weave_error_m=2.0), 25.0).tracking_error_m == pytest.approx(3.0)
