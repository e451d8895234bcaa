"""The verdict on given paths, held against distances that numpy finds between the flown track and the drawn line."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

import wayproof
from harness.files.wording import metres
from tests.harness.run.given import item, off_polyline_m, waypoints_file

SQUARE = [(0.0, 0.0), (0.0, 600.0), (600.0, 600.0), (600.0, 0.0), (0.0, 0.0)]
SQUARE_CORNER = [(0.0, 0.0), (0.0, 1200.0), (1200.0, 1200.0)]
LEAST_M = 25.0**2 / (9.80665 * math.tan(math.radians(45.0)))
CUT = math.sqrt(2.0) - 1.0
BY_WAYPOINTS = {"guidance.follow": "waypoints"}


def flown(path: Any, **options: Any) -> tuple[dict[str, Any], np.ndarray[Any, Any]]:
    """The metrics, and (n, 2) the flown track."""
    run = wayproof.check(path, **options)
    return run.metrics.to_dict(), np.column_stack((run.track["east_m"], run.track["north_m"]))


@pytest.mark.parametrize(
    ("written", "wanted_m", "limit_m"),
    [("", None, 10.0), ("", 50, 5.0), ("", 5000, 500.0), ("planner: {clearance_m: 300}", None, 30.0),
     ("planner: {clearance_m: 300}\nnavigation: {kind: rtk}", 50, 5.0),
     ("trackability: {cross_track_m: 4, load_factor: 2}", 50, 4.0)],
)  # fmt: skip
def test_what_a_run_folder_has_filled_in_does_not_count_as_written(
    written: str, wanted_m: float | None, limit_m: float, tmp_path: Path
) -> None:
    """A tenth of the clearance that world or check name, however wide, else 10 m; load factors are up to 3.8."""
    world = tmp_path / "world.yaml"
    world.write_text(
        "schema: wayproof/scenario/1\nname: world\narea: {bounds_m: [-1000, -1000, 9000, 6000]}\n"
        f"mission: {{start_m: [0, 0], goal_m: [7500, 0], time_limit_s: 1}}\n{written}\n"
    )
    wayproof.fly(world, out=tmp_path / "run")
    settings = {} if wanted_m is None else {"planner.clearance_m": str(wanted_m)}
    for scenario in (world, tmp_path / "run" / "scenario.yaml", wayproof.load_run(tmp_path / "run").scenario):
        run = wayproof.check([(0.0, 0.0), (300.0, 0.0)], scenario=scenario, settings=settings)
        assert {leg.threshold_m for leg in run.metrics.trackability} == {limit_m}
        assert run.scenario.trackability.load_factor == (2.0 if "load" in written else 3.8)
        assert run.scenario.navigation.kind == ("rtk" if "rtk" in written else "perfect")


@pytest.mark.parametrize("law", ["preview", "l1", "npfg"])
def test_a_missions_corners_have_one_limit_whoever_flies(law: str, tmp_path: Path) -> None:
    """Limits of 10 m and, at corners, 90 m: what each law is off is measured to the four legs."""
    metrics, track = flown(waypoints_file(tmp_path, SQUARE), settings={**BY_WAYPOINTS, "guidance.kind": law})
    assert {leg["threshold_m"] for leg in metrics["trackability"]} == {10.0}
    corners = metrics["check"]["corners"]
    assert [corner["waypoint"] for corner in corners] == [2, 3, 4]
    assert {corner["allowed_cut_m"] for corner in corners} == {90.0}
    for corner, place in zip(corners, SQUARE[1:4], strict=True):
        away = np.hypot(*(track - place).T)
        worst = max(away.min(), off_polyline_m(track[away < 200.0], SQUARE).max())
        assert corner["most_off_m"] == pytest.approx(worst, abs=2.6)  # rows are 2.5 m apart
        assert corner["kept"] == (worst <= 90.0)
    legs = np.min([np.hypot(*(track - place).T) for place in SQUARE[1:4]], axis=0) > 280.0
    assert metrics["check"]["ok"] is bool(off_polyline_m(track[legs], SQUARE).max() <= 10.0)
    assert metrics["total_system_error_m"]["max"] == pytest.approx(off_polyline_m(track, SQUARE).max(), abs=1.5)


@pytest.mark.parametrize(
    ("tolerance_m", "radius_m", "ok", "mps"),
    [(35.0, 0.9 * 35.0 / CUT, True, 25), (27.0, LEAST_M, True, 25), (10.0, LEAST_M, False, 25),
     (40.0, 18.0**2 / (9.80665 * np.tan(np.radians(22.0))), True, 18)],
)  # fmt: skip
def test_a_corner_is_rounded_as_the_aircraft_can_turn(
    tolerance_m: float, radius_m: float, ok: bool, mps: float
) -> None:
    """An arc of R cuts a right angle by (sqrt 2 - 1) R: by 0.9 of the limit, or by 26 m at the bank limit of 45 deg.

    At 18 m/s 0.6 of it would take 29 degrees of bank; 22 are planned with: flown, 25 keep the altitude, 27 do not.
    """
    metrics, track = flown(SQUARE_CORNER, tolerance_m=tolerance_m, airspeed_mps=mps)
    (corner,) = metrics["check"]["corners"]
    assert corner["radius_m"] == pytest.approx(radius_m, rel=0.005)
    assert corner["cut_m"] == pytest.approx(CUT * corner["radius_m"])
    assert corner["most_off_m"] == pytest.approx(np.hypot(*(track - SQUARE_CORNER[1]).T).min(), abs=0.1)
    assert metrics["check"]["ok"] is ok


@pytest.mark.parametrize(("corner_m", "ok"), [(3.0, False), (6.0, True)])
def test_a_corners_limit_holds_where_the_path_may_be_off_by_more(corner_m: float, ok: bool) -> None:
    """45 deg are cut by 5.3 m at the bank limit, LEAST_M (1 / cos 22.5 deg - 1), and 30 m are allowed elsewhere.

    How far off the corner is passed does not depend on where the rows are, 2.5 m apart.
    """
    path = [(0.0, 0.0), (3001.3, 0.0), (5122.3, 2121.0)]
    metrics, track = flown(path, tolerance_m=30.0, corner_m=corner_m)
    (corner,), nearest_m = (
        metrics["check"]["corners"],
        shapely.LineString(track).distance(shapely.Point(path[1])),
    )
    assert corner["flown_cut_m"] == pytest.approx(nearest_m, abs=1e-3)
    assert (nearest_m <= corner_m) is ok
    assert metrics["check"]["ok"] is ok


@pytest.mark.parametrize(
    ("aircraft", "corner_m", "path"),
    [("aerosonde", 60.0, [(0, 0), (80, 0), (38.9, 598.6), (114.9, 642.9), (-113.7, 1087.6), (-128.1, 1091.7)]),
     ("ultrastick25e", 40.0, [(0, 0), (600, 0), (664.4, 128.8), (940.1, -288.3), (982.9, -258), (1210.6, -703.2)])],
)  # fmt: skip
def test_short_legs_are_flown_as_near_as_the_aircraft_can(
    aircraft: str, corner_m: float, path: list[tuple[float, float]]
) -> None:
    """Legs of 50 to 90 m between turns to the right and left; shapely finds how far the track is off them."""
    metrics, track = flown(path, aircraft=aircraft, corner_m=corner_m)
    assert metrics["check"]["ok"], metrics["check"]["verdict"]
    dense, line = (shapely.segmentize(shapely.LineString(each), 2.0) for each in (track, path))
    most_m = metrics["deviation_from_given_m"]["max"]
    assert most_m == pytest.approx(shapely.frechet_distance(dense, line), abs=1.5)


def test_a_corner_that_is_cut_is_not_called_a_navigation_error() -> None:
    """Positions are right to centimetres: the belief is as far off the corner, (sqrt 2 - 1) of the least radius."""
    metrics, _ = flown(SQUARE_CORNER, corner_m=20.0, settings={"navigation.kind": "rtk"})
    assert metrics["trackability"][0]["cause"] == "turn radius too tight"
    assert metrics["check"]["worst"]["off_m"] == pytest.approx((math.sqrt(2.0) - 1.0) * LEAST_M, abs=4.0)


def test_a_law_that_overshoots_a_wide_corner_is_not_told_that_the_turn_is_too_tight(tmp_path: Path) -> None:
    """Passed at up to 60 m, a right angle has room for an arc of 60 / (sqrt 2 - 1) = 145 m: another law flies it."""
    path = waypoints_file(tmp_path, [(0, 0), (0, 800), (800, 800), (800, 0)], acceptance_m=60.0)
    told = {law: flown(path, settings={**BY_WAYPOINTS, "guidance.kind": law})[0] for law in ("bearing", "preview")}
    assert told["preview"]["check"]["ok"]
    causes = [leg["cause"] for leg in told["bearing"]["trackability"] if not leg["trackable"]]
    assert causes == ["tracking error", "tracking error"]


@pytest.mark.parametrize(("from_deg", "least", "cause"), [(45.0, 0.46, "tracking error"), (225.0, 1.96, "wind drift")])
def test_a_wind_is_the_cause_at_a_corner_only_where_it_widens_the_turn(
    from_deg: float, least: float, cause: str, tmp_path: Path
) -> None:
    """From north to east against 10 m/s, at most sqrt(25^2 - 50) - 7.1 = 16.9 m/s over the ground, and with it 35 m/s.

    A right angle that may be passed at 30 m has room for an arc of 72 m: for 63.7 m times the square of that over 25.
    """
    assert (LEAST_M * least > 30.0 / (math.sqrt(2.0) - 1.0)) is (cause == "wind drift")
    path = waypoints_file(tmp_path, [(0.0, 0.0), (0.0, 1000.0), (1000.0, 1000.0)], acceptance_m=5.0)
    settings = {**BY_WAYPOINTS, "guidance.kind": "l1"}
    metrics, _ = flown(path, wind=(10.0, from_deg), corner_m=30.0, settings=settings)
    assert {leg["cause"] for leg in metrics["trackability"]} == {cause}


@pytest.mark.parametrize(
    ("turn_deg", "limit_m", "wind", "cause"),
    [(-90, 45.0, (8, 90), None), (135, 90.0, (0, 0), None), (150, 104.0, (10, 270), "wind drift"),
        (135, 73.0, (10, 0), None), (135, 80.0, (7.5, 270), "wind drift")],
)  # fmt: skip
def test_a_corner_is_kept_where_the_aircraft_can_and_only_a_wind_that_prevents_it_is_the_cause(
    turn_deg: int, limit_m: float, wind: tuple[float, float], cause: str | None
) -> None:
    """63.7 m inside 135 degrees are 103 m off, past and back 64; 63.7 (33 / 25)^2 m, 8 m/s behind, 46 at 90 degrees."""
    turn = math.radians(turn_deg)
    line = [(0.0, 0.0), (0.0, 2000.0), (2000.0 * math.sin(turn), 2000.0 + 2000.0 * math.cos(turn))]
    metrics, track = flown(line, corner_m=limit_m, wind=wind)
    assert {leg["cause"] for leg in metrics["trackability"]} == {None, cause}
    off_m = max(np.hypot(*(track - line[1]).T).min(), off_polyline_m(track, line).max())
    assert metrics["check"]["ok"] == (off_m <= limit_m) == (cause is None)


@pytest.mark.parametrize(("bias_m", "north_m"), [([0, 60], -60.0), ([60, 0], 0.0)])
def test_a_path_is_flown_beside_where_it_is_by_a_wrong_position(bias_m: list[int], north_m: float) -> None:
    """The believed position is 60 m north of the true one: the path is flown so far south of it; or ahead: as drawn."""
    settings = {"navigation": f"{{kind: rtk, position_bias_m: {bias_m}}}"}
    metrics, track = flown([(0.0, 0.0), (1500.0, 0.0)], settings=settings)
    assert np.median(track[:, 1]) == pytest.approx(north_m, abs=1.0)
    cause = "navigation error" if north_m else None
    assert (metrics["outcome"], metrics["trackability"][0]["cause"]) == ("reached", cause)
    for error in ("total_system_error_m", "deviation_from_given_m"):
        assert metrics[error]["max"] == pytest.approx(np.abs(track[:, 1]).max(), abs=0.01)


def test_a_path_is_given_the_time_that_a_wind_takes_which_rises_on_the_way() -> None:
    """A headwind of 20 m/s is there after 10 s and 150 m; the other 1850 m are made good at 5 m/s."""
    wind = {"speed_mps": 0, "from_deg": 90, "changes": [[10, 20, 90]]}
    metrics, _ = flown([(0.0, 0.0), (2000.0, 0.0)], settings={"environment.wind": wind})
    assert (metrics["outcome"], metrics["check"]["ok"]) == ("reached", True)
    assert metrics["flight_time_s"] == pytest.approx(10.0 + 1850.0 / 5.0, rel=0.03)


def test_an_airspeed_that_is_measured_wrong_is_an_error_of_navigation() -> None:
    """Level, with the throttle between its stops, an aircraft keeps the airspeed that it measures at 25 m/s."""
    settings = {"navigation": "{kind: rtk, airspeed_sigma_mps: 1.5}", "seed": "3"}
    run = wayproof.check([(0.0, 0.0), (2500.0, 0.0)], airspeed_mps=25.0, settings=settings)
    throttle, airspeed = (run.track[name].to_numpy()[-200:] for name in ("throttle", "airspeed_mps"))
    assert 0.05 < throttle.min() < throttle.max() < 0.95
    assert 2.0 < airspeed.mean() - 25.0 < 4.5  # the limit, and three sigmas
    leg = run.metrics.to_dict()["trackability"][0]
    assert (leg["trackable"], leg["cause"]) == (False, "navigation error")


def test_a_circle_tighter_than_the_bank_limit_gives_is_no_and_a_near_yes_can_be_seen() -> None:
    """60 m at 25 m/s, where the bank limit of 45 deg gives 63.7 m."""
    angle = np.linspace(0.0, math.tau, 200)
    circle = 60.0 * np.column_stack((np.cos(angle), np.sin(angle)))
    path = np.concatenate(([(60.0, -1000.0)], circle, [(60.0, 1000.0)]))
    metrics, track = flown(path, tolerance_m=5.0)
    wide = np.abs(np.hypot(*track[(np.abs(track[:, 1]) < 70.0) & (track[:, 0] < 0.0)].T) - 60.0).max()
    assert (metrics["check"]["ok"], metrics["trackability"][0]["cause"]) == (False, "turn radius too tight")
    most = metrics["check"]["worst"]["off_m"]
    assert 5.0 < wide < min(most + 0.5, 12.0)
    near, _ = flown(path, settings={"trackability.cross_track_m": str(most * 1.02)})
    assert near["check"]["limit_used"]["off_path"] == pytest.approx(1.0 / 1.02, abs=0.01)
    assert f"; {near['check']['limit_used']['off_path']:.0%} of a limit used" in near["check"]["verdict"]
    assert near["check"]["limit_used"]["bank"] == pytest.approx(25.0**2 / (9.80665 * 60.0), rel=0.01)
    assert near["check"]["verdict"].endswith("needs more than 45 deg of bank was flown on a larger radius")
    assert (metres(2.2312, 2.2298), metres(2.2298, 2.2312)) == ("2.231 m", "2.23 m")


def test_what_lies_beyond_a_corner_counts_and_a_no_names_the_limit_that_would_do(tmp_path: Path) -> None:
    """The file lets its waypoints be passed at 10 m; the aircraft turns on to the next leg too late for that."""
    path = waypoints_file(tmp_path, SQUARE[:3], acceptance_m=10.0)
    settings = {**BY_WAYPOINTS, "guidance.acceptance_radius_m": "10"}
    metrics, track = flown(path, settings=settings)
    (corner,) = metrics["check"]["corners"]
    beyond = float(track[:, 1].max()) - 600.0  # past the corner, to the north of the leg that leads east
    assert beyond > 30.0
    assert corner["most_off_m"] == pytest.approx(beyond, abs=1.0)
    assert (corner["allowed_cut_m"], corner["kept"], metrics["check"]["ok"]) == (10.0, False, False)
    enough = metrics["check"]["corner_m_that_would_do"]
    assert f"--corner-m {enough:g} would be yes" in metrics["check"]["verdict"]
    assert enough == math.ceil(corner["most_off_m"])
    for limit_m, ok in ((enough, True), (enough - 2.0, False)):
        again, _ = flown(path, settings=settings, corner_m=limit_m)
        assert (again["check"]["ok"], again["check"]["corners"][0]["allowed_cut_m"]) == (ok, limit_m)
    worst = metrics["check"]["worst"]
    place = (worst["east_m"], worst["north_m"])
    assert worst["off_m"] == pytest.approx(off_polyline_m(np.array([place]), SQUARE[:3])[0], abs=0.5)


def test_where_limits_of_two_corners_meet_the_smaller_one_counts_and_has_its_cause(tmp_path: Path) -> None:
    """The first, 15 m, needs a turn of 15 m / (sqrt 2 - 1) < LEAST_M; the limit of the next, 300 m, reaches there."""
    places = [(1500.0, 0.0, 15.0), (1500.0, 500.0, 300.0), (3500.0, 500.0, 0.0)]
    items = [item(n, x, y, params=(0.0, limit_m)) for n, (x, y, limit_m) in enumerate(places, start=2)]
    metrics, track = flown(waypoints_file(tmp_path, [(0.0, 0.0)], more=items))
    off_m = shapely.LineString(track).distance(shapely.Point(places[0][:2]))
    assert metrics["check"]["limit_used"]["off_path"] == pytest.approx(off_m / 15.0, rel=0.01)
    assert (metrics["check"]["worst"]["waypoint"], metrics["check"]["worst"]["allowed_m"]) == (2, 15.0)
    assert [leg["cause"] for leg in metrics["trackability"]] == ["turn radius too tight", None, None]


@pytest.mark.parametrize(("up_m", "promise"), [(0.0, "be yes"), (600.0, "do for the corners alone")])
def test_a_corner_limit_is_called_a_yes_where_nothing_else_is_wrong(up_m: float, promise: str) -> None:
    """No aerosonde climbs 600 m on 2.4 km, whatever the corner's limit."""
    path = [(*place, 300.0 + up_m * n / 2) for n, place in enumerate(SQUARE_CORNER)]
    metrics, _ = flown(path)
    limit_m = metrics["check"]["corner_m_that_would_do"]
    assert f"--corner-m {limit_m:g} would {promise}" in metrics["check"]["verdict"]
    assert flown(path, corner_m=limit_m)[0]["check"]["ok"] is (up_m == 0.0)


CROOKED = [(0.0, 0), (-126.89, 404.85), (271.09, 426.46), (427.19, 307.03), (513.05, 644.98), (746.6, 848.51)]


@pytest.mark.parametrize("law", ["preview", "l1", "pure_pursuit", "late"])
def test_the_corner_limit_that_is_told_is_a_yes_once_it_is_given(law: str, tmp_path: Path) -> None:
    """Rounded for another limit, a corner is passed otherwise; L1 and a 737 keep corners, and are off beyond them."""
    path: Any = SQUARE_CORNER
    options: dict[str, Any] = {"settings": {"guidance.kind": law}}
    if law == "late":
        path, options = [(0.0, 0.0), (12000.0, 0.0), (26672.0, -3119.0)], {"aircraft": "737"}
    if law == "preview":
        path, options = [*CROOKED, (573.29, 1175.36)], {"aircraft": "ultrastick25e"}
    if law == "l1":
        path = waypoints_file(tmp_path, SQUARE[:3], acceptance_m=60.0)
        options["settings"] |= BY_WAYPOINTS
    metrics, _ = flown(path, **options)
    limit_m = metrics["check"]["corner_m_that_would_do"]
    assert metrics["check"]["verdict"].endswith(f"; --corner-m {limit_m:g} would be yes")
    assert flown(path, corner_m=limit_m, **options)[0]["check"]["ok"]


def rounded_corner(radius_m: float) -> np.ndarray[Any, Any]:
    """900 m north, an arc to the right, 900 m east."""
    angle = np.linspace(0.0, 0.5 * math.pi, round(0.4 * radius_m))
    arc = np.column_stack((radius_m * (1.0 - np.cos(angle)), 900.0 + radius_m * np.sin(angle)))
    return np.concatenate(([(0.0, 0.0)], arc, [(radius_m + 900.0, 900.0 + radius_m)]))


@pytest.mark.parametrize(("radius_m", "told"), [(150.0, "31 of 45"), (110.0, "40 of 45")])
def test_a_yes_says_what_bank_the_turns_take_in_the_wind(radius_m: float, told: str) -> None:
    """Downwind an arc takes (V + W)^2 / (g R) of lateral acceleration, over tan 45 deg."""
    metrics, _ = flown(rounded_corner(radius_m), wind=(5.0, 225.0))
    assert metrics["check"]["limit_used"]["bank"] == pytest.approx(30.0**2 / (9.80665 * radius_m), rel=0.02)
    assert metrics["check"]["verdict"].endswith(f", turns take {told} deg of bank")


@pytest.mark.parametrize("turn_deg", [30.0, 50.0])
def test_a_kink_before_a_sampled_curve_is_rounded_as_any_corner(turn_deg: float) -> None:
    """A circle of 63.7 m (25 m/s, 45 deg) that touches the line and, from within, the circle of 150 m cuts the kink.

    Its centre is 63.7 m beside the line and 150 - 63.7 m from that of the other. Of points 3 m apart none has room.
    """
    least, wide, turn = 25.0**2 / 9.80665, 150.0, math.radians(turn_deg)
    east = math.sqrt((wide - least) ** 2 - (wide * math.cos(turn) - least) ** 2) - wide * math.sin(turn)
    cut_m = math.hypot(east, least) - least
    angle = turn + np.linspace(0.0, 2.0, 100)
    arc = wide * np.column_stack((np.sin(angle) - math.sin(turn), math.cos(turn) - np.cos(angle)))
    metrics, track = flown(np.concatenate(([(-400.0, 0.0)], arc)))
    assert metrics["check"]["ok"], metrics["check"]["verdict"]
    nearest = float(np.hypot(*track.T).min())
    assert nearest == pytest.approx(cut_m, abs=1.5)
    assert metrics["check"]["limit_used"]["off_path"] == pytest.approx(nearest / 10.0, abs=0.05)


@pytest.mark.flights
@pytest.mark.parametrize("law", ["preview", "l1"])
@pytest.mark.parametrize("navigation", ["perfect", "rtk"])
def test_a_path_with_room_in_hand_is_yes_whatever_the_seed_of_the_gusts(navigation: str, law: str) -> None:
    """Arcs of 150 m, in a wind of 5 m/s and moderate turbulence: 31 of 45 deg of bank, 61 % of the acceleration."""
    used = []
    for seed in range(1, 13):
        settings = {
            "seed": str(seed),
            "guidance.kind": law,
            "navigation.kind": navigation,
            "environment.turbulence.intensity": "moderate",
        }
        metrics, _ = flown(rounded_corner(150.0), wind=(5.0, 225.0), settings=settings)
        assert metrics["check"]["ok"], (seed, metrics["check"]["verdict"])
        used.append(metrics["check"]["limit_used"]["off_path"])
    assert max(used) < 0.7
