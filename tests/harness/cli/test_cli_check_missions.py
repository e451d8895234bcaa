"""The command `check` with missions in 3-D, terrain below them, and files of ground stations as they are."""

import json
from pathlib import Path

import pytest

from harness.cli.app import main
from harness.cli.flight_rows import verdict_rows
from harness.run_files.run_folder import load_run
from tests.harness.conftest import Checked
from tests.harness.run.given import item, waypoints_file, written

REAL = Path(__file__).parents[3].parent / "shared" / "real"
MISSIONS = sorted((REAL / "missions").glob("*")) if REAL.is_dir() else []
needs_missions = pytest.mark.skipif(not MISSIONS, reason="the real missions are not beside the checkout")
CANBERRA = "obstacles=[{file: {path: %s}}]" % (REAL / "terrain" / "S36E149.hgt.zip")


@pytest.mark.flights
def test_a_mission_is_flown_item_by_item(tmp_path: Path, checked: Checked, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [
        *(item(1, 0, 0, 60, 22, (15,)), item(2, 0, 1500), item(3, 0, 0, 0, 206, (25,))),
        *(item(4, 0, 3000, 100, 18, (2, 0, 150)), item(5, 0, 0, 0, 178, (0, 22))),
        *(item(6, 0, 4500, 180, 31, (0, 150)), item(7, 0, 0, 0, 186, (150, 3))),
        *(item(8, 0, 6500, 180), item(9, 0, 9000, 0, 21)),
    ]
    path = waypoints_file(tmp_path, [], more=rows)
    status, metrics = checked(path)
    assert (status, metrics["check"]["verdict"].partition(":")[0]) == (0, "yes")
    assert [item["what"] for item in metrics["check"]["items"]] == [
        *("flown", "flown", "passed over", "flown", "flown", "flown", "not flown", "flown", "flown")
    ]
    assert [leg["waypoint"] for leg in metrics["trackability"]] == [2, 4, 6, 8, 9]
    assert metrics["altitude_error_m"]["max"] < 10.0
    track = load_run(tmp_path / "run").track
    assert (track.up_m[0], track.up_m.max()) == pytest.approx((360.0, 480.0), abs=3.0)
    assert track.up_m[-1] == pytest.approx(315.0, abs=3.0)
    words = ["--aircraft", "aerosonde", "--no-recording", "--out", str(tmp_path / "run")]
    assert main(["check", str(path), *words]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "items 9: 7 flown, 1 passed over, 1 not flown" in said
    assert "item 7 command 186 (DO_CHANGE_ALTITUDE), not flown: it is not simulated" in said


def test_an_item_that_is_not_reached_and_keeps_autopilots_from_loading_the_mission_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [item(1, 0, 0), item(2, 0, 900, 100, 17), item(3, 0, 0), item(4, 0, 0, 0, 177, (9, 1))]
    path = waypoints_file(tmp_path, [], more=rows)
    given = ["check", str(path), "--aircraft", "aerosonde", "--no-recording", "--out", str(tmp_path / "run")]
    assert main(given) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "items 4: 2 flown, 2 not reached" in said
    why = "to item 9, which does not exist: ArduPilot and QGroundControl load no"
    assert f"item 4 jump, not reached: {why}" in said
    assert "item 3" not in said


@pytest.mark.parametrize(("up_m", "cause"), [(700.0, "climb too steep"), (-290.0, "descent too steep")])
def test_what_is_too_steep_is_told(up_m: float, cause: str, tmp_path: Path, checked: Checked) -> None:
    status, metrics = checked(waypoints_file(tmp_path, [(0, 0), (0, 1000)], more=[item(3, 0, 2000, up_m)]))
    assert status == 1
    bad = [leg for leg in metrics["trackability"] if not leg["trackable"]]
    assert {leg["cause"] for leg in bad} == {cause}
    bad[0]["cause"] = "navigation error"  # that too may be one of altitude
    assert f" {bad[0]['max_altitude_error_m']:.3g} m in altitude" in str(verdict_rows(metrics))


def test_a_drawn_line_with_altitudes_is_flown_up_and_down(tmp_path: Path, checked: Checked) -> None:
    path = written(tmp_path / "up.csv", "x_m,y_m,z_m\n0,0,300\n0,1500,400\n0,3000,400\n0,4500,320\n")
    status, metrics = checked(path)
    assert (status, metrics["altitude_error_m"]["max"] < 5.0, len(metrics["trackability"])) == (0, True, 3)
    status, metrics = checked(path, "--altitude-m", "350")
    track = load_run(tmp_path / "run").track
    assert status == 0
    assert (track.up_m.min(), track.up_m.max()) == pytest.approx((350.0, 350.0), abs=0.1)


def ridge(folder: Path) -> str:
    """The key of a ridge of 500 m across the way, 2 km north, on a grid of 100 m."""
    rows = [500.0 if 1800 <= 4000 - 100 * number <= 2200 else 300.0 for number in range(61)]
    cells = "\n".join(" ".join([f"{height:g}"] * 41) for height in rows)
    head = "ncols 41\nnrows 61\nxllcorner -2000\nyllcorner -2000\ncellsize 100\nNODATA_value -9999\n"
    return f"obstacles=[{{file: {{path: {written(folder / 'ridge.asc', head + cells)}}}}}]"


def test_a_path_that_meets_terrain_is_told_where(tmp_path: Path, checked: Checked) -> None:
    path = written(tmp_path / "low.csv", "x_m,y_m,altitude_m\n0,0,400\n0,1000,440\n0,3500,440\n")
    status, metrics = checked(path, "--set", ridge(tmp_path))
    (contact,) = metrics["contacts"]
    assert (status, contact["kind"], metrics["outcome"]) == (1, "terrain", "collision")
    assert contact["depth_m"] == pytest.approx(60.0, abs=3.0)
    assert 1600.0 < contact["north_m"] < 2400.0
    # Between cell middles at 1750 m (300 m) and 1850 m (500 m) the ground is 440 m high at 1820 m: 72.8 s at 25 m/s.
    assert metrics["check"]["verdict"].startswith("no: touches the ground at 73 s")
    path.write_text("x_m,y_m,altitude_m\n0,0,500\n0,1500,550\n0,3500,550\n")
    status, metrics = checked(path, "--set", ridge(tmp_path))
    assert (status, metrics["contact"]) == (0, False)
    assert 40.0 < metrics["height_above_ground_m"]["min"] < 60.0


def test_where_terrain_ends_is_told_and_which_items_count_from_it(tmp_path: Path, checked: Checked) -> None:
    """The file ends 4,100 m north of the first item, and the path 6,000 m north."""
    rows = [item(n, 0, 2000.0 * (n - 1), 300.0, frame=10) for n in (1, 2, 3, 4)]
    _, metrics = checked(waypoints_file(tmp_path, [], more=rows), "--set", ridge(tmp_path))
    assert metrics["ground_known_fraction"] == pytest.approx(4100 / 6000, abs=0.02)
    told = f"no terrain under {1.0 - metrics['ground_known_fraction']:.1%}"
    assert told in verdict_rows(metrics)["above ground"]
    (note,) = (each for each in metrics["check"]["notes"] if "as high as home" in each)
    assert note.startswith("item 4: above ground")


@pytest.mark.flights
def test_a_building_is_touched_only_below_its_roof(tmp_path: Path, checked: Checked) -> None:
    town = tmp_path / "town.geojson"
    corners = [[7.999, 47.009], [8.001, 47.009], [8.001, 47.011], [7.999, 47.011], [7.999, 47.009]]
    shape = {"type": "Polygon", "coordinates": [corners]}
    house = {"type": "Feature", "properties": {"building": "yes", "height": 120}, "geometry": shape}
    town.write_text(json.dumps({"type": "FeatureCollection", "features": [house]}))
    # From 67.9 m up it is passed in two layers, parted at 70 m; after 36 to 45 s.
    for low_m, begin_s, contacts in ((60, 0, 1), (60, 99, 0), (67.9, 0, 1), (150, 0, 0), (141, 1, 0)):
        solid = f"obstacles=[{{file: {{path: {town}, ground_m: 0}}, active_s: [{begin_s}, 900]}}]"
        places = [[8, 47, 250], [8, 47.006, low_m], [8, 47.016, low_m + 5], [8, 47.12, 1000]]
        line = {"type": "LineString", "coordinates": places[: 3 + (low_m == 141)]}
        path = written(tmp_path / "line.geojson", json.dumps(line))
        _, metrics = checked(path, "--set", solid, "--clearance-m", "20")
        assert [each["name"] for each in metrics["contacts"]] == ["town.geojson"] * contacts
        told = (tmp_path / "run" / "events.csv").read_text()
        assert (",warning,collision: touched town.geojson after" in told.replace('"', "")) is bool(contacts)
        assert metrics["clearance_violation_s"] == pytest.approx(contacts * (222.35 + 40) / 25, abs=0.2)


@pytest.mark.flights
@needs_missions
def test_real_missions_over_their_terrain(checked: Checked) -> None:
    _, metrics = checked(REAL / "missions" / "ardupilot_ap-terrain.txt", "--set", CANBERRA)
    assert [item["what"] for item in metrics["check"]["items"]] == ["flown"] * 7
    assert (metrics["outcome"], metrics["contacts"]) == ("reached", [])
    assert 10.0 < metrics["height_above_ground_m"]["min"] < 20.0
    assert 70.0 < metrics["height_above_ground_m"]["mean"] < 110.0
    legs = {leg["waypoint"]: leg for leg in metrics["trackability"]}
    assert (legs[2]["cause"], legs[2]["trackable"]) == ("turn radius too tight", False)
    assert 10.0 < legs[3]["max_deviation_m"] < 90.0, "still at the corner, where 90 m are allowed"
    assert (legs[3]["cause"], legs[3]["trackable"]) == (None, True)
