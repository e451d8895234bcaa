import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
import rerun as rr
from hypothesis import given
from hypothesis import strategies as st

from harness.analysis.breaches import compare
from harness.analysis.flight_limits import FlightLimits
from harness.analysis.metrics import metrics
from harness.cli.app import main
from harness.files.errors import RunFolderError
from harness.flight.observer import Caution, ShieldState
from harness.flight.record import AcceptedPlan, Flight, Outcome
from harness.mapping.scan import RangeScan
from harness.recording import viewer
from harness.recording.blueprint import ERROR_COLOURS, Scene
from harness.recording.log import RerunLog
from harness.recording.overlay import runs_in, write_overlay
from harness.recording.scene import quaternions
from harness.recording.summary import summary
from harness.recording.viewer import NO_DRIVER, ViewerError, _executable, open_viewer, run_names
from harness.run_files.fences import Fences
from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world.world import World
from planner.interface import FloatArray, MovingEdges
from tests.harness.conftest import plan as make_plan
from tests.harness.conftest import track as make_track
from tests.page import NoBrowserError, browser
from tests.pictures import screenshot, served
from tests.refusals import refused
from wayproof import AircraftState, InputError, Mission, Plan, PlanPicture, PlanStatus
from wayproof import Path as PlannedPath

MISSION = Mission(
    goal_m=(0.0, 2500.0), goal_radius_m=50.0, bounds_m=(-2000.0, -1000.0, 2000.0, 3000.0), clearance_m=100.0,
    turn_radius_m=110.0, speed_mps=25.0, roll_in_s=0.6, tracking_error_m=0.5, sensor_range_m=800.0,
)  # fmt: skip
OBSTACLES = (
    Obstacle(Circle((600.0, 1250.0), 300.0)),
    Obstacle(Polygon(((-1500.0, 500.0), (-500.0, 500.0), (-500.0, 1500.0), (-1000.0, 800.0)))),
    Obstacle(Circle((1000.0, 2500.0), 100.0), velocity_mps=(-2.0, 0.0)),
    Obstacle(Circle((-1000.0, 2500.0), 100.0), active_s=(20.0, 60.0)),
)
LIMITS = FlightLimits(300.0, 100.0, 0.78, 110.0)
SCENE = Scene("straight, none, aerosonde, seed 1", MISSION, (0.0, 0.0), LIMITS, OBSTACLES, "name: straight\n")
PICTURE = PlanPicture(
    guide_m=np.array([[0.0, 0.0], [0.0, 800.0]]),
    window_m=700.0,
    sectors=np.array([[1.0, 0.0, 0.0, 1.0]]),
    candidates=(np.array([[0.0, 0.0], [0.0, 700.0]]), np.array([[0.0, 0.0], [200.0, 600.0]])),
    met_m=np.array([[100.0, 300.0], [110.0, 300.0]]),
)
STATE = AircraftState(0.0, 0.0, 0.0, 300.0, 0.0, 25.0, 0.0, 0.0, 0.0, 0.0, 25.0, 1.0)

Columns = dict[str, list[Any]]


def scan(time_s: float) -> RangeScan:
    ranges = np.array([100.0, np.inf, 200.0, np.inf])
    fan = np.array([1.0, -1.0j, -1.0, 1.0j])
    return RangeScan(time_s, time_s, 5.0, 7.0, 0.0, math.pi / 2, math.pi / 2, fan, ranges, 800.0)


def record(path: Path, east_m: float = 0.0, told: Sequence[str] = ("goal reached",), rows: int = 1001) -> Flight:
    """100 s north, or as many rows of it, in blocks of 30 s, one scan every 0.5 s, a plan at 0 s and one at 50 s."""
    track = make_track(1001, east_m=east_m, clearance_m=np.where(np.arange(1001) < 200, np.inf, 150.0))
    first = replace(make_plan([(0, 0, 0, 1, 0.0, 2500.0)], picture=lambda: PICTURE), scan_s=0.0)
    second = replace(make_plan([(0, 1250, 0, 1, 0, 625), (0, 1875, 0, 1, 0, 625)], index=1, time_s=50.0), scan_s=48.5)
    log = RerunLog(path, SCENE, recording_id="a")
    for tick in range(200):
        log.on_scan(scan(0.5 * tick), STATE)
        for plan in (first, second):
            if plan.time_s == 0.5 * tick:
                log.on_plan(plan, STATE)
    for text in told:
        log.on_event(99.9, text)
    for start in range(0, rows, 300):
        log.on_block(track.part(start, min(start + 300, rows)))
    flight = Flight(track, (first, second), Outcome.REACHED, "in the goal's circle", (2.5, 2.5), 100.0, 0.1)
    log.close(metrics(flight, LIMITS), {"outcome": "reached", "flight_time_s": 0.1 * (rows - 1)})
    return flight


@pytest.fixture
def recording(tmp_path: Path) -> tuple[Path, Flight]:
    (tmp_path / "run").mkdir()
    path = tmp_path / "run" / "flight.rrd"
    return path, record(path)


def read(path: Path) -> dict[str, Columns]:
    """All rows of a recording, by entity and column, in the order of logging."""
    entities: dict[str, Columns] = {}
    chunks = [
        (chunk.entity_path, chunk.to_record_batch().to_pydict())
        for chunk in rr.chunk.RrdReader(str(path)).stream().to_chunks()
    ]
    for entity, rows in sorted(chunks, key=lambda chunk: chunk[1]["rerun.controls.RowId"][0]):
        for name, values in rows.items():
            entities.setdefault(entity, {}).setdefault(name, []).extend(values)
    return entities


def column(entities: dict[str, Columns], entity: str, ending: str) -> list[Any]:
    (values,) = (values for name, values in entities[entity].items() if name.endswith(ending))
    return values


def numbers(entities: dict[str, Columns], entity: str, ending: str = "scalars") -> FloatArray:
    return np.array(column(entities, entity, ending), dtype=np.float64)


def texts(entities: dict[str, Columns], entity: str, ending: str = "text") -> list[str]:
    return [str(text) for (text,) in column(entities, entity, ending)]


def seconds(entities: dict[str, Columns], entity: str) -> list[float]:
    return [time.total_seconds() for time in entities[entity]["sim_time"]]


def test_series_hold_the_track(recording: tuple[Path, Flight]) -> None:
    entities, track = read(recording[0]), recording[1].track
    shown = {
        "cross_track/flown": track.cross_track_m, "bank/pitch": track.pitch_deg, "bank/flown": track.roll_deg,
        "bank/commanded": track.roll_command_deg, "speed/ground": track.groundspeed_mps,
        "speed/flown": track.airspeed_mps, "altitude_error/flown": track.up_m - 300.0,
        "throttle/flown": np.full(1001, 50.0),
    }  # fmt: skip
    for entity, values in shown.items():
        np.testing.assert_array_equal(numbers(entities, f"/series/{entity}").ravel()[-1001:], values)
    limit_deg = math.degrees(0.78)
    for entity, value in {"clearance/wanted": [100.0], "bank/limit": [-limit_deg, limit_deg]}.items():
        level = numbers(entities, f"/series/{entity}")
        np.testing.assert_allclose(level, np.tile(value, (len(level), 1)))
        first_s, *_, last_s = seconds(entities, f"/series/{entity}")
        assert (first_s, last_s) == (0, 100)
    assert numbers(entities, "/series/search/flown").ravel().tolist() == [2.5, 2.5]
    assert numbers(entities, "/series/plan_delay/flown").ravel().tolist() == [0.0, 1.5]
    clearance = numbers(entities, "/series/clearance/flown").ravel()
    assert np.isnan(clearance[:200]).all()
    assert (clearance[200:] == 150.0).all()
    assert seconds(entities, "/series/bank/flown")[:2] == [0.0, 0.1]
    assert seconds(entities, "/series/bank/flown")[-1] == 100.0


def test_a_path_that_climbs_is_drawn_and_held_against_at_its_altitudes(tmp_path: Path) -> None:
    scene = replace(SCENE, profile=lambda along: 300.0 + 0.1 * along)
    log = RerunLog(tmp_path / "flight.rrd", scene, recording_id="a")
    log.on_plan(make_plan([(0, 0, 0, 1, 0.0, 2500.0)]), STATE)
    log.on_block(track := make_track(101))
    log.close()
    entities = read(tmp_path / "flight.rrd")
    error = numbers(entities, "/series/altitude_error/flown").ravel()
    np.testing.assert_allclose(error, track.up_m - 300.0 - 0.1 * track.arc_length_m)
    ((strip,),) = column(entities, "/world/chosen", "strips")
    np.testing.assert_allclose(np.array(strip)[[0, -1]], [[0.0, 0.0, 300.0], [0.0, 2500.0, 550.0]])


def test_pose_and_trail_follow_the_track(recording: tuple[Path, Flight]) -> None:
    entities = read(recording[0])
    position = numbers(entities, "/world/aircraft", "translation").reshape(-1, 3)
    np.testing.assert_allclose(position, np.column_stack((np.zeros(1001), np.arange(1001) * 2.5, np.full(1001, 300.0))))
    times = seconds(entities, "/plan/flown")
    pieces = column(entities, "/plan/flown", "strips")
    assert times[-1] == 100.0
    assert max(np.diff([0.0, *times])) <= 1.0 + 1e-9
    ends = [strip[-1] for (strip,) in pieces]
    np.testing.assert_allclose(ends, [(0.0, 25.0 * time) for time in times], atol=1e-3)
    np.testing.assert_array_equal([strip[0] for (strip,) in pieces][1:], ends[:-1])


def test_scans_are_drawn_as_the_aircraft_goes_on(recording: tuple[Path, Flight]) -> None:
    entities = read(recording[0])
    times = seconds(entities, "/plan/scan")
    assert (times[:3], 50.0 in times) == ([0.0, 2.0, 4.0], True)
    assert column(entities, "/plan/scan", "positions")[0] == [[105.0, 7.0], [-195.0, 7.0]]


def test_what_two_scans_have_shown_is_marked_once(tmp_path: Path) -> None:
    """The near edge of the circle from 5 s on, and at 5 s something that is not there."""
    near, false = (300.0, 1250.0), (-300.0, 0.0)
    log = RerunLog(tmp_path / "a.rrd", SCENE, "a")
    for time_s, points in ((0.0, []), (5.0, [near, false]), (10.0, [near]), (15.0, [near])):
        ranges = np.abs(away := np.array([complex(*point) for point in points], dtype=complex))
        log.on_scan(RangeScan(time_s, time_s, 0.0, 0.0, 0.0, 0.0, 0.1, away / ranges, ranges, 2000.0), STATE)
    log.on_block(make_track(201, plan_index=-1))
    log.close()
    entities = read(tmp_path / "a.rrd")
    assert seconds(entities, "/plan/sensed") == seconds(entities, "/world/sensed") == [0.0, 5.0, 10.0, 15.0]
    np.testing.assert_array_equal(column(entities, "/plan/sensed", "positions")[2], [near])
    assert [len(row) for row in column(entities, "/plan/sensed", "positions")] == [0, 0, 1, 0]
    (post,) = column(entities, "/world/sensed", "strips")[2]
    np.testing.assert_allclose(post, [(*near, 0.0), (*near, SCENE.obstacle_top_m)], rtol=1e-6)


def test_what_should_not_happen_is_a_warning(tmp_path: Path) -> None:
    """Nearer than the wanted 100 m from 5 to 15 s, over two blocks; 102 m at 10 s is not yet clear."""
    row = np.arange(201)
    clearance_m = np.where((row < 50) | (row > 150), 300.0, np.where(row == 100, 102.0, 80.0))
    clearance_m[120] = 62.5
    track = make_track(201, clearance_m=clearance_m, plan_index=-1)
    log = RerunLog(tmp_path / "a.rrd", SCENE, "a")
    for start in (0, 60):
        log.on_block(track.part(start, 60 if start == 0 else 201))
    log.on_event(18.0, Caution("no way on"))
    log.on_event(20.0, "reached: inside the goal circle")
    log.close()
    entities = read(tmp_path / "a.rrd")
    assert list(zip(texts(entities, "/events"), texts(entities, "/events", "level"), strict=True)) == [
        ("t = 5 s: nearer to an obstacle than the wanted 100 m", "WARN"),
        ("t = 15 s: clear of the obstacle again, after 62.5 m at the least", "INFO"),
        ("t = 18 s: no way on", "WARN"),
        ("t = 20 s: reached: inside the goal circle", "INFO"),
    ]


def test_the_trail_shows_the_error_by_its_colour(tmp_path: Path) -> None:
    row = np.arange(101)
    error = np.where((row < 50) & (row != 20), 0.0, -2.0 * LIMITS.cross_track_threshold_m)
    log = RerunLog(tmp_path / "a.rrd", SCENE, "a")
    log.on_block(make_track(101, cross_track_m=error, plan_index=-1))
    log.close()
    colours = [rgba >> 8 for (rgba,) in column(read(tmp_path / "a.rrd"), "/plan/flown", "colors")]
    on, _, off = ((red << 16) + (green << 8) + blue for red, green, blue in ERROR_COLOURS)
    assert [colour == off for colour in colours[:5]] == [False, False, True, False, False], "the worst counts"
    assert {colours[0], colours[4]} == {on}
    assert set(colours[5:]) == {off}


def test_states_follow_plans_bank_and_verdicts(tmp_path: Path) -> None:
    """A plan to 5 s of flight, then its closing circle; at the bank limit from 8 s on."""
    circle = (0, 125.0, 0, 1, 0.01, 200 * math.pi)
    path = PlannedPath(np.array([(0, 0, 0, 1, 0.0, 125.0), circle]), loiter=True)
    plan = Plan(PlanStatus.FOUND, "obstacle ahead at 9.8 km, passing left", path=path)
    rows = np.arange(101)
    track = make_track(
        101,
        plan_index=np.where(rows < 10, -1, 0),
        arc_length_m=np.where(rows < 10, np.nan, 2.5 * rows),
        roll_command_deg=np.where(rows < 80, 0.0, math.degrees(LIMITS.bank_limit_rad)),
        cross_track_m=np.where(rows < 90, 0.0, 25.0),
    )
    log = RerunLog(tmp_path / "a.rrd", SCENE, "a")
    accepted = AcceptedPlan(0, 1.0, 2.5, plan)
    log.on_plan(accepted, STATE)
    log.on_event(5.5, ShieldState("backup: stuck 12 m ahead"))
    log.on_event(7.0, ShieldState("nominal"))
    log.on_block(track)
    log.close(metrics(Flight(track, (accepted,), Outcome.TIMEOUT, "late", (2.5,), 10.0, 0.1), LIMITS))
    entities = read(tmp_path / "a.rrd")
    lanes = {
        lane: list(zip(seconds(entities, f"/states/{lane}")[-len(states) :], states, strict=True))
        for lane in ("planner", "saturation", "shield", "tracking")
        for states in [[str(cell[0]) for cell in column(entities, f"/states/{lane}", "state") if cell]]
    }
    assert lanes["planner"] == [
        (0.0, "waiting for a plan"),
        (1.0, "obstacle ahead at … km, passing left"),
        (5.1, "holding"),
    ]
    assert lanes["shield"] == [(0.0, "nominal"), (5.5, "backup: stuck … m ahead"), (7.0, "nominal")]
    assert lanes["saturation"] == [(0.0, "bank command below its limit"), (8.0, "bank command at its limit")]
    ((start, cause),) = lanes["tracking"]
    assert (start, cause == "trackable") == (1.0, False)


def test_plan_is_drawn_with_how_it_came_about(recording: tuple[Path, Flight]) -> None:
    entities = read(recording[0])
    assert seconds(entities, "/plan/chosen") == [0.0, 50.0]
    assert column(entities, "/plan/chosen", "strips")[1] == [[[0.0, 1250.0], [0.0, 1875.0], [0.0, 2500.0]]]
    assert column(entities, "/plan/waypoints", "positions")[0] == [[0.0, 0.0]]
    assert column(entities, "/plan/guide", "vectors")[0] == [[0.0, 800.0]]
    assert column(entities, "/plan/candidates", "strips")[0] == [[[0.0, 0.0], [200.0, 600.0]]]
    (window,), (sector,) = (column(entities, f"/plan/{name}", "strips")[0] for name in ("window", "sectors"))
    np.testing.assert_allclose(np.hypot(*np.array(window).T), 700.0, rtol=1e-6)
    np.testing.assert_allclose([sector[0], sector[1], sector[-2]], [[0, 0], [700, 0], [0, 700]], atol=1e-3)
    assert column(entities, "/plan/candidates", "strips")[1] == [[[0.0, 1250.0], [0.0, 1875.0]]], "waypoints"
    for entity, part in (("guide", "vectors"), ("window", "strips"), ("sectors", "strips")):
        assert seconds(entities, f"/plan/{entity}") == [0.0, 50.0]
        assert column(entities, f"/plan/{entity}", part)[1] == [], "cleared where the planner shows nothing"


def test_what_the_map_takes_to_move_is_shown_until_it_is_lost(tmp_path: Path) -> None:
    """Known from 5 to 20 s, at 2 Hz."""
    known: list[MovingEdges] = []
    log = RerunLog(tmp_path / "a.rrd", SCENE, "a", moving=lambda: known)
    for tick in range(60):
        time_s = 0.5 * tick
        outline = np.array([(10.0 * time_s, 0.0), (10.0 * time_s + 20.0, 0.0), (10.0 * time_s + 40.0, 30.0)])
        known[:] = [MovingEdges(time_s, outline, (10.0, -1.0))] if 5.0 <= time_s <= 20.0 else []
        log.on_scan(scan(time_s), STATE)
    log.on_block(make_track(301, plan_index=-1))
    log.close()
    entities = read(tmp_path / "a.rrd")
    assert seconds(entities, "/plan/tracked") == [*np.arange(5.0, 20.5), 20.5]
    assert column(entities, "/plan/tracked", "strips")[3] == [[[80.0, 0.0], [100.0, 0.0], [120.0, 30.0]]]
    assert column(entities, "/plan/tracked/velocity", "origins")[3] == [[100.0, 10.0]]
    assert column(entities, "/plan/tracked/velocity", "vectors")[3] == [[300.0, -30.0]]
    for entity, part in (("tracked", "strips"), ("tracked/velocity", "vectors")):
        assert column(entities, f"/plan/{entity}", part)[-1] == [], "cleared when it is lost"


def test_events_and_summary(recording: tuple[Path, Flight]) -> None:
    entities = read(recording[0])
    assert texts(entities, "/events") == [
        "t = 0 s: a way was found (plan 0, 2.5 ms)",
        "t = 50 s: a way was found (plan 1, 2.5 ms, 1.5 s after its scan)",
        "t = 100 s: goal reached",
    ]
    first, *_, last = texts(entities, "/summary")
    assert "stopped before the end" in first
    assert not last.startswith("#"), "a heading leaves a low view no room for figures"
    for told in (
        "**reached**: in the goal's circle",
        "| flown length | 2.5 km |",
        "| flight time | 100.0 s |",
        "name: straight",
    ):
        assert told in last
    assert json.loads(column(entities, "/__properties/metrics", "json")[0][0])["outcome"] == "reached"


def test_the_summary_of_a_given_path_leads_with_the_verdict(recording: tuple[Path, Flight]) -> None:
    """That the aircraft reached the end of the path is no answer."""
    figures = {**metrics(recording[1], LIMITS), "check": {"verdict": "no: turn radius too tight (2 legs)"}}
    legs = [{**each, "trackable": True} for each in figures["trackability"]]
    assert "no: end or" in summary(SCENE, figures | {"trackable": False, "trackability": legs})
    page = summary(SCENE, figures)
    assert page.index("**Flown as given: no: turn radius too tight (2 legs)**") < page.index("**reached**")
    assert "as given" not in summary(SCENE, metrics(recording[1], LIMITS))
    unwanted = replace(SCENE, limits=replace(LIMITS, clearance_m=0.0))
    figures |= {"min_clearance_m": -4.0, "clearance_violation_s": 12.3}
    assert f" -4 m of {LIMITS.clearance_m:g} m; 12.3 s below " in summary(SCENE, figures)
    assert " -4 m; 12.3 s inside " in summary(unwanted, figures)
    figures |= {"min_clearance_m": None, "min_altitude_above_ground_m": -7.0}
    assert " -7 m above ground " in summary(SCENE, figures)


def test_what_a_campaign_varied_is_in_every_recording_of_a_process(tmp_path: Path) -> None:
    """Two campaigns may write a value of one key as 0 and as 5.5."""
    for varied, kept in ((0, 0.0), (5.5, 5.5), (True, True), ("a", "a")):
        log = RerunLog(tmp_path / f"{varied}.rrd", SCENE, recording_id="a")
        log.close(varied={"planner.some_key": varied})
        found = column(read(tmp_path / f"{varied}.rrd"), "/__properties/varied", "planner.some_key")
        assert [(type(value), value) for (value,) in found] == [(type(kept), kept)]


def test_a_contact_is_marked_and_told_where_it_was(tmp_path: Path, recording: tuple[Path, Flight]) -> None:
    """At 25 m/s north the centre of the circle, 30 m aside, is passed after 50 s, 10 m inside its radius of 40 m."""
    circle = World([Obstacle(Circle((30.0, 1250.0), 40.0))], MISSION.bounds_m)
    clear_m = np.hypot(30.0, recording[1].track.north_m - 1250.0) - 40.0
    track = make_track(1001, clearance_m=clear_m, plan_index=-1)
    (contact,) = compare(track, circle, Fences(), True).contacts
    figures = {**metrics(recording[1], LIMITS), "outcome": "collision", "contacts": [vars(contact)]}
    ring, around = [[-10.0, 0.0], [10.0, 0.0], [10.0, 20.0]], {"center_m": [0.0, 0.0], "radius_m": 50.0}
    fences = [{"kind": "exclusion", "rings_m": [ring]}, {"kind": "inclusion", **around}]
    figures |= {"check": {"fences": fences, "verdict": "no"}, "shield": {"interventions": 0}}
    log = RerunLog(tmp_path / "a.rrd", SCENE, recording_id="a")
    log.on_block(track)
    log.on_event(99.9, "the end")
    log.close(figures)
    entities = read(tmp_path / "a.rrd")
    assert column(entities, "/world/end", "positions") == [[[0.0, 1250.0, 300.0]]]
    assert column(entities, "/states/shield", "state") == [["nominal"]]
    assert column(entities, "/plan/end/label", ":labels") == [["obstacles[0]"]]
    ((drawn, circled),) = column(entities, "/plan/fences", "strips")
    assert drawn == [*ring, ring[0]]
    assert np.hypot(*np.transpose(circled)) == pytest.approx(50.0)
    told = dict(zip(texts(entities, "/events"), seconds(entities, "/events"), strict=True))
    enters_s = 50.0 - math.sqrt(40.0**2 - 30.0**2) / 25.0
    assert told["t = 49 s: obstacle: 10 m into obstacles[0]"] == pytest.approx(enters_s, abs=0.11)


def test_obstacles_stand_move_and_come_and_go(recording: tuple[Path, Flight]) -> None:
    entities = read(recording[0])
    (centre,) = column(entities, "/world/true_obstacles/circles", "centers")[0]
    assert tuple(centre[:2]) == (600.0, 1250.0)
    faces = np.array(column(entities, "/world/true_obstacles/polygons", "triangle_indices")[0])
    corners = np.array(column(entities, "/world/true_obstacles/polygons", "vertex_positions")[0])
    edge = corners[faces[:, 1]] - corners[faces[:, 0]], corners[faces[:, 2]] - corners[faces[:, 0]]
    cross = 0.5 * np.cross(*edge)
    assert cross[:, 2].sum() == pytest.approx(400000.0, rel=1e-5), "roof: the polygon's area, seen from above"
    assert corners[:, 2].min() == 0.0
    assert corners[:, 2].max() > 300.0
    moved = numbers(entities, "/world/moving/2", "translation").reshape(-1, 3)
    assert seconds(entities, "/world/moving/2")[-1] == 100.0
    np.testing.assert_allclose(moved[-1], [-200.0, 0.0, 0.0])
    assert seconds(entities, "/plan/moving/3") == [20.0, 60.0]
    assert column(entities, "/plan/moving/3", "is_recursive")[-1] == [True]


def test_recording_is_sound_and_has_its_layout(recording: tuple[Path, Flight]) -> None:
    path, _ = recording
    verify = [_executable(), "rrd", "verify", str(path)]
    done = subprocess.run(verify, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    reader = rr.chunk.RrdReader(str(path))
    assert len(reader.blueprints()) == 1
    assert [entry.application_id for entry in reader.recordings()] == ["wayproof"]
    layout = [chunk.entity_path for chunk in reader.stream(store=reader.blueprints()[0]).to_chunks()]
    assert len([entity for entity in layout if entity.endswith("/ViewContents")]) == 14
    drawn = re.findall("overrides/(plan|world)/(flown|believed|sensed)/", "\n".join(layout))
    assert len(drawn) == 6, "in both views up to the cursor"
    entities = read(path)
    times = [seconds(entities, each) for each, rows in entities.items() if "sim_time" in rows]
    assert (min(map(min, times)), max(map(max, times))) == (0.0, 100.0), "none before zero, or after the end"


def test_overlay_keeps_every_track_and_one_world(tmp_path: Path) -> None:
    for name, east_m, rows in (("a", 0.0, 300), ("b", 40.0, 1001)):
        record(tmp_path / f"{name}.rrd", east_m, rows=rows)
    assert seconds(read(tmp_path / "a.rrd"), "/plan/moving/2")[-1] == 29.9, "drawn where it ended"
    write_overlay([tmp_path / "a.rrd", tmp_path / "b.rrd"], ["first", "bug2+shield"], tmp_path / "c.rrd")
    entities = read(tmp_path / "c.rrd")
    for number, east_m in enumerate((0.0, 40.0)):
        assert column(entities, f"/world/runs/{number}/aircraft", "translation")[0][0][0] == east_m
        assert len(column(entities, f"/series/bank/flown/{number}", "scalars")) >= (300, 1001)[number]
    assert "/world/true_obstacles/circles" in entities
    moved = numbers(entities, "/plan/moving/2", "translation").reshape(-1, 3)
    np.testing.assert_allclose(moved[-1], [-200.0, 0.0, 0.0], err_msg="moves on when the first has ended")
    assert seconds(entities, "/plan/moving/3") == [20.0, 60.0]
    assert "/plan/chosen" not in entities
    for own, end_s in (("1-first", 29.9), ("2-bug2-shield", 100.0)):
        for lane in (f"/states/{own}/planner", f"/states/{own}/tracking"):
            assert (column(entities, lane, "state")[-1], seconds(entities, lane)[-1]) == (["over"], end_s)
    for place, (name, rgba) in enumerate((("first", 0xFFB340FF), ("bug2+shield", 0x40C4FFFF))):
        # One entity a run: rerun's log takes colours from the wrong run where they share one.
        told = texts(entities, f"/events/{place}")
        assert told[-1] == f"{name}, t = 100 s: goal reached"
        assert {text.partition(",")[0] for text in told} == {name}
        assert {colour for (colour,) in column(entities, f"/events/{place}", "color")} == {rgba}
    assert "/events" not in entities
    assert "| outcome | reached | reached |" in texts(entities, "/summary")[-1]
    colours = [column(entities, f"/plan/runs/{number}/flown", "colors")[-1] for number in (0, 1)]
    assert colours[0] != colours[1]


@pytest.mark.flights
def test_an_overlay_says_which_runs_are_of_other_worlds(tmp_path: Path) -> None:
    """Of a campaign that draws worlds two runs would be shown among the obstacles of one."""
    elsewhere = replace(SCENE, obstacles=(Obstacle(Circle((500.0, 1250.0), 300.0)),))
    for thin in (False, True):
        for name, scene in (("a", SCENE), ("b", SCENE), ("c", elsewhere)):
            log = RerunLog(tmp_path / f"{name}.rrd", scene, name, thin=thin)
            log.on_block(track := make_track(11, plan_index=-1))
            log.close(metrics(Flight(track, (), Outcome.TIMEOUT, "x", (), 1.0, 1.0), LIMITS))
        paths = [tmp_path / f"{name}.rrd" for name in "abc"]
        assert column(read(paths[0]), "/plan/moving/2", "translation")[-1] == [[-2.0, 0.0, 0.0]]
        told = write_overlay(paths, ["first", "second", "third"], tmp_path / "over.rrd")
        assert told == "The obstacles are those of first; third was flown in another world."
        assert texts(read(tmp_path / "over.rrd"), "/summary")[-1].startswith(f"**{told}**")
        assert write_overlay(paths[:2], ["first", "second"], tmp_path / "same.rrd") == ""


@pytest.mark.parametrize(
    ("folders", "names"),
    [
        (["runs/a", "runs/b"], ["a", "b"]),
        (["one/bug2-1", "two/bug2-1"], ["one/bug2-1", "two/bug2-1"]),
        (["one/x/run", "two/x/run", "two/y/run"], ["one/x/run", "two/x/run", "two/y/run"]),
    ],
)
def test_overlaid_runs_have_names_of_their_own(folders: list[str], names: list[str]) -> None:
    assert run_names([Path(folder) for folder in folders]) == names


def test_view_says_what_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for screen in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(screen, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    assert f"{tmp_path} has no flight.rrd" in refused("view", tmp_path)
    (tmp_path / "flight.rrd").write_bytes(b"not a recording")
    assert "recording" in refused("view", tmp_path, tmp_path, "--web")
    assert main(["view", str(tmp_path)]) == 1
    assert "no screen" in (said := capsys.readouterr().err)
    assert "`wayproof view --web`" in said


@pytest.mark.flights
def test_a_comparison_is_viewed_as_its_overlay(
    recording: tuple[Path, Flight], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder, or the overlay itself, which no run folder is beside."""
    shown: list[Path] = []

    @contextmanager
    def nobody(*given: object) -> Iterator[Any]:
        yield SimpleNamespace(wait=lambda: 0), "address"

    monkeypatch.setattr(viewer, "empty_viewer", nobody)
    monkeypatch.setattr(viewer, "send_recording", lambda rrd, address: shown.append(rrd))
    overlay = tmp_path / "straight" / "overlay.rrd"
    overlay.parent.mkdir()
    write_overlay([recording[0], recording[0]], ["first", "second"], overlay)
    for path in (tmp_path, overlay.parent, overlay):
        open_viewer([path], web=True)
    assert shown == [overlay] * 3
    assert runs_in(list(read(overlay))) == ["runs/0/", "runs/1/"]
    assert runs_in(list(read(recording[0]))) == [""]
    with pytest.raises(InputError, match="a recording is opened alone; run folders are overlaid"):
        open_viewer([recording[0].parent, overlay], web=True)
    with pytest.raises(InputError, match="no such file"):
        open_viewer([tmp_path / "none.rrd"], web=True)
    shutil.copytree(overlay.parent, tmp_path / "turned")
    with pytest.raises(RunFolderError, match=r"compares several scenarios; name one of .*overlay\.rrd, "):
        open_viewer([tmp_path], web=True)


@pytest.mark.flights
def test_the_browsers_page_talks_to_this_machine_only(recording: tuple[Path, Flight], tmp_path: Path) -> None:
    def asked_for(address: str) -> list[str]:
        with browser() as chromium:
            page = chromium.new_page()
            asked: list[str] = []
            page.on("request", lambda request: asked.append(request.url))
            with page.expect_response("**/*.wasm") as wasm:
                page.goto(address)
            assert wasm.value.ok
            page.wait_for_timeout(5000)
            return asked

    with served(recording[0]) as (_, address), ThreadPoolExecutor(1) as thread:
        try:
            # Another test may have left an event loop in this thread.
            asked = thread.submit(asked_for, address).result()
        except NoBrowserError as missing:
            pytest.skip(str(missing))
    hosts = {urlsplit(url).hostname for url in asked if not url.startswith(("data:", "blob:"))}
    assert hosts == {"127.0.0.1"}


@pytest.mark.flights
def test_views_draw_without_complaint(recording: tuple[Path, Flight]) -> None:
    path, _ = recording
    png = path.with_suffix(".png")
    try:
        complaints = screenshot(path, png, time_s=50.0, size=(1200, 700))
    except ViewerError as error:
        assert str(error) == NO_DRIVER  # noqa: PT017
        return
    assert complaints == []
    assert png.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert int.from_bytes(png.read_bytes()[16:20]) == 1200


def test_wind_is_drawn_along_its_way_and_named(tmp_path: Path) -> None:
    """From 300 deg it blows towards 120 deg: 0.866 east, -0.5 north."""
    windy = replace(SCENE, wind=(300.0, "wind 8 m/s from 300 deg at 10 m"))
    RerunLog(tmp_path / "flight.rrd", windy, "a").close()
    entities = read(tmp_path / "flight.rrd")
    (arrow,), *_ = column(entities, "/plan/wind", "LineStrips2D:strips")
    along = np.array(arrow[1]) - arrow[0]
    assert along / np.hypot(*along) == pytest.approx([0.866, -0.5], abs=1e-3)
    assert column(entities, "/plan/wind", "LineStrips2D:labels") == [["wind 8 m/s\nfrom 300 deg\nat 10 m"]]
    assert "Wind 8 m/s from 300 deg at 10 m." in summary(windy, None)


@given(heading=st.floats(0.0, 360.0), pitch=st.floats(-80.0, 80.0), roll=st.floats(-180.0, 180.0))
def test_attitude_points_nose_and_wing_the_right_way(heading: float, pitch: float, roll: float) -> None:
    """Nose: heading from north and pitch up. Left wing: up by sin(roll) cos(pitch) in a right bank."""
    ((x, y, z, w),) = quaternions(np.array([heading]), np.array([pitch]), np.array([roll]))
    nose = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    left = np.array([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)])
    h, p, r = np.radians((heading, pitch, roll))
    np.testing.assert_allclose(nose, [np.sin(h) * np.cos(p), np.cos(h) * np.cos(p), np.sin(p)], atol=1e-9)
    assert left[2] == pytest.approx(np.sin(r) * np.cos(p), abs=1e-9)
