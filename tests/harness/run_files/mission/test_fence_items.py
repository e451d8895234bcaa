"""Fences and rally points among the items of a mission."""

import json
from pathlib import Path

import pytest

from harness.run_files.mission.mission_files import read_plan, read_waypoints
from harness.run_files.path_files import read_path
from harness.world_files.kinds import read as read_world
from harness.world_files.parts import FileSpec
from tests.harness.run.given import written
from tests.harness.run_files.test_paths_io import refused
from wayproof import InputError, check

CORNERS = [(46.99, 7.99), (47.03, 7.99), (47.03, 8.01), (46.99, 8.01)]
PLACES = [(47.0, 8.0), (47.02, 8.0)]


def wpl(*items: tuple[int, float, float, float]) -> str:
    """A plain-text mission of items: command, first parameter, latitude, longitude."""
    rows = [
        f"{number}\t0\t{3 if number else 0}\t{command}\t{first}\t0\t0\t0\t{latitude}\t{longitude}\t100\t1"
        for number, (command, first, latitude, longitude) in enumerate(((16, 0, 47.0, 8.0), *items))
    ]
    return "\n".join(("QGC WPL 110", *rows)) + "\n"


WAYPOINTS = [(16, 0.0, *place) for place in PLACES]
INSIDE = [(5001, 4.0, *place) for place in CORNERS]
RALLY = [(5100, 0.0, 47.005, 8.0), (5100, 0.0, 47.015, 8.0)]


def test_fences_of_a_mission_are_fences_and_rally_points_are_named() -> None:
    every = (*WAYPOINTS, (5000, 0.0, 47.0, 8.0), *INSIDE, (5004, 50.0, 47.01, 8.005), *RALLY)
    items = [{"command": what, "frame": 3, "params": [first, 0, 0, 0, *at, 9]} for what, first, *at in every]
    plan = json.dumps({"fileType": "Plan", "mission": {"items": items, "plannedHomePosition": [47, 8, 0]}})
    for found in (read_waypoints(wpl(*every), "m.txt"), read_plan(plan, "m.plan")):
        assert [each.item for each in found.items] == [1, 2]
        inside, circle = found.fences.every
        assert (inside.inclusion, inside.rings, found.fences.inside_all) == (True, (tuple(CORNERS),), True)
        assert (circle.inclusion, circle.center, circle.radius_m) == (False, (47.01, 8.005), 50.0)
        assert found.notes == (
            "item 3, a return point, passed over: it is for after a breach",
            "2 rally points passed over: a return to launch is flown to home, not to the nearest of them",
        )


def test_a_fence_about_home(tmp_path: Path) -> None:
    (circle,) = read_waypoints(wpl(*WAYPOINTS, (5005, 50.0, 0.0, 0.0)), "m.txt").fences.every
    assert (circle.inclusion, circle.center, circle.radius_m) == (True, (47.0, 8.0), 50.0)
    path = written(tmp_path / "fence.txt", "QGC WPL 110\n0 0 0 5005 50 0 0 0 0 0 0 0\n")
    with pytest.raises(InputError, match="no items to fly to, but 1 fence item and 0 rally points"):
        check(path)
    with pytest.raises(InputError, match="is a fence about home, which has no position"):
        read_world(FileSpec(path))
    (part,) = read_world(FileSpec(written(path, wpl(*WAYPOINTS, (5005, 50.0, 0.0, 0.0))))).parts
    assert part.keep_in
    assert part.footprint.centroid.coords[0] == pytest.approx((8.0, 47.0), abs=1e-9)
    assert part.footprint.bounds[3] == pytest.approx(47.0 + 50.0 / 111_170.0, abs=1e-6)


@pytest.mark.parametrize(("firmware", "every"), [(12, False), (3, True), (0, True), (None, True)])
def test_check_and_world_agree_on_inclusion_fences(firmware: int | None, every: bool, tmp_path: Path) -> None:
    rings = [[[47.0, 8.0 + off], [47.1, 8.0 + off], [47.1, 8.1 + off]] for off in (0.0, 0.02)]
    places = [
        {"type": "SimpleItem", "command": 16, "frame": 0, "params": [0, 0, 0, 0, 47.05, lon, 500]}
        for lon in (8.03, 8.04)
    ]
    plan = {
        "fileType": "Plan",
        "mission": {"items": places, **({} if firmware is None else {"firmwareType": firmware})},
        "geoFence": {"polygons": [{"inclusion": True, "polygon": ring} for ring in rings]},
    }
    path = written(tmp_path / "m.plan", json.dumps(plan))
    assert read_path(path).fences.inside_all is every
    assert len(read_world(FileSpec(path)).parts) == 1 + every


def test_a_home_whose_altitude_is_not_above_the_sea_is_told() -> None:
    text = wpl(*WAYPOINTS)
    assert read_waypoints(text, "m").notes == ()
    for frame, noted in ((0, False), (2, False), (3, True), (10, True)):
        notes = read_waypoints(text.replace("0\t0\t0\t16", f"0\t0\t{frame}\t16", 1), "m").notes
        told = f"though of frame {frame}: its altitude, 100 m, is taken as above the sea"
        assert any(note.endswith(told) for note in notes) is noted


def test_a_first_item_that_is_no_waypoint_is_no_home(tmp_path: Path) -> None:
    lines = wpl((22, 15.0, 47.0, 8.0), *WAYPOINTS).splitlines()
    found = read_path(written(tmp_path / "m.waypoints", "\n".join((lines[0], *lines[2:]))))
    assert found.mission is not None
    assert [step.item for step in found.mission.steps] == [1, 2, 3]
    assert "has no home: altitudes above home are counted from the sea" in found.notes
    assert read_waypoints(wpl(*INSIDE, *WAYPOINTS).replace("\t16\t0", "\t5001\t5", 1), "m").fences.every


def test_items_are_counted_by_lines_where_their_numbers_leave_it_open() -> None:
    text = wpl(*WAYPOINTS, (16, 0.0, 47.04, 8.0), (177, 2.0, 0.0, 0.0))
    assert read_waypoints(text, "m").notes == ()
    head, *rows = text.splitlines()
    gap = "\n".join((head, *rows[:2], "9" + rows[2][1:], *rows[3:]))
    found = read_waypoints(gap, "m")
    assert [each.item for each in found.items] == [1, 2, 3, 4]
    assert "counted by lines from 0, as autopilots do" in found.notes[0]
    assert [each.item for each in read_waypoints(gap.rpartition("\n")[0], "m").items] == [1, 9, 3]
    for again in ("0", "1"):  # as ArduPilot's own missions of changes of the loiter radius have it
        twice = read_waypoints("\n".join((head, *rows[:2], again + rows[2][1:], *rows[3:])), "m")
        assert [each.item for each in twice.items] == [1, 2, 3, 4]
        assert twice.notes == ("some numbers of its items come twice: counted by lines from 0, as autopilots do",)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (wpl(*RALLY), "has no items to fly to, but 0 fence items and 2 rally points"),
        (wpl(*INSIDE, *RALLY[:1]), "no items to fly to, but 4 fence items and 1 rally point; `wayproof"),
        (wpl(*WAYPOINTS, *INSIDE[:3]), ":5: item 3 begins a fence of 4 corners, of which 3 follow"),
        (wpl(*WAYPOINTS, (5003, 0.0, 47.0, 8.0)), ":5: item 3 is a fence of radius 0 m"),
        ("47.0 8.0\n47.1 8.0\n", ":1: is '47.0 8.0'; must be \"QGC WPL 110\", as a mission begins"),
    ],
)
def test_what_is_no_mission_is_told(text: str, said: str, tmp_path: Path) -> None:
    assert said in refused(written(tmp_path / "m.txt", text))
