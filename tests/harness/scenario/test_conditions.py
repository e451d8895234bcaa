"""`conditions`, `uncertainty` and the winds that they fill in, held against formulas and against what was flown."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wayproof
from harness.scenario.conditions import conditions_text
from harness.scenario.environment import Turbulence, Wind
from tests.scenarios import scenario_of

BASE = """
schema: wayproof/scenario/1
name: day
area: {bounds_m: [0, 0, 20000, 20000]}
mission: {start_m: [5000, 5000], goal_m: [7000, 5000], goal_radius_m: 100, altitude_m: 200}
planner: {clearance_m: 50}
"""


def section(scenario: wayproof.Scenario, path: str) -> Any:
    found: Any = scenario
    for name in path.split("."):
        found = getattr(found, name)
    return found


def drawn(day: str, count: int, more: str = "") -> list[wayproof.Scenario]:
    return [scenario_of(f"{BASE}conditions: {day}\nseed: {seed}\n{more}") for seed in range(count)]


def test_typical_winds_have_the_mean_of_the_land_and_deviations_their_sigma() -> None:
    days = drawn("typical", 150, "uncertainty: {mass: 0.1}")
    speeds = np.array([section(day, "environment.wind.speed_mps") for day in days])
    # Rayleigh of mean 3.28: standard deviation 0.5227 of it; a few draws are cut off at 0.35 of 25 m/s.
    assert abs(speeds.mean() - 3.28) < 3 * 0.5227 * 3.28 / math.sqrt(len(days))
    turned = np.radians([section(day, "environment.wind.from_deg") for day in days])
    assert np.hypot(np.cos(turned).mean(), np.sin(turned).mean()) < 0.25  # from everywhere
    for name, sigma in (("mass", 0.1), ("drag", 0.1), ("lift_slope", 0.05)):  # the given and the day's
        values = np.array([getattr(day.aircraft.deviation, name) for day in days])
        assert abs(values.mean()) < 3.5 * sigma / math.sqrt(len(days))
        assert values.std() == pytest.approx(sigma, rel=0.25)


@pytest.mark.flights
def test_a_day_limits_no_surface_whose_travel_is_not_known() -> None:
    (day,) = drawn("rough", 1, "aircraft: {model: T38, airspeed_mps: 150}")
    servos = section(day, "aircraft.actuators").model_dump(exclude_none=True)
    assert servos == {"lag_s": 0.06, "deadband_deg": 0.0}


def test_what_is_drawn_can_be_read_back_however_large_its_sigma() -> None:
    for day in drawn("ideal", 12, "uncertainty: {thrust: 0.4, centre_of_gravity_m: 0.02}"):
        assert abs(section(day, "aircraft.deviation.thrust")) <= 0.5
        assert scenario_of(wayproof.dump_scenario(day)) == day


def test_given_normal_numbers_stand_for_what_the_seed_would_draw() -> None:
    numbers = [0.5, 1.0, *[0.0] * 48, -1.0, *[0.5] * 8]
    day, other = (scenario_of(f"{BASE}conditions: typical\nseed: {s}\nnormals: {numbers}") for s in (1, 2))
    above = [0.5 * math.erfc(each / math.sqrt(2.0)) for each in (0.5, 1.0, -1.0)]
    wind = section(day, "environment.wind")
    rayleigh = 3.28 * math.sqrt(-4.0 / math.pi * math.log(above[0]))  # its quantile, of mean 3.28
    assert (wind.speed_mps, wind.from_deg) == (round(rayleigh, 3), round(360.0 * (1.0 - above[1]), 2))
    assert {change[1] for change in wind.changes} == {wind.speed_mps}
    assert section(day, "environment.vertical_gusts.start_s") == round(120.0 * (1.0 - above[2]), 2)
    assert section(day, "aircraft.deviation.mass") == pytest.approx(0.5 * 0.02)
    assert day.environment == other.environment


@pytest.mark.parametrize(("day", "most"), [("typical", 0.35), ("rough", 0.5)])
@pytest.mark.parametrize("height_m", [10.0, 2.0])
def test_no_wind_at_the_mission_is_stronger_than_its_share_of_the_airspeed(
    day: str, most: float, height_m: float
) -> None:
    profile = math.log(200 / 0.04572) / math.log(height_m / 0.04572)  # MIL-F-8785C
    for scenario in drawn(day, 20, f"environment: {{wind: {{measured_at_m: {height_m}}}}}\n"):
        wind = section(scenario, "environment.wind")
        assert max(wind.speed_mps, *(speed for _, speed, _ in wind.changes)) * profile <= most * 25.0 + 0.01
        assert wind.measured_at_m == height_m


@pytest.mark.flights
def test_what_the_file_says_stays_and_ideal_adds_nothing() -> None:
    ideal = scenario_of(BASE)
    assert ideal.environment.wind is None
    assert ideal.aircraft.deviation is None
    assert ideal.navigation.kind == "perfect"
    more = (
        "environment: {wind: {speed_mps: 2, from_deg: 10}, turbulence: {intensity: none}}\n"
        "navigation: {kind: rtk}\nuncertainty: {mass: 0}\n"
        "aircraft: {actuators: {lag_s: 0.2}, deviation: {drag: 0.3}}\n"
    )
    (given,) = drawn("rough", 1, more)
    wind, deviation = section(given, "environment.wind"), section(given, "aircraft.deviation")
    assert (wind.speed_mps, wind.changes) == (2.0, ())
    assert given.environment.gusts is None
    assert given.environment.vertical_gusts is not None
    assert given.navigation.position_sigma_m == 0.017
    assert section(given, "aircraft.actuators.lag_s") == 0.2
    assert (deviation.mass, deviation.drag) == (0.0, 0.3)


@pytest.mark.flights
def test_what_a_section_leaves_out_is_the_days() -> None:
    """The figures are those of the table in `aircraft/README.md`."""
    more = (
        "environment: {turbulence: {model: milspec}, wind: {KEY: 3}}\nnavigation: {position_sigma_m: 3}\n"
        "aircraft: {actuators: {deadband_deg: 2}}\n"
    )
    (plain,), (given,) = drawn("typical", 1), drawn("typical", 1, more.replace("KEY", "speed_mps"))
    assert section(given, "environment.turbulence") == Turbulence(model="milspec", intensity="light")
    servos, seen = section(given, "aircraft.actuators"), given.navigation
    assert (servos.lag_s, servos.rate_limit_degps, servos.deadband_deg) == (0.03, 300.0, 2.0)
    assert (seen.kind, seen.position_sigma_m, seen.altitude_sigma_m) == ("gnss", 3.0, 2.1)
    from_deg = section(plain, "environment.wind.from_deg")
    assert section(given, "environment.wind") == Wind(speed_mps=3, from_deg=from_deg)
    (turned,) = drawn("typical", 1, more.replace("KEY", "from_deg"))
    wind, day = section(turned, "environment.wind"), section(plain, "environment.wind")
    assert (wind.speed_mps, wind.from_deg, wind.measured_at_m) == (day.speed_mps, 3.0, 10.0)
    for (_, speed, towards), (_, same, other) in zip(wind.changes, day.changes, strict=True):
        assert speed == same
        assert (towards - 3.0 - other + day.from_deg + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.03)
    assert scenario_of(wayproof.dump_scenario(turned)) == turned


def test_an_ideal_day_is_told_with_what_the_scenario_adds_to_it() -> None:
    air = "environment: {wind: {speed_mps: 6, from_deg: 270}, turbulence: {intensity: moderate}}\n"
    (calm,), (given,) = drawn("ideal", 1), drawn("ideal", 1, air + "aircraft: {actuators: {lag_s: 0.1}}")
    assert conditions_text(calm) == "ideal: calm, state known exactly"
    told = "the scenario sets: wind 6 m/s from 270 deg, moderate turbulence, servos"
    assert conditions_text(given) == f"ideal, but for what {told}"


def test_a_run_folders_scenario_has_the_day_resolved_and_flies_again_alike(tmp_path: Path) -> None:
    (day,) = drawn("typical", 1, "uncertainty: {thrust: 0.2}")
    first = wayproof.fly(day, out=tmp_path / "first")
    assert wayproof.fly(str(tmp_path / "first" / "scenario.yaml")).digest == first.digest
    assert wayproof.fly(day.with_({"conditions": "ideal"})).digest != first.digest
    for drawn_key in ("measured_at_m", "vertical_gusts", "deviation", "rate_limit_degps"):
        assert drawn_key in (tmp_path / "first" / "scenario.yaml").read_text("utf-8")


def test_the_wind_changes_in_time_as_told() -> None:
    wind = "wind: {speed_mps: 4, from_deg: 270, changes: [[20, 8, 270], [40, 8, 180]]}"
    flown = wayproof.fly(scenario_of(f"{BASE}environment: {{{wind}}}"))
    track = {name: flown.track[name].to_numpy() for name in flown.track.column_names}
    heading, course = np.radians(track["heading_deg"]), np.radians(track["course_deg"])
    level = np.cos(np.radians(track["pitch_deg"]))  # of the airspeed; the rest is sideslip and climb
    air = track["airspeed_mps"] * level * np.array([np.sin(heading), np.cos(heading)])
    wind_mps = track["groundspeed_mps"] * np.array([np.sin(course), np.cos(course)]) - air
    for time_s, expected in ((5.0, (5.0, 0.0)), (15.0, (7.0, 0.0)), (30.0, (4.0, 4.0)), (60.0, (0.0, 8.0))):
        near = np.abs(track["time_s"] - time_s) < 1.0
        assert wind_mps[:, near].mean(axis=1) == pytest.approx(expected, abs=0.4), time_s


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ("conditions: mild", "conditions: is the text 'mild'; must be"),
        ("uncertainty: {mass: -0.1}", "uncertainty.mass: is -0.1; must be at least 0"),
        ("uncertainty: {weight: 0.1}", "uncertainty.weight"),
        ("environment: {wind: {changes: [[9, 1, 0], [9, 2, 0]]}}", "environment.wind.changes[1]: is at 9 s"),
    ],
)
def test_wrong_keys_are_told_with_their_path(more: str, told: str) -> None:
    with pytest.raises(wayproof.InputError, match=r"line \d|:\d") as caught:
        scenario_of(BASE + more, "day.yaml")
    assert told in str(caught.value)
