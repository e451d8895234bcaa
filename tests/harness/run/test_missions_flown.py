"""Missions flown as their files have them: each waypoint on each lap, by its own acceptance radius, and loiters."""

import math
from pathlib import Path

import numpy as np
import pytest

import wayproof
from harness.cli.flight_rows import verdict_rows
from harness.run.path_check import prepare_check
from harness.run_files.path_files import read_path
from harness.scenario.environment import GroundSpec
from harness.world_files.height_field import HeightField
from tests.harness.run.given import Array, item, waypoints_file

SQUARE = [(0.0, 0.0), (0.0, 600.0), (600.0, 600.0), (600.0, 0.0)]


def flown(path: Path, law: str = "preview", follow: str = "waypoints") -> tuple[wayproof.FlightResult, Array]:
    run = wayproof.check(path, settings={"guidance.kind": law, "guidance.follow": follow})
    return run, np.column_stack((run.track["east_m"], run.track["north_m"]))


def minima(distances_m: Array) -> list[float]:
    """The local minima below 100 m, and the ends if they are."""
    padded = np.concatenate(([np.inf], distances_m, [np.inf]))
    low = (padded[1:-1] < padded[:-2]) & (padded[1:-1] <= padded[2:]) & (distances_m < 100.0)
    return [float(each) for each in distances_m[low]]


def test_a_square_flown_in_laps_keeps_its_corner_at_the_start_on_every_lap(tmp_path: Path) -> None:
    places = [*SQUARE * 5, (0.0, 0.0)]
    run, track = flown(waypoints_file(tmp_path, places))
    assert [each["what"] for each in run.metrics.to_dict()["check"]["items"]] == ["flown"] * 21
    for place in SQUARE:
        passes = minima(np.hypot(*(track - place).T))
        assert len(passes) == places.count(place)
        assert max(passes) < 60.0
    assert run.metrics.to_dict()["check"]["ok"]


@pytest.mark.parametrize("at_m", [(100.0, 100.0, 0.0), (-250.0, 100.0, 0.0), (-250.0, -250.0, 30.0)])
def test_corners_are_rounded_in_the_wind_at_their_height(at_m: tuple[float, ...], tmp_path: Path) -> None:
    """The wind grows with the logarithm of the height over 0.15 ft, up to 1000 ft (MIL-F-8785C)."""
    first_m, up_m, ground_m = at_m
    items = [item(n, *at, up_m if n > 1 else first_m, params=(0.0, 40.0)) for n, at in enumerate(SQUARE, 1)]
    given = read_path(waypoints_file(tmp_path, [], more=items))
    field = HeightField((-5000.0, -5000.0), (5000.0, 5000.0), np.full((3, 3), ground_m))
    ground = GroundSpec.of(field).model_dump_json(exclude_none=True)
    roughness_m, height_m = 0.15 * 0.3048, min(300.0 + up_m - ground_m, 304.8)
    there_mps = 6.0 * math.log(height_m / roughness_m) / math.log(10.0 / roughness_m)
    radii = []
    for wind in ("speed_mps: 6.0, measured_at_m: 10", f"speed_mps: {there_mps!r}"):
        check = prepare_check(given, [("environment.wind", f"{{{wind}, from_deg: 225}}"), ("ground", ground)])
        radii.append([corner.radius_m for corner in check.plan.way.corners])
    assert len(radii[0]) == 2
    assert radii[0] == pytest.approx(radii[1], rel=1e-9)


@pytest.mark.parametrize("law", ["preview", "l1"])
@pytest.mark.parametrize("turn_deg", [30.0, 89.0, 90.000001, 91.0, 150.0, 180.0])
def test_a_waypoint_is_flown_to_by_its_own_acceptance_radius_whatever_the_turn(
    turn_deg: float, law: str, tmp_path: Path
) -> None:
    """With 10 m the aircraft, at 2.5 m a row, comes within that of the waypoint and no nearer than it has to."""
    turn = math.radians(turn_deg)
    places = [(0.0, 0.0), (0.0, 900.0), (900.0 * math.sin(turn), 900.0 + 900.0 * math.cos(turn))]
    run, track = flown(waypoints_file(tmp_path, places, acceptance_m=10.0), law)
    begins = int(np.flatnonzero(np.abs(np.array(run.track["roll_command_deg"])) > 5.0)[0])
    assert 4.0 < 900.0 - track[begins, 1] <= 10.0  # where it leaves the first leg
    assert (np.hypot(*(track - places[1]).T).min() <= 10.0, run.outcome) == (True, "reached")


@pytest.mark.parametrize(("law", "heads_for_centre"), [("npfg", True), ("l1", True), ("preview", False)])
def test_a_loiter_is_joined_as_the_laws_autopilot_does_and_gone_round_as_often_as_its_item_says(
    law: str, heads_for_centre: bool, tmp_path: Path
) -> None:
    center, radius = np.array((0.0, 2500.0)), 150.0
    loiter = item(3, 0.0, 2500.0, up_m=0.0, command=18, params=(2, 0, radius))
    last = item(4, 2000.0, 2500.0, up_m=0.0)
    run, track = flown(waypoints_file(tmp_path, [(0.0, 0.0), (0.0, 800.0)], more=[loiter, last]), law)
    off = track - center
    left_m = np.hypot(*off.T) - radius
    coming = slice(int(np.argmax(left_m < 1400.0)), int(np.argmax(left_m < 20.0)))
    above_m = np.array(run.track["up_m"])[coming] - run.track["up_m"][-1].as_py()
    assert np.abs(above_m - left_m[coming] / 15.5).max() < 7.0  # 100 m down in 1550 m to the circle, evenly
    near = left_m < 0.2 * radius
    straight = (track[:, 1] > 1000.0) & (track[:, 1] < center[1] - 3.2 * radius) & (track[:, 0] < radius)
    straight &= np.arange(len(track)) < np.flatnonzero(near)[0]
    # On the line to the centre, or on the tangent that begins at (0, 800) and touches the circle, flown clockwise.
    touch = math.asin(radius / (center[1] - 800.0))
    wanted = 0.0 if heads_for_centre else -np.tan(touch) * (track[straight, 1] - 800.0)
    assert np.abs(track[straight, 0] - wanted).max() < 3.0
    angle = np.unwrap(np.arctan2(off[near, 1], off[near, 0]))
    assert 2.0 < (angle[0] - angle[-1]) / math.tau < 3.0
    assert any(("heads for its centre" if heads_for_centre else "along a tangent") in each for each in notes(run))
    assert run.metrics.to_dict()["check"]["ok"]


@pytest.mark.parametrize("law", ["npfg", "l1", "preview"])
def test_a_flight_ends_on_the_circle_of_a_last_loiter_once_gone_round_it(law: str, tmp_path: Path) -> None:
    """2 pi 100 m at 25 m/s are 25 s a turn; the way to the circle takes less than 900 m / 25 m/s = 36 s."""
    more = [item(2, 0.0, 900.0, command=18, params=(1, 0, 100.0))]
    run, track = flown(waypoints_file(tmp_path, [(0.0, 0.0)], more=more), law)
    off = track - (0.0, 900.0)
    near = np.hypot(*off.T) < 120.0
    assert 0.9 < abs(np.diff(np.unwrap(np.arctan2(off[near, 1], off[near, 0]))).sum()) / math.tau < 1.3
    assert (run.outcome, len(track) < 10 * 65) == ("reached", True)
    assert run.metrics.to_dict()["check"]["ok"]


@pytest.mark.parametrize("law", ["npfg", "l1", "preview"])
def test_a_loiter_tighter_than_the_aircraft_turns_is_no_whoever_flies(law: str, tmp_path: Path) -> None:
    """At 25 m/s the bank limit of 45 deg gives 63.7 m: more than 10 m off a circle of 20 m."""
    more = [item(2, 0.0, 900.0, command=18, params=(1, 0, 20.0)), item(3, 0.0, 1800.0)]
    run, _ = flown(waypoints_file(tmp_path, [(0.0, 0.0)], more=more), law)
    check = run.metrics.to_dict()["check"]
    assert (check["ok"], check["worst"]["allowed_m"]) == (False, 10.0)


def test_a_corner_that_is_passed_again_has_a_row_each_time(tmp_path: Path) -> None:
    more = [item(4, 0.0, 0.0, command=177, params=(2, 1)), item(5, 900.0, 900.0)]
    run, _ = flown(waypoints_file(tmp_path, [(0.0, 0.0), (0.0, 900.0), (0.0, 0.0)], more=more))
    rows = verdict_rows(run.metrics.to_dict())
    assert [name.split() for name, told in rows.items() if " deg " in told] == [
        *(["item", "2"], ["item", "3"], ["item", "2"], ["item", "3"])
    ]


def notes(run: wayproof.FlightResult) -> list[str]:
    every: list[str] = run.metrics.to_dict()["check"]["notes"]
    return every


def test_another_altitude_at_the_same_place_is_climbed_to_on_the_way_on() -> None:
    """30 m, for which the aircraft has 1.5 km; a step would be three times what it may be off."""
    drawn = wayproof.check([(0, 0, 300), (0, 1000, 300), (0, 1000, 330), (0, 3000, 330)])
    up = np.array(drawn.track["up_m"])
    assert (np.diff(up).max() / 0.1 < 8.0, up[-1]) == (True, pytest.approx(330.0, abs=2.0))
    assert drawn.metrics.to_dict()["check"]["ok"]
    step = [(0, 0, 300), (0, 500, 300), (0, 501, 300.9), (0, 999, 300.9)]  # where 0.5 m are allowed
    assert not wayproof.check(step, settings={"trackability.altitude_m": "0.5"}).metrics.check.ok


@pytest.mark.parametrize(
    ("first", "law", "follow"),
    [
        (True, "preview", "path"),
        (False, "preview", "path"),
        (False, "npfg", "path"),
        (True, "npfg", "waypoints"),
    ],
)
def test_a_speed_item_is_reached_by_the_same_ramp_wherever_it_stands(
    first: bool, law: str, follow: str, tmp_path: Path
) -> None:
    """From 25 to 32 m/s at 2 % a second: ln(32 / 25) / 0.02 = 12 s; also under a law that asks for airspeeds itself."""
    faster = "\t".join(map(str, (9, 0, 3, 178, 0, 32, -1, 0, 0, 0, 0, 1)))
    legs = [item(2, 0.0, 1000.0), item(3, 0.0, 4000.0)]
    path = waypoints_file(tmp_path, [], more=[*([faster] if first else []), item(1, 0.0, 0.0), legs[0]])
    path.write_text(path.read_text() + ("" if first else faster + "\n") + legs[1] + "\n")
    run, track = flown(path, law, follow)
    speed, time = np.array(run.track["airspeed_mps"]), np.array(run.track["time_s"])
    reached = float(time[speed > 31.5][0]) - (0.0 if first else float(time[track[:, 1] < 1000.0][-1]))
    assert speed[0] == pytest.approx(25.0, abs=0.1)
    assert 10.0 < reached < 20.0
    assert run.metrics.to_dict()["check"]["ok"]


@pytest.mark.parametrize("airspeed_mps", [17.0, 22.0])
def test_the_airspeed_that_a_law_asks_for_in_wind_is_the_commanded_one(airspeed_mps: float) -> None:
    """Against 15.2 m/s npfg asks for 5 m/s more, PX4's FW_GND_SPD_MIN, or for the mission's speed if that is more."""
    settings = {"guidance.kind": "npfg"}
    line = [(0.0, 0.0), (0.0, 900.0)]
    run = wayproof.check(line, "ultrastick25e", airspeed_mps=airspeed_mps, wind=(15.2, 0), settings=settings)
    speed = np.array(run.track["airspeed_mps"])
    assert speed[-100:].mean() == pytest.approx(max(20.2, airspeed_mps), abs=0.1)
    assert [leg["cause"] for leg in run.metrics.to_dict()["trackability"]] == [None]


SLOW = Path(__file__).parents[3].parent / "shared" / "real" / "missions" / "ardupilot_ap1.txt"


@pytest.mark.skipif(not SLOW.is_file(), reason="no shared/real beside the checkout")
@pytest.mark.parametrize("law", ["preview", "npfg"])
def test_a_speed_that_the_aircraft_does_not_hold_is_the_cause_in_turns_too(law: str) -> None:
    """ArduPilot's own mission asks for 13 m/s, where the Aerosonde flies level from 17.4 m/s on."""
    run, _ = flown(SLOW, law)
    slow = [leg["cause"] for leg in run.metrics.to_dict()["trackability"] if leg["max_airspeed_error_mps"] > 2.5]
    assert slow == ["speed or throttle saturation"] * 3
