"""Missions of QGroundControl before its plans, and missions as Windows' editors and scripts write them."""

from __future__ import annotations

import codecs
import json
from pathlib import Path
from typing import Any

import pytest

from harness.files.input_file import InputError
from harness.run_files.path_files import PathAsGiven, read_path

WPL = (
    "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.0\t8.0\t400\t1\n1\t0\t3\t16\t0\t0\t0\t0\t47.0\t8.0\t100\t1\n"
    "2\t0\t3\t16\t0\t0\t0\t0\t47.02\t8.0\t120\t1\n"
)


def old(command: int, *place: float, number: int, **more: Any) -> dict[str, Any]:
    params = {f"param{k}": 0 for k in range(1, 5)}
    given = {"command": command, "coordinate": place, "frame": 3, "id": number, "type": "missionItem"}
    return {**given, **params, "autoContinue": True, **more}


VERSION_1: dict[str, Any] = {
    "MAV_AUTOPILOT": 3,
    "version": "1.0",
    "items": [
        old(16, 47.0, 8.0, 100, number=1),
        old(18, 47.02, 8.0, 120, number=3, param1=2, param3=-150),
        old(177, 0, 0, 0, number=4, frame=2, param1=1, param2=1),
    ],
    "complexItems": [{"complexItemType": "survey", "id": 2, "polygon": []}],
    "plannedHomePosition": old(16, 47.0, 8.0, 400, number=0, frame=0),
}
VERSION_2: dict[str, Any] = {
    "fileType": "Mission",
    "version": 2,
    "items": [
        {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, 0], "coordinate": place}
        for place in ([47.0, 8.0, 100], [47.02, 8.0, 120])
    ],
    "plannedHomePosition": [47.0, 8.0, 400],
}


def read(path: Path, content: Any) -> PathAsGiven:
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return read_path(path)


def test_a_mission_of_version_1(tmp_path: Path) -> None:
    found = read(tmp_path / "m.mission", VERSION_1)
    assert found.mission is not None
    program = found.mission.program
    assert [step.item for step in program.steps] == [1, 3, 1, 3]
    loiter = program.steps[1].loiter
    assert loiter is not None
    assert (loiter.turns, loiter.radius_m, loiter.clockwise) == (2.0, 150.0, False)
    assert (program.steps[1].height_m, program.steps[1].above, found.mission.home_altitude_m) == (
        *(120.0, "home"),
        400.0,
    )
    assert found.notes == ("item 2, complex (survey): not flown, it has no items of its own",)


def test_a_mission_of_version_2(tmp_path: Path) -> None:
    found = read(tmp_path / "m.mission", VERSION_2)
    assert found.mission is not None
    assert [step.position for step in found.mission.program.steps] == [(47.0, 8.0), (47.02, 8.0)]
    assert found.mission.home_altitude_m == 400.0


@pytest.mark.parametrize("content", [{"fileType": "Mission"}, {**VERSION_2, "items": 1}, []])
def test_what_is_none_is_told(content: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"m\.mission: items: is missing"):
        read(tmp_path / "m.mission", content)


@pytest.mark.parametrize(
    ("more", "above"),
    [
        ({"altitudesAreRelative": True}, ["home", "home"]),
        ({"altitudesAreRelative": False}, ["sea", "sea"]),
        ({"loiterAltitudeRelative": False, "landAltitudeRelative": True}, ["sea", "home"]),
    ],
)
def test_a_landing_pattern_of_earlier_plans(more: dict[str, Any], above: list[str], tmp_path: Path) -> None:
    landing = {
        **{"type": "ComplexItem", "complexItemType": "fwLandingPattern", "landCoordinate": [47.0, 8.0, 0]},
        **{"loiterCoordinate": [47.01, 8.0, 40], "loiterRadius": 75, "loiterClockwise": False, **more},
    }
    mission = {"items": [*VERSION_2["items"], landing], "plannedHomePosition": [47.0, 8.0, 400]}
    found = read(tmp_path / "m.plan", {"fileType": "Plan", "mission": mission})
    assert found.mission is not None
    loiter, land = found.mission.program.steps[-2:]
    assert (loiter.position, loiter.height_m, land.position, land.landing) == (
        (47.01, 8.0),
        40,
        (47.0, 8.0),
        True,
    )
    assert loiter.loiter is not None
    assert (loiter.loiter.radius_m, loiter.loiter.clockwise) == (75.0, False)
    assert [loiter.above, land.above] == above


def test_a_mission_of_inav_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is XML, as INAV's missions are; save it as"):
        read(tmp_path / "m.mission", '<?xml version="1.0"?><MISSION/>')


@pytest.mark.parametrize("name", ["m.waypoints", "m.txt", "m.mission", "m.plan"])
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_mission_is_the_same_in_every_encoding_and_under_every_name(
    name: str, encoding: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_bytes(WPL.encode(encoding))
    found = read_path(path)
    assert found.mission is not None
    assert [step.position for step in found.mission.program.steps] == [(47.0, 8.0), (47.02, 8.0)]


def test_utf_16_from_the_big_end_and_xml(tmp_path: Path) -> None:
    path = tmp_path / "m.txt"
    path.write_bytes(codecs.BOM_UTF16_BE + WPL.encode("utf-16-be"))
    assert read_path(path).mission is not None
    path = tmp_path / "t.gpx"
    points = "".join(f'<trkpt lat="{47 + k / 100}" lon="8.0"/>' for k in range(3))
    text = f'<?xml version="1.0" encoding="UTF-16"?><gpx><trk><trkseg>{points}</trkseg></trk></gpx>'
    path.write_bytes(text.encode("utf-16"))
    assert len(read_path(path).points_m) == 3


def test_a_plan_whose_parameters_have_zeros_for_the_place_that_stands_beside_them(tmp_path: Path) -> None:
    items = [
        {"type": "SimpleItem", "command": 22, "frame": 3, "params": [0] * 7, "coordinate": [47.0, 8.0, 90]},
        {
            **{"type": "SimpleItem", "command": 16, "frame": 3},
            **{"params": [0, 0, 0, 0, 47.02, 8.0, 120], "coordinate": [47.02, 8.0, 120]},
        },
    ]
    mission = {"items": items, "plannedHomePosition": [46.9, 8.0, 400]}
    for name in ("m.plan", "m.json"):
        found = read(tmp_path / name, {"fileType": "Plan", "mission": mission})
        assert found.mission is not None
        steps = found.mission.program.steps
        assert [(step.position, step.height_m) for step in steps] == [((47.0, 8.0), 90), ((47.02, 8.0), 120)]
