"""`wayproof world`: a scenario that flies at once; and a scenario of files that flies alone once it is expanded."""

import hashlib
import json
import math
import shutil
from pathlib import Path

import numpy as np
import pyproj
import pytest
import shapely
import yaml

from harness.cli.app import main
from harness.cli.command_line import world_notes
from harness.run.scenario_flight import fly_to_folder
from harness.run_files.run_folder import load_run
from harness.world.world import World
from tests.harness.run.given import written
from tests.harness.world_files.making import SQUARE, feature, geojson, geotiff, osm
from wayproof import InputError, dump_scenario, load_scenario


def hill(folder: Path) -> Path:
    """4 km by 4 km with a hill of 500 m in the middle, in Swiss coordinates."""
    row, column = np.mgrid[0:400, 0:400]
    heights = 1000.0 + 500.0 * np.exp(-((row - 200.0) ** 2 + (column - 200.0) ** 2) / 70.0**2)
    return geotiff(folder / "hill.tif", heights, (781_000.0, 189_500.0), 10.0, 21781)


def run_world(out: Path, *arguments: str) -> int:
    return main(["world", *arguments, "--out", str(out)])


@pytest.mark.flights
def test_a_hill_is_flown_round_and_the_expanded_scenario_flies_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = hill(tmp_path), tmp_path / "hill.yaml"
    assert run_world(out, str(path), "--altitude-m", "1250") == 0
    said = capsys.readouterr()
    assert "from terrain" in said.out
    assert "fly it with `wayproof fly" in " ".join(said.out.split())
    assert said.err == "wayproof: reading hill.tif\n"
    assert all(len(line) <= 80 for line in said.out.splitlines())
    scenario = load_scenario(out)
    (x0, y0), (x1, y1) = scenario.mission.start_m, scenario.mission.goal_m
    middle = World.from_scenario(scenario).clearance_at((x0 + x1) / 2, (y0 + y1) / 2, 0.0)
    assert middle < 0.0  # the straight line goes through the hill
    folder = tmp_path / "run"
    figures = fly_to_folder(scenario, folder, recording=False)
    assert figures["outcome"] == "reached"
    assert figures["min_altitude_above_ground_m"] > 10.0
    run = load_run(folder)
    assert np.isfinite(run.track.altitude_above_ground_m).all()
    (source,) = run.manifest["sources"]
    assert source["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert "file:" not in run.scenario_yaml
    (alone := tmp_path / "alone").mkdir()
    shutil.copy(folder / "scenario.yaml", alone / "s.yaml")
    path.unlink()
    again = fly_to_folder(load_scenario(alone / "s.yaml"), tmp_path / "again", recording=False)
    assert again["digest"] == figures["digest"]
    assert again["min_altitude_above_ground_m"] == figures["min_altitude_above_ground_m"]


def test_what_is_solid_follows_the_altitude(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "hill.yaml"
    assert run_world(out, str(hill(tmp_path)), "--altitude-m", "1250") == 0

    def area_m2(altitude_m: str) -> float:
        import shapely

        loaded = load_scenario(out, [("mission.altitude_m", altitude_m), ("mission.goal_radius_m", "10")])
        solid = [shapely.Polygon(each.polygon.vertices_m) for each in loaded.obstacles if each.polygon]
        return float(shapely.area(solid).sum())

    # The hill is 500 exp(-r^2 / 700^2): what reaches to 1240 m is as wide as r^2 = 700^2 ln(500 / 240), and the edge.
    assert area_m2("1250") == pytest.approx(math.pi * 700.0**2 * math.log(500 / 240), rel=0.02)
    assert area_m2("1400") == pytest.approx(math.pi * 700.0**2 * math.log(500 / 390), rel=0.03)
    assert area_m2("1600") == 0.0
    expanded = tmp_path / "expanded.yaml"  # as a run folder has it
    expanded.write_text(dump_scenario(load_scenario(out)))
    load_scenario(expanded)
    with pytest.raises(InputError, match=r"altitude_m: is 1400; the obstacles are hill.tif cut at 1250 m"):
        load_scenario(expanded, [("mission.altitude_m", "1400")])
    drawn, over = tmp_path / "a.csv", ["--aircraft", "aerosonde", "--scenario", str(expanded)]
    for second_m, told in ((1400, "is 1400; the obstacles"), (1250, "are files cut at one altitude")):
        drawn.write_text(f"x_m,y_m,altitude_m\n0,0,{second_m}\n900,0,{second_m}\n1900,0,1400\n")
        assert main(["check", str(drawn), *over, "--out", str(tmp_path / "run")]) == 2
        assert told in capsys.readouterr().err
    over[-1] = str(out)  # it names the file, which is looked at in layers, the first of which has nothing
    drawn.write_text("x_m,y_m,altitude_m\n0,0,1600\n900,0,1600\n1900,0,1400\n")
    assert main(["check", str(drawn), *over, "--no-recording", "--out", str(tmp_path / "run")]) < 2
    assert "nothing of it is solid" not in " ".join(capsys.readouterr().out.split())
    assert Path(load_run(tmp_path / "run").manifest["sources"][0]["path"]).name == "hill.tif"
    over[-1] = str(tmp_path / "run" / "scenario.yaml")
    assert main(["check", str(drawn), *over, "--out", str(tmp_path / "again")]) == 2
    assert "hill.tif were looked at in layers along a path, and none stand here" in capsys.readouterr().err


def test_start_and_goal_may_be_given_in_degrees(tmp_path: Path) -> None:
    path = geojson(tmp_path / "a.geojson", feature({"name": "zone"}))
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "link").symlink_to(tmp_path / "a" / "b")
    out = tmp_path / "link" / "zone.yaml"
    ends = ("--start", "47.005,7.98", "--goal", "47.005,8.03")
    assert run_world(out, str(path), "--altitude-m", "300", *ends) == 0
    scenario = load_scenario(out)
    assert math.dist(scenario.mission.start_m, scenario.mission.goal_m) == pytest.approx(3802.0, rel=0.001)
    text = out.read_text()
    start = f"  start_m: [{scenario.mission.start_m[0]}, {scenario.mission.start_m[1]}]"
    assert start in text
    out.write_text(text.replace(start, "  start: {latitude_deg: 47.005, longitude_deg: 7.98}"))
    again = load_scenario(out)
    assert again.mission.start_m == pytest.approx(scenario.mission.start_m, abs=0.1)
    assert again.mission.start is None
    assert world_notes(again) == world_notes(scenario)
    del (keys := yaml.safe_load(out.read_text()))["area"]["origin"]
    out.write_text(yaml.safe_dump({**keys, "obstacles": []}))
    assert world_notes(load_scenario(out))["origin"].endswith("lie about the default, 47, 8")
    assert "start_m:" in dump_scenario(again)


def test_what_is_passed_over_of_a_file_is_told_to_who_flies_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wire = {"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[8.0, 47.0], [8.01, 47.0]]}}
    zone, out = feature({"name": "zone"}, [[*place, 50.0] for place in SQUARE]), tmp_path / "s.yaml"
    run_world(out, str(geojson(tmp_path / "a.geojson", zone, wire)), "--altitude-m", "300")
    capsys.readouterr()
    for command in (["validate", str(out)], ["fly", str(out), "--set", "mission.time_limit_s=1"]):
        main([*command, *(["--out", str(tmp_path / "run")] if command[0] == "fly" else [])])
        said = " ".join(capsys.readouterr().out.split())
        assert "1 point or line without an area passed" in said
        assert "altitudes of corners passed over: heights are attributes, as floor and ceiling" in said


def test_of_several_files_those_are_given_a_key_that_use_it(tmp_path: Path) -> None:
    zone = geojson(tmp_path / "a.geojson", feature({"name": "zone"}))
    house = osm(tmp_path / "a.osm", [({"building": "yes"}, [(8.0, 47.0), (8.0, 47.001), (8.001, 47.0)])])
    out = tmp_path / "both.yaml"
    assert run_world(out, str(zone), str(house), "--altitude-m", "300", "--crs", "EPSG:4326") == 0
    files = [each["file"] for each in yaml.safe_load(out.read_text())["obstacles"]]
    assert {each["path"]: each.get("crs") for each in files} == {"a.geojson": "EPSG:4326", "a.osm": None}
    # As degrees: one corner lies on earth; it is a few cm wide; it goes round the earth, and the area is at its edge.
    ends = ("--start=-17,179.9", "--goal=-17,-179.9")
    for rows, x, y, cell, more in ((2, 0, 0, 400, ()), (2, 8, 47, 1e-7, ()), (18, -180, -90, 10, ends)):
        head = f"ncols {2 * rows}\nnrows {rows}\nxllcorner {x}\nyllcorner {y}\ncellsize {cell}\n"
        (grid := tmp_path / "a.asc").write_text(head + "1 2 " * rows * rows)
        assert run_world(out, str(grid), "--altitude-m", "300", "--crs", "EPSG:4326", *more) == 2


def test_a_file_that_names_its_crs_keeps_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ring = [(563_837, 5_184_778), (564_237, 5_184_770), (564_245, 5_185_170)]  # on the hill, by pyproj
    files = str(hill(tmp_path)), str(geojson(tmp_path / "a.geojson", feature({}, ring)))
    out, more = tmp_path / "a.yaml", ("--altitude-m", "1450", "--crs", "EPSG:25832")
    assert run_world(out, *files, *more) == 0
    assert [each["file"].get("crs") for each in yaml.safe_load(out.read_text())["obstacles"]] == [None, more[3]]
    assert run_world(out, files[0], *more) == 2
    assert "hill.tif: names its own crs, CH1903 / LV03; leave crs out" in " ".join(capsys.readouterr().err.split())


def moving_ai(folder: Path) -> Path:
    """A map of 32 by 32 cells with a wall in the middle that leaves a gap."""
    rows = ["." * 32] * 6 + ["." * 16 + "@" + "." * 15] * 26
    path = folder / "wall.map"
    path.write_text("type octile\nheight 32\nwidth 32\nmap\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("craft", [("aerosonde", "300"), ("penguin_b", "5600")])  # this one banks less there
def test_a_map_too_small_names_the_cell_that_would_do(
    craft: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out, (aircraft, altitude_m) = moving_ai(tmp_path), tmp_path / "wall.yaml", craft
    given = (str(path), "--altitude-m", altitude_m, "--aircraft")
    assert run_world(out, *given, aircraft) == 2
    assert not out.exists()
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith(f"{path}: 32 x 32 m, 97% free, are too small for {aircraft}")  # 26 of 1,024 cells
    cell = line.partition("--metres-per-cell ")[2].split()[0]
    assert run_world(out, *given, aircraft, "--metres-per-cell", cell) == 0
    assert load_scenario(out).area.bounds_m[2] == pytest.approx(32.0 * float(cell))
    assert run_world(out, *given, "c172p", "--metres-per-cell", cell) == 2


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--start", "47,8"], "--start and --goal belong together"),
        (["--start", "47;8", "--goal", "1,2"], "is not A,B"),
        (["--aircraft", "zeppelin"], "unknown aircraft"),
        (["--start", "947,8", "--goal", "47,8"], "must be latitude,longitude in degrees, as 46.81,9.85"),
        (["--crs", "EPSG:99999"], "which is not known"),
        (["--crs", "EPSG:5773"], "has the crs 'EGM96 height', which is none of places on earth"),
        (["--crs", "IAU_2015:30100"], "Sphere / Ocentric', which is none of places on earth"),
        (["--start", "48,9", "--goal", "48.1,9"], "origin {latitude_deg: 47.0050, longitude_deg: 8.0050} is"),
        (["--start", "47.005,8.005", "--goal", "47.005,8.05"], "the scenario would not fly"),
        (["--altitude-m", "1"], "at least 5"),
        (["--metres-per-cell", "nan"], "--metres-per-cell is nan; must be a finite number greater than 0"),
        (["--ground-m", "500"], "file.ground_m: is 500; must be below mission.altitude_m, 300"),
        (["--metres-per-cell", "0"], "--metres-per-cell is 0; must be"),
        (["--metres-per-cell", "5"], "has its place on earth, which metres_per_cell does not move"),
        (["--altitude-m", "nan"], "--altitude-m is nan; must be finite"),
        (["--out", "no_folder/w.yaml"], "no_folder/w.yaml: cannot be written (its folder is not there)"),
        (["--altitude-m", "12000"], "would not fly: mission.altitude_m: is 12000; must be at most 7250"),
    ],
)
def test_bad_usage_is_told_and_nothing_is_written(
    arguments: list[str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = geojson(tmp_path / "a.geojson", feature({})), tmp_path / "out.yaml"
    given = ["world", str(path), *arguments, *([] if "--out" in arguments else ["--out", str(out)])]
    assert main([*given, *([] if "--altitude-m" in arguments else ["--altitude-m", "300"])]) == 2
    assert sentence in capsys.readouterr().err
    assert not out.exists()


def test_the_share_of_the_area_that_is_solid_is_that_inside_of_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It counted what reaches up to 2 % of a side beyond the area too: 93 % where 87 % were solid."""
    belt = [[6.0, 47.0], [9.0, 47.0], [9.0, 47.2], [6.0, 47.2], [6.0, 47.0]]
    text = json.dumps({"type": "Polygon", "coordinates": [belt]})
    path, out = written(tmp_path / "a.geojson", text), tmp_path / "a.yaml"
    given = (str(path), "--altitude-m", "500", "--start", "47.22,7.3", "--goal", "47.22,7.8")
    assert run_world(path, *given) == 2
    assert path.read_text() == text
    assert run_world(out, *given) == 0
    area = load_scenario(out).area
    north, east = area.origin.latitude_deg, area.origin.longitude_deg
    to_plane = pyproj.Proj(f"+proj=aeqd +ellps=WGS84 +lat_0={north} +lon_0={east}")
    sides = np.linspace(6.0, 9.0, 400)
    ring = np.column_stack(to_plane(np.r_[sides, sides[::-1]], np.repeat((47.0, 47.2), 400)))
    box = shapely.box(*area.bounds_m)
    share = shapely.Polygon(ring).intersection(box).area / box.area
    assert f"1 polygon, {100.0 * share:.3g} % of the area" in capsys.readouterr().out


@pytest.mark.parametrize(("yaw", "w_m", "h_m"), [(0.0, 6000, 3000), (0.46365, 3354, 1677), (1, 1783, 2776)])
def test_a_turned_map_has_its_largest_upright_area(yaw: float, w_m: int, h_m: int, tmp_path: Path) -> None:
    """By hand, of w by h turned by a: h / (2 sin a) by h / (2 cos a), where tan a is at least h / w."""
    (tmp_path / "m.pgm").write_bytes(b"P5\n200 100\n255\n" + b"\xfe" * 20_000)
    (tmp_path / "m.yaml").write_text(f"image: m.pgm\nresolution: 30.0\norigin: [0, 0, {yaw}]\nnegate: 0\n")
    assert run_world(tmp_path / "s.yaml", str(tmp_path / "m.yaml"), "--altitude-m", "100") == 0
    xmin, ymin, xmax, ymax = load_scenario(tmp_path / "s.yaml").area.bounds_m
    assert (xmax - xmin, ymax - ymin) == pytest.approx((w_m, h_m), rel=0.01)
