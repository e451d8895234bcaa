"""A real run exported, read back by other libraries, and checked by ourselves."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import fastkml
import geojson
import numpy as np
import pytest
import shapely
from pydantic import BaseModel, ConfigDict, Field
from pymavlink import mavwp
from pyproj import CRS, Geod, Transformer

from harness.cli.app import main
from harness.flight.record import FloatArray
from harness.run_files.run_folder import Run, load_run
from harness.run_files.run_paths import planned_points
from harness.scenario.scenario import parse_scenario

Export = Callable[..., str]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A flight far from the origin of its plane, where the meridians lean, in wind."""
    folder = tmp_path_factory.mktemp("export")
    (folder / "far.yaml").write_text(
        "schema: wayproof/scenario/1\n"
        "name: far\n"
        "area: {bounds_m: [80000, 60000, 88000, 68000], origin: {latitude_deg: 61.0, longitude_deg: 179.5}}\n"
        "obstacles: [{circle: {center_m: [83500, 63600], radius_m: 400}}]\n"
        "mission: {start_m: [81000, 61000], goal_m: [86000, 66000], altitude_m: 450}\n"
        "environment: {wind: {speed_mps: 5, from_deg: 200}}\n"
    )
    options = ["--out", str(folder / "run"), "--no-recording", "--quiet"]
    assert main(["fly", str(folder / "far.yaml"), *options]) == 0
    return load_run(folder / "run")


@pytest.fixture
def export(run: Run, tmp_path: Path) -> Export:
    """Exports the run; returns the file's name."""

    def write(form: str, what: str = "flown", *options: str) -> str:
        out = tmp_path / f"{what}.{form}"
        arguments = [str(run.folder), "--format", form, "--what", what, "--out", str(out), *options]
        assert main(["export", *arguments]) == 0
        return str(out)

    return write


def in_plane(run: Run, latitude_deg: list[float], longitude_deg: list[float]) -> FloatArray:
    """Degrees in the run's plane, by PROJ."""
    origin = parse_scenario(run.scenario_yaml).area.origin
    plane = CRS.from_proj4(
        f"+proj=aeqd +lat_0={origin.latitude_deg} +lon_0={origin.longitude_deg} +datum=WGS84"
    )
    to_plane = Transformer.from_crs("EPSG:4326", plane, always_xy=True)
    return np.column_stack(to_plane.transform(longitude_deg, latitude_deg))


def line_of(run: Run, what: str) -> shapely.LineString:
    """What should have been exported."""
    flown = np.column_stack((run.track.east_m, run.track.north_m))
    return shapely.LineString(planned_points(run) if what == "planned" else flown)


def assert_same_line(points: FloatArray, line: shapely.LineString) -> None:
    """Neither is anywhere further than a metre from the other."""
    assert len(points) > 10
    assert shapely.hausdorff_distance(shapely.LineString(points), line, densify=0.01) < 1.0


class PlanItem(BaseModel):
    """A SimpleItem as QGroundControl's developer guide describes it; nothing is converted or left over."""

    model_config = ConfigDict(strict=True, extra="forbid")
    AMSLAltAboveTerrain: float | None
    Altitude: float
    AltitudeMode: int
    autoContinue: bool
    command: int
    doJumpId: Annotated[int, Field(ge=1)]
    frame: int
    params: Annotated[list[float | None], Field(min_length=7, max_length=7)]
    type: Literal["SimpleItem"]


class PlanMission(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")
    cruiseSpeed: float
    firmwareType: int
    globalPlanAltitudeMode: int
    hoverSpeed: float
    items: Annotated[list[PlanItem], Field(min_length=1)]
    plannedHomePosition: Annotated[list[float], Field(min_length=3, max_length=3)]
    vehicleType: int
    version: Literal[2]


class PlanFence(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")
    circles: list[float]
    polygons: list[float]
    version: Literal[2]


class PlanRally(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")
    points: list[float]
    version: Literal[2]


class Plan(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")
    fileType: Literal["Plan"]
    geoFence: PlanFence
    groundStation: Literal["QGroundControl"]
    mission: PlanMission
    rallyPoints: PlanRally
    version: Literal[1]


@pytest.mark.parametrize("what", ["flown", "planned"])
def test_plan_is_what_qgroundcontrol_describes(what: str, export: Export, run: Run) -> None:
    mission = Plan.model_validate_json(Path(export("plan", what)).read_text()).mission
    assert [item.doJumpId for item in mission.items] == list(range(1, len(mission.items) + 1))
    assert {(item.command, item.frame, item.params[6], item.Altitude) for item in mission.items} == {
        (16, 0, 450.0, 450.0)
    }
    places = [[item.params[i] or math.nan for item in mission.items] for i in (4, 5)]
    assert_same_line(in_plane(run, *places), line_of(run, what))
    assert mission.cruiseSpeed == 25.0


@pytest.mark.parametrize("what", ["flown", "planned"])
def test_waypoints_are_read_by_pymavlink(what: str, export: Export, run: Run) -> None:
    loader = mavwp.MAVWPLoader()
    assert loader.load(export("waypoints", what)) == loader.count()
    items = [loader.wp(i) for i in range(loader.count())]
    assert [(item.seq, item.command, item.frame) for item in items] == [(i, 16, 0) for i in range(len(items))]
    assert {item.z for item in items[1:]} == {450.0}
    assert_same_line(
        in_plane(run, [item.x for item in items[1:]], [item.y for item in items[1:]]), line_of(run, what)
    )


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
def test_kml_is_read_by_fastkml(what: str, export: Export, run: Run) -> None:
    document = fastkml.KML.parse(export("kml", what), strict=True)
    (placemark,) = fastkml.utils.find_all(document, of_type=fastkml.Placemark)
    assert isinstance(placemark, fastkml.Placemark)
    assert placemark.name == f"far, {what}"
    line = placemark.kml_geometry
    assert isinstance(line, fastkml.LineString)
    assert line.geometry is not None
    assert line.altitude_mode == fastkml.enums.AltitudeMode.absolute
    longitude, latitude, altitude = zip(*line.geometry.coords, strict=True)
    assert_same_line(in_plane(run, list(latitude), list(longitude)), line_of(run, what))
    assert np.array(altitude) == pytest.approx(450.0, abs=1.0)


def test_planned_path_goes_on_where_one_plan_takes_over_from_another(run: Run) -> None:
    assert len(run.plans) > 5
    steps = np.diff(planned_points(run), axis=0)
    length = np.hypot(*steps.T)
    assert length.min() > 0.5
    assert length.max() < 10.0
    turn = np.arccos(np.clip((steps[1:] * steps[:-1]).sum(axis=1) / (length[1:] * length[:-1]), -1.0, 1.0))
    assert turn.max() < math.radians(20.0)


def test_acmi_has_every_row_with_true_heading(export: Export, run: Run) -> None:
    """Read after Tacview's documentation of the format, version 2.2."""
    text = Path(export("acmi")).read_bytes().decode("utf-8-sig")
    first, second, *lines = text.splitlines()
    assert (first, second) == ("FileType=text/acmi/tacview", "FileVersion=2.2")
    assert any(line.startswith("0,ReferenceTime=2") and line.endswith("Z") for line in lines)
    assert "1,Name=aerosonde,Type=Air+FixedWing" in lines
    times = [float(line[1:]) for line in lines if line.startswith("#")]
    assert times == pytest.approx(run.track.time_s, abs=1e-3)
    rows = [
        line.removeprefix("1,T=").partition(",")[0].split("|") for line in lines if line.startswith("1,T=")
    ]
    longitude, latitude, altitude, roll, pitch, yaw = np.array(rows, dtype=np.float64).T
    places = in_plane(run, latitude.tolist(), longitude.tolist())
    flown = np.column_stack((run.track.east_m, run.track.north_m))
    assert np.hypot(*(places - flown).T).max() < 1.0
    assert altitude == pytest.approx(run.track.up_m, abs=1e-3)
    assert roll == pytest.approx(run.track.roll_deg, abs=1e-3)
    assert pitch == pytest.approx(run.track.pitch_deg, abs=1e-3)
    # A step ahead along the nose in the plane, seen from the ellipsoid.
    nose = np.radians(run.track.heading_deg[0])
    origin = parse_scenario(run.scenario_yaml).area.origin
    plane = CRS.from_proj4(
        f"+proj=aeqd +lat_0={origin.latitude_deg} +lon_0={origin.longitude_deg} +datum=WGS84"
    )
    to_degrees = Transformer.from_crs(plane, "EPSG:4326", always_xy=True)
    ahead = to_degrees.transform(*(flown[0] + 10.0 * np.array([np.sin(nose), np.cos(nose)])))
    azimuth, _, _ = Geod(ellps="WGS84").inv(longitude[0], latitude[0], *ahead)
    assert (azimuth - yaw[0] + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.02)
    assert abs(yaw[0] - run.track.heading_deg[0]) > 1.0


@pytest.mark.parametrize("what", ["flown", "planned"])
@pytest.mark.parametrize("form", ["plan", "waypoints", "geojson"])
def test_what_is_exported_can_be_checked_and_is_trackable(
    form: str, what: str, export: Export, run: Run, tmp_path: Path
) -> None:
    out = tmp_path / "check"
    options = ["--aircraft", "aerosonde", "--wind", "5,200", "--no-recording", "--quiet", "--out", str(out)]
    assert main(["check", export(form, what), *options]) == 0
    checked = load_run(out)
    assert checked.metrics["trackable"] is True
    assert checked.metrics["cross_track_m"]["max"] < 1.0
    assert parse_scenario(checked.scenario_yaml).mission.altitude_m == pytest.approx(450.0, abs=0.1)
    length = run.metrics["flown_length_m"]
    assert checked.metrics["flown_length_m"] == pytest.approx(length, rel=0.01)


def test_fewer_points_are_written_with_more_tolerance(export: Export) -> None:
    counts = []
    for tolerance in ("0", "0.25", "20"):
        collection = json.loads(Path(export("geojson", "flown", "--tolerance-m", tolerance)).read_text())
        counts.append(len(collection["features"][0]["geometry"]["coordinates"]))
    assert counts[0] > 1000 > counts[1] > counts[2] >= 2


def test_standard_output_has_the_file_and_nothing_else(
    export: Export, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    written = Path(export("geojson", "planned")).read_text()
    capsys.readouterr()
    assert main(["export", str(run.folder), "--format", "geojson", "--what", "planned"]) == 0
    assert capsys.readouterr() == (written, "")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--format", "acmi", "--what", "planned"], "an ACMI file holds what was flown; a plan has no times"),
        (["--format", "shapefile"], "'shapefile' is not one of"),
        (["--format", "kml", "--tolerance-m", "-1"], "greater than or equal to 0"),
        ([], "Missing option"),
    ],
)
def test_bad_usage_is_refused(
    options: list[str], sentence: str, run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "way"
    assert main(["export", str(run.folder), *options, "--out", str(out)]) == 2
    said = capsys.readouterr()
    assert sentence in said.err
    assert len(said.err.splitlines()) == 1
    assert not out.exists()


def test_a_folder_without_a_run_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(tmp_path), "--format", "plan"]) == 2
    assert "is not a run folder" in capsys.readouterr().err


def test_a_file_that_cannot_be_written_is_named(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "nowhere" / "a.kml"
    assert main(["export", str(run.folder), "--format", "kml", "--out", str(out)]) == 2
    assert str(out) in capsys.readouterr().err
