"""A real run exported, read back by other libraries, and checked by ourselves."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import geojson
import numpy as np
import pytest
import shapely
from pymavlink import mavwp
from pyproj import CRS, Transformer

import wayproof
from aircraft.frames import LocalPlane
from harness.cli.app import main
from harness.flight.record import FloatArray
from harness.run_files.exports import FORMATS, planned_points
from harness.run_files.path_files import read_path
from harness.run_files.run_folder import Run, load_run
from harness.scenario.sections import Origin
from tests.refusals import refused
from tests.scenarios import scenario_of

Export = Callable[..., str]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A flight across 180 degrees, far from the origin of its plane, where the meridians lean, in wind."""
    folder = tmp_path_factory.mktemp("export")
    (folder / "far.yaml").write_text(
        "schema: wayproof/scenario/1\n"
        "name: far\n"
        "area: {bounds_m: [80000, 60000, 88000, 68000], origin: {latitude_deg: 61.0, longitude_deg: 178.45}}\n"
        "obstacles: [{circle: {center_m: [83500, 63600], radius_m: 400}}]\n"
        "mission: {start_m: [81000, 61000], goal_m: [86000, 66000], altitude_m: 450}\n"
        "environment: {wind: {speed_mps: 5, from_deg: 200}}\n"
    )
    options = ["--out", str(folder / "run"), "--no-recording", "--quiet"]
    assert main(["fly", str(folder / "far.yaml"), *options]) == 0
    return load_run(folder / "run")


@pytest.fixture
def export(run: Run, tmp_path: Path) -> Export:
    def write(form: str, what: str = "flown", *options: str) -> str:
        out = tmp_path / f"{what}.{form}"
        arguments = [str(run.folder), "--format", form, "--what", what, "--out", str(out), *options]
        assert main(["export", *arguments]) == 0
        return str(out)

    return write


def in_plane(run: Run, latitude_deg: list[float], longitude_deg: list[float]) -> FloatArray:
    """Degrees in the run's plane, by PROJ."""
    origin = scenario_of(run.scenario_yaml).area.origin
    plane = CRS.from_proj4(f"+proj=aeqd +lat_0={origin.latitude_deg} +lon_0={origin.longitude_deg} +datum=WGS84")
    to_plane = Transformer.from_crs("EPSG:4326", plane, always_xy=True)
    return np.column_stack(to_plane.transform(longitude_deg, latitude_deg))


def line_of(run: Run, what: str) -> shapely.LineString:
    flown = np.column_stack((run.track.east_m, run.track.north_m))
    return shapely.LineString(planned_points(run)[0] if what == "planned" else flown)


def assert_same_line(points: FloatArray, line: shapely.LineString) -> None:
    """Neither is anywhere further than a metre from the other."""
    assert len(points) > 10
    lines = (shapely.LineString(points), line)
    for one, other in (lines, lines[::-1]):
        every_metre = shapely.points(shapely.get_coordinates(shapely.segmentize(one, 1.0)))
        shapely.prepare(other)
        assert shapely.dwithin(every_metre, other, 1.0).all()


@pytest.mark.parametrize("what", ["flown", "planned"])
def test_plan_is_what_qgroundcontrol_describes(what: str, export: Export, run: Run) -> None:
    """Its keys are those of QGroundControl's developer guide, plan file format."""
    plan = json.loads(Path(export("plan", what)).read_text())
    assert (plan["fileType"], plan["groundStation"], plan["version"]) == ("Plan", "QGroundControl", 1)
    assert plan["geoFence"] == {"circles": [], "polygons": [], "version": 2}
    assert plan["rallyPoints"] == {"points": [], "version": 2}
    mission = plan["mission"]
    keys = "cruiseSpeed firmwareType globalPlanAltitudeMode hoverSpeed items plannedHomePosition vehicleType version"
    assert mission.keys() == set(keys.split())
    items = mission["items"]
    assert [item["doJumpId"] for item in items] == list(range(1, len(items) + 1))
    told = {(each["type"], each["command"], each["frame"], *each["params"][6:]) for each in items}
    assert told == {("SimpleItem", 16, 0, 450.0)}
    places = [[item["params"][i] for item in items] for i in (4, 5)]
    assert_same_line(in_plane(run, *places), line_of(run, what))
    assert (mission["cruiseSpeed"], len(mission["plannedHomePosition"])) == (25.0, 3)


@pytest.mark.parametrize("what", ["flown", "planned"])
def test_waypoints_are_read_by_pymavlink(what: str, export: Export, run: Run) -> None:
    loader = mavwp.MAVWPLoader()
    assert loader.load(export("waypoints", what)) == loader.count()
    items = [loader.wp(i) for i in range(loader.count())]
    assert [(item.seq, item.command, item.frame) for item in items] == [(i, 16, 0) for i in range(len(items))]
    assert {item.z for item in items[1:]} == {450.0}
    assert_same_line(in_plane(run, [item.x for item in items[1:]], [item.y for item in items[1:]]), line_of(run, what))


@pytest.mark.parametrize("what", ["flown", "planned"])
@pytest.mark.parametrize("form", ["waypoints", "geojson"])
def test_the_altitudes_of_a_checked_path_are_written(form: str, what: str, tmp_path: Path) -> None:
    """400 m north at 300 m, then up to 360 m on 1600 m, straight on: a degree of latitude here has 111,177 m."""
    wayproof.check([(0, 0, 300), (0, 400, 300), (0, 2000, 360)], out=tmp_path / "run")
    out = tmp_path / "out"
    assert main(["export", str(tmp_path / "run"), "--format", form, "--what", what, "--out", str(out)]) == 0
    if form == "geojson":
        (feature,) = geojson.loads(out.read_text()).features
        _, latitude, up = np.array(feature.geometry.coordinates).T
    else:
        loader = mavwp.MAVWPLoader()
        loader.load(str(out))
        latitude, up = np.array([(loader.wp(i).x, loader.wp(i).z) for i in range(1, loader.count())]).T
    north = np.arange(0.0, 1991.0, 10.0)
    drawn = 300.0 + 60.0 * np.maximum(north - 400.0, 0.0) / 1600.0
    assert np.interp(north, (latitude - 47.0) * 111_177.0, up) == pytest.approx(drawn, abs=2.5)


@pytest.mark.parametrize("what", ["flown", "planned"])
def test_geojson_is_read_by_geojson(what: str, export: Export, run: Run) -> None:
    collection = geojson.loads(Path(export("geojson", what)).read_text())
    assert collection.is_valid
    (feature,) = collection.features
    assert isinstance(feature.geometry, geojson.LineString)
    longitude, latitude, altitude = zip(*feature.geometry.coordinates, strict=True)
    assert_same_line(in_plane(run, list(latitude), list(longitude)), line_of(run, what))
    assert np.array(altitude) == pytest.approx(450.0, abs=1.0)
    assert feature.properties == {"name": "far", "what": what, "airspeed_mps": 25.0}


@pytest.mark.parametrize("what", ["flown", "planned"])
def test_kml_is_what_the_standard_says(what: str, export: Export, run: Run) -> None:
    names = {"k": "http://www.opengis.net/kml/2.2"}
    (placemark,) = ElementTree.parse(export("kml", what)).getroot().findall(".//k:Placemark", names)
    assert placemark.findtext("k:name", None, names) == f"far, {what}"
    (line,) = placemark.findall("k:LineString", names)
    rows = [row.split(",") for row in (line.findtext("k:coordinates", "", names)).split()]
    assert line.findtext("k:altitudeMode", None, names) == "absolute"
    longitude, latitude, altitude = np.array(rows, dtype=np.float64).T.tolist()
    assert_same_line(in_plane(run, latitude, longitude), line_of(run, what))
    assert np.array(altitude) == pytest.approx(450.0, abs=1.0)


@pytest.mark.parametrize("what", ["flown", "planned"])
@pytest.mark.parametrize("form", ["plan", "waypoints", "geojson", "kml"])
def test_what_is_exported_can_be_checked_and_is_trackable(
    form: str, what: str, export: Export, run: Run, tmp_path: Path
) -> None:
    out = tmp_path / "check"
    options = ["--aircraft", "aerosonde", "--wind", "5,200", "--no-recording", "--quiet", "--out", str(out)]
    assert main(["check", export(form, what), *options]) == 0
    checked = load_run(out)
    assert checked.metrics["trackable"] is True
    assert checked.metrics["cross_track_m"]["max"] < 1.0
    assert scenario_of(checked.scenario_yaml).mission.altitude_m == pytest.approx(450.0, abs=0.1)
    assert checked.metrics["flown_length_m"] == pytest.approx(run.metrics["flown_length_m"], rel=0.01)


def test_standard_output_has_the_file_and_nothing_else(
    export: Export, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    written = Path(export("geojson", "planned")).read_text()
    capsys.readouterr()
    assert main(["export", str(run.folder), "--format", "geojson", "--what", "planned"]) == 0
    assert capsys.readouterr() == (written, "")


def test_what_its_user_should_know_is_said(run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file of degrees lies somewhere, though nobody said where; a mission may be flown."""
    copy = tmp_path / "copy"
    shutil.copytree(run.folder, copy)
    place = "area.origin is 47, 8, also the default of scenarios without one: the file lies there\n"
    text = run.scenario_yaml.replace("latitude_deg: 61.0", "latitude_deg: 47.0").replace("178.45", "8.0")
    assert scenario_of(text).area.origin == Origin()
    (copy / "scenario.yaml").write_text(text)
    ended: dict[str, Any] = {"outcome": "collision", "reason": "inside an obstacle by 2.4 m"}
    ended["check"] = {"fences": [{}], "items": [{"name": "change speed", "what": "flown"}]}
    (copy / "metrics.json").write_text(json.dumps({**run.metrics, **ended}))
    manifest = {key: value for key, value in run.manifest.items() if key != "sha256"}
    (copy / "manifest.json").write_text(json.dumps(manifest))
    failed = "the run did not reach its goal, and its mission would not either (collision: inside an"
    for form in FORMATS:
        capsys.readouterr()
        out = ["--out", str(tmp_path / f"a.{form}")]
        assert main(["export", str(copy), "--format", form, *out]) == 0
        said = capsys.readouterr().err
        assert place in said
        assert (failed in said) == (form in ("plan", "waypoints"))
        assert "the file has no fences and no changes of airspeed, unlike the path that was checked" in said
        assert main(["export", str(run.folder), "--format", form, *out]) == 0
        said = capsys.readouterr().err
        assert not [text for text in (place, failed, "airspeed") if text in said]


def test_a_folder_without_a_run_and_a_file_without_a_folder_are_refused(run: Run, tmp_path: Path) -> None:
    assert "is not a run folder" in refused("export", tmp_path, "--format", "plan")
    said = refused("export", run.folder, "--format", "kml", "--out", tmp_path / "no" / "a.kml")
    assert "a.kml: cannot be written" in said
    said = refused("export", run.folder, "--format", "kml", "--out", run.folder / "metrics.json")
    assert "metrics.json: is one of the files that are given; choose another to write" in said


@pytest.mark.parametrize("form", list(FORMATS))
def test_longitudes_are_within_half_a_turn(form: str, export: Export, run: Run) -> None:
    text = Path(export(form)).read_text()
    read = read_path(Path(export(form)))
    assert read.origin_deg is not None
    plane = LocalPlane(*read.origin_deg)
    degrees = np.transpose([plane.geodetic(*point) for point in read.points_m.tolist()]).tolist()
    assert_same_line(in_plane(run, *degrees), line_of(run, "flown"))
    if form == "geojson":  # it goes on beyond 180 degrees instead
        (feature,) = geojson.loads(text).features
        west, _, east, _ = shapely.geometry.shape(feature.geometry).bounds
        assert east - west < 0.2
        return
    numbers = re.findall(r"-?1[78]\d\.\d{6,}", text)
    assert len(numbers) > 10
    assert {float(number) > 0.0 for number in numbers} == {True, False}
    assert max(abs(float(number)) for number in numbers) <= 180.0
