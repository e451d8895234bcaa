"""The sections navigation, with presets and the margin that a plan needs, and simulation, with its rate."""

import math
from typing import Any

import pytest

from harness.flight.closed_loop import fly
from harness.run.scenario_flight import make_loop
from harness.scenario.navigation import Navigation, planning_margin_m
from tests.scenarios import LEAST, scenario_of
from wayproof import InputError, Scenario, dump_scenario

SHORT = LEAST.replace("40000, 40000", "10000, 10000").replace("[31000, 1000]", "[1000, 3000]")


def scenario(*lines: str) -> Scenario:
    return scenario_of(SHORT + "".join(f"{line}\n" for line in lines))


def test_what_is_given_goes_before_the_preset_and_only_that_counts_as_given() -> None:
    given = scenario("navigation: {kind: gnss, position_sigma_m: 2, outages_s: [[5, 9], [10, 20]]}")
    found = given.navigation
    assert (found.position_sigma_m, found.position_correlation_s) == (2.0, 1100.0)
    assert found.outages_s == ((5.0, 9.0), (10.0, 20.0))
    other = given.with_({"navigation.kind": "rtk"}).navigation
    assert (other.position_sigma_m, other.position_correlation_s) == (2.0, 100.0)


def test_gps_is_as_large_as_what_drives_it_makes_it() -> None:
    """Beard and McLain drive the error by 0.21 m (0.40 m in altitude) once a second."""
    grown = 1.0 / math.sqrt(1.0 - math.exp(-2.0 / 1100.0))
    gnss = scenario("navigation: {kind: gnss}").navigation
    assert gnss.position_sigma_m == pytest.approx(0.21 * grown, rel=0.06)
    assert gnss.altitude_sigma_m == pytest.approx(0.40 * grown, rel=0.06)


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ("kind: gps", "navigation.kind: is the text 'gps'; must be 'perfect', 'gnss', 'rtk' or 'dead_reckoning'"),
        ("kind: gnss, position_sigma_m: -1", "navigation.position_sigma_m: is -1; must be at least 0"),
        ("kind: gnss, position_correlation_s: 0", "navigation.position_correlation_s: is 0; must be at least 0.001"),
        ("kind: gnss, drift_share: 1.5", "navigation.drift_share: is 1.5; must be at most 1"),
        ("kind: gnss, heading_sigma_deg: .inf", "navigation.heading_sigma_deg: is inf; must be a finite number"),
        ("kind: gnss, outages_s: [[5, 5]]", "navigation.outages_s[0]: is [5, 5]; must be [from, to] with from < to"),
        (
            "kind: gnss, outages_s: [[5, 9], [8, 20]]",
            "navigation.outages_s[1]: is [8, 20]; must begin after 9 s, the end of the one before",
        ),
        ("position_sigma_m: 3", "navigation.position_sigma_m: is 3, but kind perfect has no error"),
        ("outages_s: [[5, 9]]", "navigation.outages_s: is given, but kind perfect has no error"),
        ("sigma_m: 3", "navigation.sigma_m: unknown key"),
        ("kind: rtk, margin_m: -1", "navigation.margin_m: is -1; must be at least 0"),
    ],
)  # fmt: skip
def test_faults_name_line_key_and_what_would_be_right(keys: str, sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        scenario_of(f"{LEAST}navigation: {{{keys}}}\n")
    assert str(refused.value).startswith(f"scenario.yaml:5: {sentence}")


@pytest.mark.parametrize(
    ("keys", "margin_m"),
    [
        ({"kind": "perfect"}, 0.0),
        ({"kind": "gnss"}, 14.1),
        ({"kind": "gnss", "position_bias_m": [3, -4]}, 14.1 + 5.0),
        # The longest of the outages, and no longer than the flight: 0.03 x 25 m/s x 60 s, and x 40 s.
        ({"kind": "gnss", "outages_s": [[0, 60], [70, 100]]}, 14.1 + 45.0),
        ({"kind": "gnss", "outages_s": [[960, 1060]]}, 14.1 + 30.0),
        ({"kind": "dead_reckoning"}, 0.01 * math.pi * 1000.0),  # half a turn of 1 km
    ],
)  # fmt: skip
def test_the_margin_is_sigmas_bias_and_the_longest_outage(keys: dict[str, Any], margin_m: float) -> None:
    sure_of_heading = {} if keys["kind"] == "perfect" else {"heading_sigma_deg": 0.0}
    navigation = Navigation.model_validate({**keys, **sure_of_heading})
    assert planning_margin_m(navigation, 25.0, 1000.0, 300.0, 1000.0) == pytest.approx(margin_m)


@pytest.mark.parametrize(
    ("heading_deg", "clearance_m", "radius_m", "along_m"),
    [
        (1.0, 300.0, 187.0, 300.0),
        (1.0, 20.0, 187.0, 4.0 * 187.0 * 3.0 * math.radians(1.0)),  # 39 m to turn aside by 2 m
        (0.0, 300.0, 187.0, 0.0),
    ],
)  # fmt: skip
def test_the_margin_has_what_the_heading_misplaces_an_edge_by_before_the_plan_is_mended(
    heading_deg: float, clearance_m: float, radius_m: float, along_m: float
) -> None:
    navigation = Navigation(kind="rtk", heading_sigma_deg=heading_deg)
    margin_m = planning_margin_m(navigation, 25.0, 1000.0, clearance_m, radius_m)
    assert margin_m == pytest.approx(3.0 * 0.017 + 3.0 * math.radians(heading_deg) * along_m)


@pytest.mark.parametrize(("sensor_hz", "rate_hz"), [(2, 60), (0.5, 60), (60, 60), (8, 120), (24, 120), (120, 120)])
def test_the_default_is_the_first_rate_that_the_sensor_divides(sensor_hz: float, rate_hz: int) -> None:
    assert scenario(f"sensor: {{rate_hz: {sensor_hz}}}").simulation.rate_hz == rate_hz


def test_is_written_out_and_read_back() -> None:
    fine = scenario("simulation: {rate_hz: 240}")
    assert fine.simulation.rate_hz == 240
    assert scenario_of(dump_scenario(fine)) == fine
    assert scenario().with_({"simulation.rate_hz": 480}).simulation.rate_hz == 480


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["simulation: {rate_hz: 75}"], "5: simulation.rate_hz: is 75; must be a multiple of 10"),
        (["simulation: {rate_hz: 20}"], "5: simulation.rate_hz: is 20; must be at least 30"),
        (["simulation: {rate_hz: 60.5}"], "5: simulation.rate_hz"),
        (["simulation: {rates_hz: 60}"], "did you mean rate_hz?"),
        (
            ["sensor: {rate_hz: 8}", "simulation: {rate_hz: 60}"],
            "5: sensor.rate_hz: is 8, which does not divide simulation.rate_hz 60; the nearest that does is 7.5",
        ),
        (["sensor: {rate_hz: 7}"], "does not divide 120 Hz; the nearest that does is 7.0588"),
        (
            ["sensor: {rate_hz: 500}", "simulation: {rate_hz: 60}"],
            "which does not divide simulation.rate_hz 60; the nearest that does is 60",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_flown_is_refused(lines: list[str], said: str) -> None:
    with pytest.raises(InputError) as refused:
        scenario(*lines)
    assert said in str(refused.value)


def test_flights_take_so_many_steps() -> None:
    asked = scenario("sensor: {rate_hz: 5, range_m: 3000, rays: 90}", "simulation: {rate_hz: 90}")
    assert make_loop(asked).model.step_rate_hz == 90
    assert fly(make_loop(asked)).outcome.value == "reached"
