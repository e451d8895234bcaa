"""Paths read from files, and what is said of files that are none."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyproj import Geod

from harness.run_files.mission.program import MissionStep
from harness.run_files.mission.vertices import altitude_m
from harness.run_files.path_files import read_path
from tests.harness.run.given import written
from wayproof import InputError, check

WGS84 = Geod(ellps="WGS84")
POINTS = [(47.0, 8.0), (47.1, 8.0), (47.1, 8.4)]  # latitude, longitude


def item(latitude: float, longitude: float, altitude: float = 120.0, **keys: Any) -> dict[str, Any]:
    params = [0, 0, 0, None, latitude, longitude, altitude]
    return {"type": "SimpleItem", "command": 16, "doJumpId": 1, "frame": 3, "params": params, **keys}


def plan(*items: dict[str, Any], home_m: float = 400.0) -> str:
    mission = {"items": list(items), "plannedHomePosition": [47.0, 8.0, home_m], "version": 2}
    return json.dumps({"fileType": "Plan", "mission": mission, "version": 1})


def refused(path: Path) -> str:
    """What is said, in one line, of a file that is none to fly."""
    with pytest.raises(InputError) as fault:
        check(path)
    assert len(str(fault.value).splitlines()) == 1
    return str(fault.value)


def steps_of(path: Path) -> tuple[MissionStep, ...]:
    mission = read_path(path).mission
    assert mission is not None
    return mission.steps


def line(*cells: object) -> str:
    return "\t".join(map(str, cells))


def wpl(*rows: str) -> str:
    return "\n".join(("QGC WPL 110", line(0, 1, 0, 16, 0, 0, 0, 0, 47.0, 8.0, 400.0, 1), *rows)) + "\n"


def wpl_items(frame: int = 3, command: int = 16, hold: float = 0.0, altitude: float = 120.0) -> list[str]:
    return [
        line(number, 0, frame, command, hold, 0, 0, 0, *place, altitude, 1)
        for number, place in enumerate(POINTS, start=1)
    ]


def test_other_columns_are_named(tmp_path: Path) -> None:
    path = written(tmp_path / "path.csv", "x_m,y_m,a,b,,d\n0,0,1,1,1,1\n9,9,1,1,1,1\n")
    assert read_path(path).notes == ("columns passed over: a, b, one without a name, d",)
    text = geojson(LINE).replace("{}", '{"name": "a", "b": null, "c": 0, "altitudeMode": "relativeToGround"}')
    path = written(tmp_path / "path.geojson", text)
    assert read_path(path).notes == ("attributes passed over: altitudeMode, c",)


def with_keys(**keys: Any) -> str:
    return json.dumps({**json.loads(plan(item(47.0, 8.0), item(47.1, 8.0, doJumpId=2))), **keys})


def fenced(*ring: list[float]) -> str:
    return with_keys(geoFence={"polygons": [{"inclusion": False, "polygon": ring}]})


def geojson(coordinates: Any, kind: str = "LineString") -> str:
    feature = {"type": "Feature", "properties": {}, "geometry": {"type": kind, "coordinates": coordinates}}
    return json.dumps({"type": "FeatureCollection", "features": [feature]})


LINE = [[longitude, latitude] for latitude, longitude in POINTS]
GOOD = {
    "degrees.csv": ("latitude_deg,longitude_deg\n" + "".join(f"{a},{b}\n" for a, b in POINTS), None),
    "short.csv": ("name, LAT, lon\n" + "".join(f"p,{a},{b}\n" for a, b in POINTS), None),
    "collection.geojson": (geojson(LINE), None),
    "unlocated.geojson": (geojson(LINE).replace("[{", '[{"type": "Feature", "geometry": null}, {'), None),
    "bare.json": (json.dumps({"type": "LineString", "coordinates": [[*p, 520] for p in LINE]}), 520.0),
    "mission.plan": (plan(*(item(*place) for place in POINTS)), 520.0),
    "above_sea.plan": (plan(*(item(*place, 520.0, frame=0) for place in POINTS)), 520.0),
    "mission.waypoints": (wpl(*wpl_items()), 520.0),
}


@pytest.mark.parametrize("name", GOOD)
def test_every_format_gives_the_same_path(name: str, tmp_path: Path) -> None:
    text, altitude = GOOD[name]
    given = read_path(written(tmp_path / name, text))
    assert given.origin_deg == POINTS[0]
    if given.mission is None:
        assert given.altitudes_m.tolist() == ([] if altitude is None else [altitude] * len(POINTS))
    else:
        assert [altitude_m(step, 400.0, 0.0, 0.0) for step in given.mission.steps] == [altitude] * 3
    for (latitude, longitude), (east, north) in zip(POINTS, given.points_m, strict=True):
        azimuth, _, distance = WGS84.inv(8.0, 47.0, longitude, latitude)
        assert east == pytest.approx(distance * math.sin(math.radians(azimuth)), abs=0.1)
        assert north == pytest.approx(distance * math.cos(math.radians(azimuth)), abs=0.1)


@pytest.mark.parametrize("crs", ["urn:ogc:def:crs:EPSG::21781", "epsg:21781", "https://a.b/crs/EPSG/0/21781"])
def test_a_geojson_may_name_another_crs(crs: str, tmp_path: Path) -> None:
    """Zimmerwald (swisstopo): LV03 602030.68, 191775.03 is 46 52 37.5405 N, 7 27 54.9835 E."""
    content = json.loads(geojson([[602_030.68, 191_775.03], [603_030.68, 191_775.03]]))
    named = {"crs": {"type": "name", "properties": {"name": crs}}, **content}
    given = read_path(written(tmp_path / "a.geojson", json.dumps(named)))
    assert given.origin_deg == pytest.approx((46.877_094_6, 7.465_273_2), abs=2e-5)
    assert np.hypot(*given.points_m[1]) == pytest.approx(1000.0, abs=0.2)


@pytest.mark.parametrize("columns", ["x_m,y_m", "east_m, north_m"])
def test_csv_in_metres(columns: str, tmp_path: Path) -> None:
    given = read_path(written(tmp_path / "path.csv", f"\ufeff{columns}\n0,0\n100,5e2\n100,500\n\n-3.5,700\n"))
    assert given.points_m.tolist() == [[0.0, 0.0], [100.0, 500.0], [100.0, 500.0], [-3.5, 700.0]]
    assert given.origin_deg is None
    assert given.altitudes_m.tolist() == []


@pytest.mark.parametrize("column", ["altitude_m", "z_m", "up_m"])
@pytest.mark.parametrize("names", ["x_m,y_m", "latitude_deg,longitude_deg"])
def test_csv_with_altitudes(names: str, column: str, tmp_path: Path) -> None:
    path = written(tmp_path / "path.csv", f"{names},{column}\n1,2,300\n2,3,300.5\n")
    assert read_path(path).altitudes_m.tolist() == [300.0, 300.5]
    assert read_path(path, any_altitude=True).altitudes_m.tolist() == []


@pytest.mark.parametrize("altitude", [2.0, 30_000.0])
def test_an_altitude_that_cannot_be_flown_is_told_of_the_file(altitude: float, tmp_path: Path) -> None:
    path = written(tmp_path / "path.csv", f"x_m,y_m,z_m\n1,2,{altitude}\n2,3,{altitude}\n")
    told = "m above the sea; must be between 5 and 20000 m, or give --altitude-m"
    assert f"path.csv: point 0 is at {altitude:g} {told}" in refused(path)
    assert len(read_path(path, any_altitude=True).altitudes_m) == 0


BROKEN = {
    "ending": ("path.dxf", "0", ": is none of .csv, .geojson"),
    "empty csv": ("a.csv", "", ":1: has the columns none; must have x_m,y_m"),
    "no header": ("a.csv", "0,0\n1,1\n", ":1: has the columns 0, 0; must have x_m,y_m"),
    "text in csv": ("a.csv", "x_m,y_m\n0,0\n1,far\n", ":3: y_m: is 'far'; must be a finite number"),
    "nan in csv": ("a.csv", "x_m,y_m\n0,0\n1,nan\n", ":3: y_m: is 'nan'; must be a finite number"),
    "digits of Arabic": ("a.csv", "x_m,y_m\n0,0\n1,\u0669\n", ":3: y_m: is '\u0669'; must be a finite number"),
    "baro": ("a.csv", "lat,lon,baroaltitude\n47,8,9\n47,9,9\n", ":1: baroaltitude: is no altitude that is read; must"),
    "above": ("a.csv", "x_m,y_m,height_above_takeoff(ft)\n0,0,9\n9,9,9\n", "takeoff(ft): is no altitude that is read"),
    "feet": ("a.csv", "x_m,y_m,alt_ft\n0,0,9\n9,9,9\n", ":1: alt_ft: is no altitude that is read; must be metres as"),
    "words": ("a.csv", "x_m,y_m,height_above_ground\n0,0,9\n9,9,9\n", ":1: height_above_ground: is no altitude that"),
    "text for numbers": ("a.geojson", geojson([["8", 47], [8.1, 47]]), "coordinates[0]: is '8'; must be a finite"),
    "column twice": ("a.csv", "x_m,x_m,y_m\n0,0,0\n1,1,1\n", ":1: x_m: stands 2 times"),
    "short row": ("a.csv", "x_m,y_m\n0,0\n1\n", ":3: has 1 cell, the header 2"),
    "one point": ("a.csv", "x_m,y_m\n0,0\n", ": has 1 point; a path has at least 2"),
    "no point": ("a.json", '{"type": "LineString", "coordinates": [], "crs": "EPSG:21781"}', ": has 0 points; a path"),
    "one place": ("a.csv", "x_m,y_m\n5,5\n5,5\n", ": all its points are in one place"),
    "far beyond": ("a.csv", "x_m,y_m\n1e308,0\n-1e308,1\n", "must stay within 500 km of its origin"),
    "too far": ("a.csv", "x_m,y_m\n0,0\n9e5,0\n", ": reaches 900 km; must stay within 500 km"),
    "not degrees": ("a.geojson", geojson([[0, 0], [3000, 2000]]), "latitude 2000, longitude 3000"),
    "a crs by a name": ("a.geojson", geojson(LINE).replace("{", '{"crs": "DHDN", ', 1), ": crs: is 'DHDN'; must name"),
    "not json": ("a.geojson", '{"type":\n "LineString",}', ":2: is not whole JSON"),
    "json nan": ("a.geojson", '{"type": "LineString", "coordinates": [[NaN, 1], [1, 2]]}', "must be finite"),
    "polygon": ("a.geojson", geojson([LINE], "Polygon"), ": has 0 LineStrings; must have exactly one"),
    "no geojson": ("a.geojson", '{"points": []}', ": has no type; must be a GeoJSON LineString"),
    "a point of one": ("a.geojson", geojson([[8.0, 47.0], [8.0]]), "features[0].geometry.coordinates[1]: must be"),
    "some altitudes": ("a.geojson", geojson([[8.0, 47.0, 9], [8.1, 47.0]]), "has an altitude at 1 of 2 points"),
    "no plan": ("a.plan", '{"groundStation": "MissionPlanner", "mission": {"items": []}}',
        ": is not a plan of QGroundControl; must have \"fileType\": \"Plan\" (of Mission Planner, save the mission as"),
    "a plan of later": ("a.plan", plan(item(47, 8)).replace('"version": 1', '"version": 3'), ": version: is 3; must"),
    "a mission of later": ("a.plan", plan().replace('"version": 2', '"version": 9'), ": mission.version: is 9; must"),
    "no items": ("a.plan", '{"fileType": "Plan", "mission": {}}', ": mission.items: is missing"),
    "few params": ("a.plan", plan(item(47.0, 8.0, params=[0])), "mission.items[0].params: must be a list of 7"),
    "no place": ("a.plan", plan(item(47.0, 8.0, params=[0, 0, 0, None, 47.0, 8.0, None]), item(47.1, 8.0)),
        ": mission.items[0].params[6]: is null; a waypoint must have an altitude"),
    "text as command": ("a.plan", plan(item(47.0, 8.0, command="fly")), "items[0].command: is 'fly'; must be"),
    "version": ("a.waypoints", wpl(*wpl_items()).replace("110", "120", 1), ":1: is 'QGC WPL 120'; must be \"QGC WPL"),
    "fields": ("a.waypoints", wpl("1\t0\t3"), ":3: has 3 fields; a mission item has 12"),
    "a command beyond MAVLink": ("a.waypoints", wpl(*wpl_items(command=70_000)), ":3: has the command 70000; those of"),
    "a negative command": ("a.waypoints", wpl(*wpl_items(command=-1)), ":3: has the command -1; those of MAVLink are"),
    "a command of letters": ("a.waypoints", wpl(line(1, 0, 3, "fly", *(0,) * 7, 1)), ":3: field 4: is 'fly'; must be"),
    "unknown frame": ("a.waypoints", wpl(*wpl_items(frame=9)),
        ":3: item 1 has the frame 9; must be one of 0, 2, 3, 5"),
    "a local frame": ("a.waypoints", wpl(wpl_items()[0], *wpl_items(frame=4)[1:]),
        ": item 2 has the frame 4; must be one of 0, 2, 3, 5, 6, 10, 11 (a path in local metres can be given as CSV)"),
    "a jump to nowhere": ("a.waypoints", wpl(*wpl_items(), line(4, 0, 3, 177, 9, 2, 0, 0, 0, 0, 0, 1)),
        ":6: item 4 jumps to item 9, which does not exist; must be one from 1 to 4: ArduPilot and QGroundControl"),
    "a jump to itself": ("a.waypoints", wpl(*wpl_items(), line(4, 0, 3, 177, 4, -1, 0, 0, 0, 0, 0, 1)),
        ":6: item 4 jumps in a circle with nothing to fly in it"),
    "jumps without number": ("a.waypoints", wpl(*wpl_items(), line(4, 0, 3, 177, 1, 30000, 0, 0, 0, 0, 0, 1)),
        "jumps make it more than 20,000 legs"),
    "a key twice": ("a.plan", plan(item(47.0, 8.0), item(47.1, 8.0)).replace('"items"', '"items": [], "items"'),
        ":1: has the key 'items' twice in one place, first in line 1; keep one"),
    "half a place": ("a.plan", plan(item(47.0, 8.0), item(0.0, 8.0, params=[0, 0, 0, 0, None, 8.0, 100])),
        ": mission.items[1].params[4]: is null; a place must have latitude and longitude"),
    "nothing to fly": ("a.plan", plan(item(0, 0, command=183), item(0, 0, command=2000, doJumpId=2)),
        ": has 0 items to fly to; a path has at least 2"),
    "a survey without items": ("a.plan", plan(item(47.0, 8.0), {"type": "ComplexItem", "complexItemType": "survey"}),
        "(waypoint, item 1); a path has at least 2; item 2, complex (survey): not flown, it has no items of its own"),
    "a landing pattern": ("a.plan", plan(item(47, 8.0), {"type": "ComplexItem", "complexItemType": "fwLandingPattern"}),
        ": mission.items[1].landingApproachCoordinate: must be [latitude, longitude, altitude]"),
    "a landing above what": ("a.plan",
        plan(item(47.0, 8.0), {"type": "ComplexItem", "complexItemType": "fwLandingPattern", "altitudesAreRelative": 0,
            "landingApproachCoordinate": [47, 8, 500], "landCoordinate": [47, 8.1, 400]}),
        ": mission.items[1].altitudesAreRelative: must be true or false"),
    "a fence of two corners": ("a.plan", fenced([47, 8], [47.1, 8]), ": geoFence.polygons[0]: has fewer than 3"),
    "a fence that crosses itself": ("a.plan", fenced([47, 8], [48, 9], [47, 9], [48, 8]), "self-intersection at ("),
    "a fence of words": ("a.plan", with_keys(geoFence=[]), ": geoFence: must be a mapping"),
    "a fence under another key": ("a.plan", with_keys(geoFence={"circle": [1]}), ": geoFence.circle: is not known; m"),
    "rally points that are none": ("a.plan", with_keys(rallyPoints={"points": 5}), ": rallyPoints.points: must be"),
    "an item of no type": ("a.plan", plan(item(47, 8, type="Simple")), ".items[0].type: is 'Simple'; must be"),
    "a number in quotes": ("a.plan", plan(item(47, 8, doJumpId="1")), ".doJumpId: is '1'; must be a finite number"),
    "far below the sea": ("a.waypoints", wpl(*wpl_items(altitude=-900)), ": goes to -500 m above the sea; must be 5"),
    "only home": ("a.waypoints", wpl(), ": has no mission items; there is nothing to fly"),
}  # fmt: skip


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("name", "text", "sentence"), BROKEN.values(), ids=BROKEN)
def test_says_where_and_what_is_wrong(name: str, text: str, sentence: str, tmp_path: Path) -> None:
    path = written(tmp_path / name, text)
    said = refused(path)
    assert said.startswith(f"{path}:")
    assert sentence in said


@pytest.mark.parametrize(
    ("name", "sentence"),
    [("missing.csv", "no such file; give"), ("folder.csv", "is a folder, not a file; give")],
)
def test_says_what_cannot_be_read(name: str, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InputError, match=sentence):
        check(tmp_path / name)


def test_a_plan_of_before_version_4_has_its_places_beside_four_parameters(tmp_path: Path) -> None:
    def old(number: int, latitude: float, longitude: float) -> dict[str, Any]:
        place = [latitude, longitude, 120.0]
        return item(latitude, longitude, coordinate=place, params=[0, 0, 0, 0], doJumpId=number)

    content = json.loads(plan(*(old(k, *place) for k, place in enumerate(POINTS, 1))))
    content["geoFence"] = {"polygon": [[46.9, 7.9], [47.2, 7.9], [47.2, 8.5], [46.9, 8.5]], "version": 1}
    content["mission"]["cruiseSpeed"] = 15
    found = read_path(written(tmp_path / "old.plan", json.dumps(content)))
    assert found.mission is not None
    assert [step.position for step in found.mission.steps] == list(map(tuple, found.points_m.tolist()))
    assert found.origin_deg == POINTS[0]
    assert [step.height_m for step in found.mission.steps] == [120.0] * 3
    assert "cruiseSpeed 15 not flown: the airspeed is --airspeed-mps, else the" in str(found.notes)
    (fence,) = found.fences.every
    assert fence.inclusion


def test_parameters_of_no_number_are_left_to_the_autopilot_and_places_must_be_numbers(tmp_path: Path) -> None:
    path, later = tmp_path / "a.waypoints", wpl_items()[1:]
    written(path, wpl(line(1, 0, 3, 16, 0, 0, 0, "nan", *POINTS[0], 120, 1), *later))
    assert len(steps_of(path)) == 3
    written(path, wpl(line(1, 0, 3, 16, 0, 0, 0, 0, "nan", 8.0, 120, 1), *later))
    assert ":3: field 9 is nan; a place must have latitude and longitude" in refused(path)


@pytest.mark.parametrize(
    ("keys", "above"),
    [
        ({"version": 2, "altitudesAreRelative": False}, ["sea", "sea"]),
        ({"version": 1, "loiterAltitudeRelative": True, "landAltitudeRelative": False}, ["home", "sea"]),
    ],
)
def test_a_landing_pattern_of_before_version_4_1_begins_with_a_circle(
    keys: dict[str, Any], above: list[str], tmp_path: Path
) -> None:
    """The keys are those of `FixedWingLandingComplexItem::load` of QGroundControl 4.0; it was refused."""
    pattern = {"loiterCoordinate": [47.1, 8.0, 60], "loiterRadius": 75, "loiterClockwise": False, **keys}
    landing = {"complexItemType": "fwLandingPattern", "landCoordinate": [47.1, 8.4, 0], **pattern}
    made = steps_of(written(tmp_path / "a.plan", plan(item(47.0, 8.0), landing)))[1:]
    assert [(step.height_m, step.landing) for step in made] == [(60.0, False), (0.0, True)]
    assert [step.above for step in made] == above
    assert made[0].loiter is not None
    assert (made[0].loiter.radius_m, made[0].loiter.clockwise) == (75.0, False)


@pytest.mark.parametrize(
    ("command", "frame", "params", "name"),
    [
        (16, 3, [0, 0, 0, None, 47.0, 8.0, None], "waypoint"),
        (22, 3, [0, 0, 0, None, 47.0, 8.0, None], "takeoff"),
        (22, 3, [0, 0, 0, None, None, None, None], "takeoff"),
        (19, 3, [9, 0, 0, None, 47.0, 8.0, None], "loiter time"),
        (21, 0, [0, 0, 0, None, 47.0, 8.0, None], "land"),
    ],
)
def test_no_altitude_is_not_an_altitude_of_zero(
    command: int, frame: int, params: list[float | None], name: str, tmp_path: Path
) -> None:
    """A takeoff, a loiter or a landing without an altitude was flown at that of home, or of the sea."""
    first, last = item(*POINTS[1], doJumpId=1), item(*POINTS[2], doJumpId=3)
    missing = plan(item(0, 0, doJumpId=1, command=command, frame=frame, params=params), last)
    said = f"a {name} must have an altitude"
    assert f"items[0].params[6]: is null; {said}" in refused(written(tmp_path / "a.plan", missing))
    cells = ["nan" if each is None else each for each in params]
    missing = wpl(line(1, 0, frame, command, *cells, 1), *wpl_items()[1:])
    assert f":3: field 11 is nan; {said}" in refused(written(tmp_path / "a.waypoints", missing))
    here = item(0, 0, doJumpId=2, command=19, params=[9, 0, 0, None, None, None, None])
    path = written(tmp_path / "b.plan", plan(first, here, last))
    assert [step.height_m for step in steps_of(path)] == [120.0, None, 120.0]


def test_items_whose_autocontinue_is_off_are_named(tmp_path: Path) -> None:
    """PX4 waits there; the flight went on without a word."""
    said = "autocontinue is off: PX4 waits there to be told to go on; flown on, as ArduPilot does"
    path, rows = tmp_path / "a.waypoints", wpl_items()
    some = wpl(*rows[:2], rows[2][:-1] + "0", line(4, 0, 2, 183, *(0,) * 7, 0))
    assert f"item 3: {said}" in read_path(written(path, some)).notes
    assert not any("autocontinue" in note for note in read_path(written(path, wpl(*rows))).notes)
    every = plan(*(item(*place, doJumpId=k, autoContinue=False) for k, place in enumerate(POINTS * 3, start=1)))
    assert f"items 1, 2, 3, 4, 5, 6, 7, 8, 9: {said}" in read_path(written(tmp_path / "a.plan", every)).notes


def test_a_place_that_is_none_is_told_by_the_number_of_its_item(tmp_path: Path) -> None:
    rows = line(1, 0, 2, 183, *(0,) * 7, 1), *wpl_items()[1:], line(4, 0, 3, 16, 0, 0, 0, 0, 91, 8, 9, 1)
    said = refused(written(tmp_path / "a.waypoints", wpl(*rows)))
    assert "item 4 is at latitude 91, longitude 8; must be degrees" in said


def test_a_first_waypoint_that_is_numbered_1_and_above_home_is_no_home(tmp_path: Path) -> None:
    """It was taken for home, and the path began at the second waypoint."""
    rows = [line(k, 0, 3, 16, 0, 0, 0, 0, 47 + k / 100, 8, 100, 1) for k in (1, 2, 3)]
    path = written(tmp_path / "m.waypoints", "\n".join(("QGC WPL 110", *rows, "")))
    assert [step.item for step in steps_of(path)] == [1, 2, 3]
    assert read_path(path).notes == ("has no home: altitudes above home are counted from the sea",)


@pytest.mark.parametrize(
    ("home", "note"),
    [
        ([None, None, None], "has no home: altitudes above home are counted from the sea"),
        ([47.0, 8.0, None], "its home has no altitude: altitudes above home are counted from the sea"),
    ],
)
def test_what_a_plan_lacks_of_home_is_null(home: list[float | None], note: str, tmp_path: Path) -> None:
    path, content = tmp_path / "m.plan", json.loads(plan(*(item(*place) for place in POINTS)))
    content["mission"]["plannedHomePosition"] = home
    assert note in read_path(written(path, json.dumps(content))).notes
    content["mission"]["plannedHomePosition"] = [None, 8, 9]
    said = refused(written(path, json.dumps(content)))
    assert "plannedHomePosition[0]: is missing, or null; must be a finite" in said
