"""`replay`: the wind against one that was put in, measures against shapely-free geometry, Thor against its own json."""

import json
import math
import struct
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rerun.chunk import RrdReader

import wayproof
from aircraft.frames import LocalPlane
from harness.cli.app import main
from harness.recording.overlay import send_recording
from harness.replays.flown import FlownFlight, read_flown
from harness.replays.measures import rows_of
from harness.replays.mission import mission_of_log, read_mission
from harness.replays.wind import fit_wind, fit_windows
from tests.harness.replays.test_logs import FORMATS, form
from tests.refusals import refused

FLOWN = Path(__file__).parents[4] / "shared" / "flown"
needs_flown = pytest.mark.skipif(not (FLOWN / "thor75.json").is_file(), reason="shared/flown is not here")
SQUARE = [[0, 0], [150, 0], [150, 150], [0, 150]]
JUMP_AND_LANDING = "5 0 3 177 1 2 0 0 0 0 0 1\n6 0 3 21 0 0 0 0 45.4 -93.2 0 1\n"
TRUE_SHARE = math.sqrt(1.225 / 1.19011)  # true over indicated airspeed at 300 m: densities of ISO 2533


def circles(tmp_path: Path, wind: tuple[float, float], laps: int = 4) -> tuple[Path, Path]:
    """A log of circles through the air at 18 m/s that drift not: about the middle of a square, in a wind."""
    time_s = np.arange(0.0, 40.0 * laps, 0.1)
    angle = math.tau * time_s / 40.0
    air = 18.0
    through = np.array([np.cos(angle), np.sin(angle)])  # over the ground; speed by the wind triangle
    along = through.T @ np.array(wind)
    speed = along + np.sqrt(along**2 - (wind[0] ** 2 + wind[1] ** 2) + air**2)
    columns = {
        "time_s": time_s,
        "east_m": 75.0 + 90.0 * np.sin(angle),
        "north_m": 75.0 - 90.0 * np.cos(angle),
        "up_m": np.full_like(time_s, 300.0),
        "ve_mps": speed * through[0],
        "vn_mps": speed * through[1],
        "airspeed_tas_mps": np.full_like(time_s, air),
        "lap": 1.0 + np.floor(time_s / 40.0),
    }
    log, mission = tmp_path / "log.parquet", tmp_path / "mission.json"
    pq.write_table(pa.table(columns), log)
    keys = {"corners_east_north_m": SQUARE, "acceptance_radius_m": 45.0, "bank_limit_deg": 45.0}
    keys["airspeed_command_ias_mps"] = air / TRUE_SHARE
    mission.write_text(json.dumps({"mission": keys, "origin": "not read"}))
    return log, mission


def test_a_wind_that_was_put_in_is_found_and_measures_are_those_of_geometry(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, mission = circles(tmp_path, (4.0, -3.0))
    monkeypatch.chdir(tmp_path)
    found = wayproof.replay(log, "aerosonde", mission)
    assert found.results["airspeed_mps"] == pytest.approx(18.0, abs=1e-3)
    assert found.folder == Path("runs/replay/log")
    results = found.results
    assert results["wind"]["speed_mps"] == pytest.approx(5.0, abs=0.01)
    assert results["wind"]["from_deg"] == pytest.approx(math.degrees(math.atan2(-4.0, 3.0)) % 360, abs=0.2)
    assert results["wind"]["residual_mps"] < 1e-3
    east, north = found.flown["east_m"], found.flown["north_m"]
    settled = np.isin(found.flown["lap"], results["settled_laps"])
    beyond = np.hypot(*[np.maximum(np.maximum(-each, each - 150.0), 0.0) for each in (east, north)])
    assert results["flown"]["outside_p95_m"] == pytest.approx(np.percentile(beyond[settled], 95), abs=1e-6)
    assert results["flown"]["lap_mean_s"] == pytest.approx(40.0, abs=1e-9)
    flown, simulated = (results[side]["lap_mean_s"] for side in ("flown", "simulated"))
    assert rows_of(results)[2][3] == f"{100.0 * (simulated - flown) / flown:+.1f} %"
    assert json.loads((found.folder / "replay.json").read_text()) == results
    assert f"{results['flown']['outside_p95_m']:.2f}" in (found.folder / "report.html").read_text()


def test_a_wind_that_changes_is_found_at_the_middle_of_each_window() -> None:
    """Over 160 s the wind towards east rises evenly from 0 to 4 m/s; towards north it is -3. Its clock begins at 50."""
    seconds = np.arange(0.0, 161.0, 0.1)
    through = np.array([np.cos(math.tau * seconds / 40.0), np.sin(math.tau * seconds / 40.0)])
    wind = np.array([4.0 * seconds / 160.0, np.full_like(seconds, -3.0)])
    along = (through * wind).sum(axis=0)
    speed = along + np.sqrt(along**2 - (wind**2).sum(axis=0) + 18.0**2)
    columns = {"time_s": 50.0 + seconds, "ve_mps": speed * through[0], "vn_mps": speed * through[1]}
    flight = FlownFlight(Path("log"), {**columns, "airspeed_tas_mps": np.full_like(seconds, 18.0)})
    found = fit_windows(flight, fit_wind(flight))
    assert [each.time_s for each in found] == np.arange(0.0, 161.0, 10.0).tolist()
    assert [each.east_mps for each in found] == pytest.approx(np.arange(0.0, 4.1, 0.25), abs=0.05)
    assert [each.north_mps for each in found] == pytest.approx(np.full(17, -3.0), abs=0.12)


def test_rows_on_the_ground_are_no_flight_and_told(tmp_path: Path) -> None:
    """300 s parked before the flight and after it, with 0.4 m/s in the pitot tube, halve the wind of a fit."""
    log, _ = circles(tmp_path, (4.0, -3.0))
    flown = {name: np.array(column) for name, column in pq.read_table(log).to_pydict().items()}
    parked = {
        **dict.fromkeys(flown, np.zeros(3000)),
        "lap": np.ones(3000),
        "airspeed_tas_mps": np.full(3000, 0.4),
    }
    every = {name: np.concatenate((parked[name], column, parked[name])) for name, column in flown.items()}
    every["east_m"][4000] += 9000.0  # no aircraft gets there and back in 0.2 s
    pq.write_table(pa.table({**every, "time_s": 0.1 * np.arange(7600.0)}), log)
    found = read_flown(log)
    assert found.notes[0] == "1 row too far from both neighbours passed over"
    assert found.notes[-1].startswith("6,000 rows on the ground or hovering passed over: slower than 4.2 m/s")
    assert found["up_m"].tolist() == flown["up_m"][1:].tolist()
    assert fit_wind(found).speed_mps == pytest.approx(5.0, abs=0.01)
    pq.write_table(pq.read_table(log).drop_columns(["ve_mps", "vn_mps"]), log)
    assert len(read_flown(log)["time_s"]) == pytest.approx(1600, abs=20)


@pytest.mark.parametrize(("rows", "settled"), [(1600, [2, 3, 4]), (1480, [2, 3])])
def test_a_last_lap_is_whole_where_it_ends_as_near_to_its_corner_as_those_before(
    rows: int, settled: list[int], tmp_path: Path
) -> None:
    """Four laps of 40 s at 10 Hz, and the same log cut 12 s before the end; no radius of acceptance is known."""
    log, mission = circles(tmp_path, (4.0, -3.0))
    table = pq.read_table(log).slice(0, rows)
    known = np.where(table["lap"].to_numpy() == 2.0, np.nan, 18.0)  # of lap 2 the airspeed is not
    column = table.column_names.index("airspeed_tas_mps")
    pq.write_table(table.set_column(column, "airspeed_tas_mps", pa.array(known)), log)
    mission.write_text(json.dumps({"mission": {"corners_east_north_m": SQUARE, "bank_limit_deg": 45.0}}))
    settings = {"aircraft.airspeed_mps": np.float64(18.0), "guidance.kind": np.str_("bearing")}
    steady = {**settings, "environment.wind.speed_mps": 2}
    found = wayproof.replay(log, "aerosonde", mission, out=tmp_path / "out", settings=steady)
    assert found.results["settled_laps"] == settled
    told = ["airspeed_mean_mps" in lap["flown"] for lap in found.results["laps"]]
    assert told == [lap > 2 for lap in settled]
    wind = wayproof.load_run(tmp_path / "out" / "simulated").scenario.environment.wind
    assert (wind and wind.speed_mps, wind and wind.changes) == (2.0, ())


def test_the_altitude_of_a_drawn_mission_is_above_the_sea_and_no_barometric_height(tmp_path: Path) -> None:
    """The flight is at 300 m above the sea, as its mission, and 60 m above where its barometer was set to 0."""
    log, mission = circles(tmp_path, (4.0, -3.0), laps=3)[0], tmp_path / "square.csv"
    table = pq.read_table(log)
    pq.write_table(table.append_column("baro_height_m", pa.array(table["up_m"].to_numpy() - 240.0)), log)
    rows = [f"{east},{north},300" for east, north in SQUARE]
    mission.write_text("\n".join(["east_m,north_m,altitude_m", *rows]))
    found = wayproof.replay(log, "aerosonde", mission, out=tmp_path / "out")
    assert found.results["flown"]["height_error_p95_m"] == pytest.approx(0.0, abs=1e-9)
    assert found.simulated["up_m"][0] == pytest.approx(300.0)


def test_places_in_degrees_go_before_those_in_metres_with_a_mission_in_degrees(tmp_path: Path) -> None:
    """As metres may be counted from 50 m beside home, and 250 m above the sea."""
    log, mission = circles(tmp_path, (4.0, -3.0), laps=3)[0], tmp_path / "a.csv"
    table, plane = pq.read_table(log).to_pydict(), LocalPlane(47.0, 8.0)
    places = zip(table["east_m"], table["north_m"], strict=True)
    latitude, longitude = np.array([plane.geodetic(*each) for each in places]).T
    more = {"lat": latitude, "lon": longitude, "altitude_m": table["up_m"]}
    for name, off in (("east_m", [50.0]), ("up_m", [-250.0]), ("airspeed_tas_mps", [-9.0, 9.0])):
        more[name] = np.add(table[name], np.resize(off, len(latitude)))
    pq.write_table(pa.table(table | more), log)
    assert read_flown(log)["east_m"] == pytest.approx(np.add(table["east_m"], 50.0))  # with one in metres
    corners = ["{},{}".format(*plane.geodetic(*map(float, each))) for each in SQUARE]
    mission.write_text("\n".join(["lat,lon", *corners]))
    found = wayproof.replay(log, "aerosonde", mission, out=tmp_path / "out")
    away_m = np.hypot(found.flown["east_m"] - 75.0, found.flown["north_m"] - 75.0)
    assert away_m == pytest.approx(90.0, abs=0.1)
    assert found.simulated["up_m"][0] == pytest.approx(300.0)
    assert "wind: it leaves 9.0 m/s (rms) unexplained; is the airspeed right?" in found.results["notes"]


def test_an_item_of_a_mission_that_is_no_waypoint_is_told(tmp_path: Path) -> None:
    items = ["0 1 0 16 0 0 0 0 47 8 0 1", "1 0 3 16 0 9 0 0 47.01 8 68 1", "2 0 3 18 1 9 0 0 47 8.1 68 1"]
    told = "its fences, altitudes and changes of airspeed are passed over; flown at the log's height"
    for more in ("", "3 0 3 16 0 9 0 0 47.1 8.1 70 1", "3 0 3 5004 9 0 0 0 47.1 8.1 0 1"):
        (tmp_path / "a.waypoints").write_text("\n".join(["QGC WPL 110", *items, more]))
        notes = read_mission(tmp_path / "a.waypoints")[1]
        assert notes[-1].endswith("waypoints: item 2 (loiter turns)")
        assert (f"mission: {told} and airspeed" in notes) == bool(more)


def test_laps_are_those_of_the_column_lap_in_the_order_flown(tmp_path: Path) -> None:
    """Whatever their numbers, and with 5 s of lap 0 before them, each is beside what was simulated at its time."""
    log, mission = circles(tmp_path, (4.0, -3.0))
    mission.write_text(json.dumps({"mission": {"corners_east_north_m": SQUARE, "bank_limit_deg": 45.0}}))
    table, found = pq.read_table(log).drop_columns(["lap"]), []
    table = table.append_column("autonomous", pa.array(np.ones(len(table), dtype=bool)))
    for first in ([1, 2, 3, 4], [5, 9, 7, 0], [0, 9, 7, 0]):
        lap = np.repeat([*first[:1], first[0] or 1, *first[1:]], [50, 350, 400, 400, 400])
        pq.write_table(table.append_column("lap", pa.array(lap)), log)
        settings = {"aircraft.airspeed_mps": "18"}
        results = wayproof.replay(log, "aerosonde", mission, out=tmp_path / "out", settings=settings).results
        found.append({row["lap"]: row["simulated"]["outside_max_m"] for row in results["laps"]})
        assert not (tmp_path / "out" / "flight.rrd").exists(), "an earlier one would be of other laps"
        (tmp_path / "out" / "flight.rrd").touch()
    assert [list(each) for each in found] == [[2, 3, 4], [5, 7, 9], [7, 9]]
    for each in found[1:]:
        assert (each[9], each[7]) == pytest.approx((found[0][2], found[0][3]), abs=1e-6)


@needs_flown
def test_thor_is_flown_as_near_as_asked_and_its_own_figures_are_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "thor"
    arguments = ["--aircraft", "ultrastick25e", "--mission", str(FLOWN / "thor75.json"), "--out", str(out)]
    assert main(["replay", str(FLOWN / "thor75.parquet"), *arguments, "--json"]) == 0
    results = json.loads(capsys.readouterr().out)
    facts = json.loads((FLOWN / "thor75.json").read_text())
    assert results["settled_laps"] == [2, 3]
    of_laps = [facts["laps"][lap] for lap in "23"]
    mean_s = np.mean([lap["time_s"] for lap in of_laps])
    assert results["flown"]["lap_mean_s"] == pytest.approx(mean_s, abs=0.02)
    worst = np.mean([lap["outside_square_m"]["max"] for lap in of_laps])
    assert results["flown"]["outside_max_mean_m"] == pytest.approx(worst, abs=0.02)
    wind = facts["all_laps_of_this_file"]["wind_fit"]
    assert results["wind"]["speed_mps"] == pytest.approx(wind["speed_mps"], abs=0.1)
    assert results["wind"]["from_deg"] == pytest.approx(wind["from_deg"], abs=2.0)
    assert results["wind"]["residual_mps"] == pytest.approx(wind["residual_rms_mps"], abs=0.05)
    flown, simulated = results["flown"], results["simulated"]
    assert simulated["outside_p95_m"] == pytest.approx(flown["outside_p95_m"], rel=0.1)
    assert simulated["outside_max_mean_m"] == pytest.approx(flown["outside_max_mean_m"], rel=0.1)
    assert simulated["lap_mean_s"] == pytest.approx(flown["lap_mean_s"], rel=0.02)
    assert results["distance_between_m"]["p50"] <= 3.0
    reader = RrdReader(str(out / "flight.rrd"))
    layout = [each.entity_path for each in reader.stream(store=reader.blueprints()[0]).to_chunks()]
    assert sum(each.endswith("/TimeAxis") for each in layout) == 4, "each plot shows the whole flight"
    nobody = patch("rerun.RecordingStream.connect_grpc", side_effect=ConnectionError)
    with pytest.raises(ConnectionError), nobody:
        send_recording(out / "flight.rrd", "nowhere")
    again = wayproof.load_run(out / "simulated")
    assert again.digest == wayproof.fly(again.scenario).digest or again.outcome == "reached"


@pytest.mark.parametrize(("held", "grid_m"), [(10, 0.0), (5, 0.5), (1, 1.0)])
def test_a_wind_is_found_of_places_that_are_held_or_rounded(held: int, grid_m: float, tmp_path: Path) -> None:
    """As those of a receiver of 1 Hz in a table of 10 Hz: the steps between made a wind of 19 m/s of one of 5."""
    table = pq.read_table(circles(tmp_path, (4.0, -3.0))[0]).to_pydict()
    rows = np.arange(len(table["time_s"])) // held * held
    east, north = (0.1 * np.cumsum(table[name])[rows] for name in ("ve_mps", "vn_mps"))
    if grid_m:
        east, north = np.round((east / grid_m, north / grid_m)) * grid_m
    columns = {"time_s": table["time_s"], "east_m": east, "north_m": north}
    pq.write_table(pa.table(columns), tmp_path / "held.parquet")
    wind = fit_wind(read_flown(tmp_path / "held.parquet"))
    assert (wind.east_mps, wind.north_mps) == pytest.approx((4.0, -3.0), abs=0.1)
    assert wind.airspeed_mps == pytest.approx(18.0, abs=0.2)


@needs_flown
def test_corners_are_found_of_the_targets_alone(tmp_path: Path) -> None:
    """Thor's corners counted as reached from 10 m; a table without targets, or with some left out, is refused."""
    table = pq.read_table(FLOWN / "thor75.parquet")
    found = wayproof.replay(FLOWN / "thor75.parquet", "ultrastick25e", out=tmp_path / "out")
    corners = json.loads((FLOWN / "thor75.json").read_text())["mission"]["corners_east_north_m"]
    assert np.hypot(*(found.corners_m - np.array(corners)).T).max() < 2.5
    assert found.results["notes"][0].startswith("mission: 4 corners, 10 m ahead of where target_index")
    low = "altitude: the log's is -5 m, which is below 50 m above the sea; flown anew at 300 m"
    assert found.results["notes"][1] == low
    assert found.results["distance_between_m"]["p50"] <= 4.0
    mission = tmp_path / "clockwise.json"
    mission.write_text(json.dumps({"mission": {"corners_east_north_m": SQUARE[::-1]}}))
    with pytest.raises(wayproof.InputError, match=r"target_index: changes .* must go through the mission's"):
        wayproof.replay(FLOWN / "thor75.parquet", "ultrastick25e", mission, out=tmp_path / "none")
    pq.write_table(table.drop_columns(["target_index"]), tmp_path / "none.parquet")
    with pytest.raises(wayproof.InputError, match="give --mission FILE, or a column target_index"):
        wayproof.replay(tmp_path / "none.parquet", "ultrastick25e", out=tmp_path / "none")
    from_ten = pa.array(table["target_index"].to_numpy() + 10)
    place = table.column_names.index("target_index")
    pq.write_table(table.set_column(place, "target_index", from_ten), tmp_path / "ten.parquet")
    with pytest.raises(wayproof.InputError, match="target_index: is changed from 10, 11, 12, 13; must be"):
        wayproof.replay(tmp_path / "ten.parquet", "ultrastick25e", out=tmp_path / "ten")


def test_an_ardupilot_logs_mission_is_its_waypoints_between_a_jump_and_its_target(tmp_path: Path) -> None:
    log, _ = circles(tmp_path, (4.0, -3.0), laps=3)
    plane, flown = LocalPlane(47.0, 8.0), pq.read_table(log).to_pydict()

    def row(kind: int, form: str, *values: object) -> bytes:
        return b"\xa3\x95" + bytes([kind]) + struct.pack(f"<{form}", *values)

    def degrees(east: float, north: float) -> tuple[int, int]:
        latitude, longitude = plane.geodetic(east, north)
        return round(latitude * 1e7), round(longitude * 1e7)

    commands = [(16, 0.0, 0.0, (0.0, 0.0)), (22, 15.0, 0.0, (0.0, 0.0))]
    commands += [(16, 0.0, 45.0, (float(east), float(north))) for east, north in SQUARE]
    commands[5] = (16, 0.0, 46.0, (0.0, 150.0))
    commands += [(177, 2.0, -1.0, (0.0, 0.0))]
    older = [*commands[:6], commands[2], commands[6]]  # of another upload: one item more
    data = FORMATS + form(140, b"POS", 23, b"QLLf", b"TimeUS,Lat,Lng,Alt")
    data += form(143, b"PARM", 3 + 8 + 16 + 4, b"QNf", b"TimeUS,Name,Value")
    data += form(142, b"ARSP", 3 + 8 + 1 + 4, b"QBf", b"TimeUS,I,Airspeed")
    names = b"TimeUS,CTot,CNum,CId,Prm1,Prm2,Lat,Lng,Alt"
    data += form(144, b"CMD", 3 + 8 + 6 + 8 + 8 + 4, b"QHHHffLLf", names)
    data += row(143, "Q16sf", 1, b"LIM_ROLL_CD", 4500.0) + row(143, "Q16sf", 1, b"TRIM_ARSPD_CM", 1800.0)
    for items in (older, commands):
        for number, (command, first, second, place) in enumerate(items):
            item = (1, len(items), number, command, first, second, *degrees(*place), 100.0)
            data += row(144, "QHHHffiif", *item)
    for time, east, north in zip(*(flown[name] for name in ("time_s", "east_m", "north_m")), strict=True):
        time_us = int(1e6 * time) + 2
        data += row(140, "Qiif", time_us, *degrees(east, north), 300.0)
        data += row(142, "QBf", time_us, 0, math.tau * 90 / 40 / TRUE_SHARE)
    (tmp_path / "log.bin").write_bytes(data)
    found = wayproof.replay(tmp_path / "log.bin", "aerosonde", out=tmp_path / "out")
    assert found.corners_m == pytest.approx(np.array(SQUARE), abs=0.05)
    assert found.results["notes"][:2] == [
        "mission: items 2 to 5 of the log, reached from 45 m",
        "mission: its acceptance radii differ (45, 46 m); 45 m is taken for all corners",
    ]
    assert found.results["airspeed_mps"] == pytest.approx(18.0 * TRUE_SHARE, abs=1e-3)
    assert max(found.results["wind"][name] for name in ("speed_mps", "residual_mps")) < 0.1
    autopilot = wayproof.load_run(tmp_path / "out" / "simulated").scenario.aircraft.autopilot
    assert (autopilot and autopilot.bank_limit_deg) == 45.0
    takeoff, speed = (struct.pack("<HHH", 7, 1, command) for command in (22, 178))
    (tmp_path / "log.bin").write_bytes(data.replace(b"Prm2", b"Prm7").replace(takeoff, speed))  # as of 2014
    given = mission_of_log(tmp_path / "log.bin")
    law = "mission: items 2 to 5 of the log, reached by the rule of the law"
    assert (given[0].airspeed_mps, given[1]) == (None, [law])
    loiter = data.replace(struct.pack("<HHH", 7, 3, 16), struct.pack("<HHH", 7, 3, 18))
    (tmp_path / "log.bin").write_bytes(loiter)
    with pytest.raises(wayproof.InputError, match="item 3 of its mission, loiter turns, is no corner; give"):
        wayproof.replay(tmp_path / "log.bin", "aerosonde", out=tmp_path / "out")


@needs_flown
def test_a_log_of_positions_alone_shows_the_same_wind_and_laps(tmp_path: Path) -> None:
    table = pq.read_table(FLOWN / "thor75.parquet", columns=["time_s", "east_m", "north_m", "lap"])
    table = table.append_column("airspeed_ias_mps", pa.array(np.zeros(len(table))))  # no sensor
    pq.write_table(table, tmp_path / "log.parquet")
    mission = FLOWN / "thor75.json"
    results = wayproof.replay(tmp_path / "log.parquet", "ultrastick25e", mission, out=tmp_path / "o").results
    fitted = json.loads(mission.read_text())["all_laps_of_this_file"]["wind_fit"]
    assert results["wind"]["speed_mps"] == pytest.approx(fitted["speed_mps"], abs=0.3)
    assert results["wind"]["from_deg"] == pytest.approx(fitted["from_deg"], abs=3.0)
    assert results["simulated"]["lap_mean_s"] == pytest.approx(results["flown"]["lap_mean_s"], rel=0.03)
    assert results["distance_between_m"]["p50"] < 3.0
    assert results["notes"][0] == "velocity over the ground: from the positions"
    assert results["notes"][1] == "altitude: the table has none; taken to be 0 m"
    assert results["notes"][2].startswith("airspeed: the log has none (airspeed_tas_mps, airspeed_ias_mps)")
    assert "height_error_p95_m" not in results["flown"]  # 0.00 m was told of heights that nobody knows


@needs_flown
@pytest.mark.parametrize(
    ("column", "begin_s", "end_s", "laps", "note"),
    [
        ("alpha_probe_deg", 50.0, 50.0, [2, 3], "is taken to be home, 45.328422, -93.229244"),
        ("target_index", 50.0, 50.0, [2, 3], "1 row without target_index"),
        ("time_s", -20.0, 45.0, [3], "lap 2 is left out: it begins before the log"),
        ("autonomous", 50.0, 58.0, [3], "lap 2 is left out: it has no row flown by the autopilot for 8.0 s"),
        ("airspeed_tas_mps", -20.0, 200.0, [2, 3], "airspeed_tas_mps from airspeed_ias_mps by the standard"),
        ("ve_mps", -1.0, 0.1, [2, 3], "velocity over the ground: from the positions in 56 rows"),
        ("lap", 50.0, 50.0, [2, 3], "1 row without time_s, east_m, north_m or lap"),
    ],
)
def test_a_log_that_lacks_values_has_thors_own_laps_or_leaves_them_out(
    column: str, begin_s: float, end_s: float, laps: list[int], note: str, tmp_path: Path
) -> None:
    """The mission is in degrees, and of a log with laps it begins with their second corner."""
    facts = json.loads((FLOWN / "thor75.json").read_text())
    origin, table = facts["frame"]["origin"], pq.read_table(FLOWN / "thor75.parquet")
    lost = np.abs(table["time_s"].to_numpy() - (begin_s + end_s) / 2) < (end_s - begin_s) / 2 + 0.01
    values = pa.array(np.where(lost, np.nan, table[column]).astype(float))
    table = table.set_column(table.column_names.index(column), column, values)
    from_targets = column == "target_index"
    log, mission = tmp_path / "log.parquet", tmp_path / "a.waypoints"
    pq.write_table(table.drop_columns(["lap", "autonomous"] if from_targets else []), log)
    plane = LocalPlane(origin["latitude_deg"], origin["longitude_deg"])
    corners = [(0.0, 0.0), *(SQUARE if from_targets else SQUARE[1:] + SQUARE[:1])]
    places = ["\t".join(map(str, plane.geodetic(*corner))) for corner in corners]
    rows = [f"{k}\t0\t{3 * (k > 0)}\t16\t0\t10\t0\t0\t{place}\t68\t1" for k, place in enumerate(places)]
    mission.write_text("\n".join(["QGC WPL 110", *rows, JUMP_AND_LANDING.replace(" ", "\t")]))
    results = wayproof.replay(log, "ultrastick25e", mission, out=tmp_path / "out").results
    assert results["settled_laps"] == laps
    assert any(note in each for each in results["notes"])
    lap, known = results["laps"][-1]["flown"], facts["laps"]["3"]
    assert lap["time_s"] == pytest.approx(known["time_s"], abs=0.021)
    sides = [each["outside_max_m"] for each in lap["corners"]]
    assert sides == pytest.approx([*known["outside_by_side_max_m"].values()], abs=0.02)
    assert results["distance_between_m"]["p95"] < 10.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mission": {"corners_east_north_m": SQUARE}, "frame": "ENU"}, "frame: is 'ENU'; must be a mapping"),
        ({"mission": {"corners_east_north_m": [[600, 0], [750, 150], [600, 150]]}}, "comes no nearer than 5"),
        ({"mission": {}, "corners_m": SQUARE}, "mission.corners_east_north_m: is missing"),
        ({"mission": {"corners_east_north_m": [[0, 0], [1]]}}, "must be two or more pairs"),
        ({"mission": {"corners_east_north_m": SQUARE, "bank_limit_deg": "45"}}, "bank_limit_deg: is '45'"),
        ({"mission": {"corners_east_north_m": [[0, 0], [0, 0]]}}, "at two places or more"),
        (
            {"mission": {"corners_east_north_m": SQUARE, "acceptance_radius_m": 0}},
            "mission.json: mission.acceptance_radius_m: is 0; must be a number above 0",
        ),
    ],
)
def test_a_wrong_mission_is_told(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    log, mission = circles(tmp_path, (0.0, 1.0), laps=2)
    mission.write_text(json.dumps(change))
    words = ["--aircraft", "aerosonde", "--mission", str(mission), "--out", str(out := tmp_path / "out")]
    assert message in refused("replay", log, *words)
    assert not out.exists()


def test_a_log_that_comes_to_no_corner_is_told_how_near_it_passes(tmp_path: Path) -> None:
    """A circle of 90 m passes the corners of a square of 150 m about its centre at 106.07 - 90 m."""
    log, mission = circles(tmp_path, (0.0, 1.0), laps=2)
    pq.write_table(pq.read_table(log).drop_columns(["lap"]), log)
    keys = {"corners_east_north_m": SQUARE, "acceptance_radius_m": 12.5, "bank_limit_deg": 45.0}
    mission.write_text(json.dumps({"mission": keys}))
    arguments = ["--aircraft", "aerosonde", "--mission", mission, "--out"]
    said = " ".join(refused("replay", log, *arguments, tmp_path / "out").split())
    assert "; it comes to 0 corners in turn, then no nearer than 16 m to corner" in said
    assert "which counts as reached from 12.5 m; there is nothing to compare" in said
    more = (*arguments[2:], tmp_path / "out")
    said = refused("replay", log, "--aircraft", "c172p", *more)
    assert said.startswith("the log: aircraft.airspeed_mps: c172p cannot hold 18 m/s; its level-flight")
    assert "command line: aircraft.model: unknown" in refused("replay", log, "--aircraft", "c1", *more)
    assert not (tmp_path / "out").exists()
    mission.write_text(json.dumps({"mission": {**keys, "acceptance_radius_m": 145.0}}))
    assert "its corners count as reached 1" in refused("replay", log, *arguments, tmp_path / "out")
    mission.write_text(json.dumps({"mission": {**keys, "acceptance_radius_m": 45.0}}))
    said = refused("replay", log, *arguments, tmp_path / "o", "--set", "aircraft.autopilot.bank_limit_deg=12")
    assert said.startswith("the simulated flight has no whole lap after lap 1; lap 2 is not flown to its end")
    said = refused("replay", log, *arguments, tmp_path / "o", "--set", "mission.time_limit_s=9")
    assert "whole lap after lap 1; it ended: not all corners after 9 s; there is nothing" in said
    for key in ("planner.kind", "obstacles", "mission.goal_m", "sensor.range_m"):
        said = refused("replay", log, *arguments, tmp_path / "o", "--set", f"{key}=[7, 9]")
        assert said.startswith(f"command line: {key}: has no effect on a replay; leave it out")
    assert f"{log} is a file: choose another place for the replay" in refused("replay", log, *arguments, log)


def test_a_log_that_lacks_a_column_or_goes_straight_is_told(tmp_path: Path) -> None:
    log, mission = circles(tmp_path, (0.0, 1.0), laps=2)
    arguments = ["--aircraft", "aerosonde", "--mission", str(mission), "--out", str(tmp_path / "out")]
    table = pq.read_table(log)
    pq.write_table(table.drop_columns(["north_m"]), log)
    assert "has no column north_m" in refused("replay", log, *arguments)
    items = ["0 1 0 16 0 0 0 0 47 8 0 1", "1 0 3 16 0 0 0 0 47.01 8 68 1", "2 0 3 16 0 0 0 0 47 8 68 1"]
    (tmp_path / "again.waypoints").write_text("\n".join(["QGC WPL 110", *items, "3 0 3 177 2 -1 0 0 0 0 0 1"]))
    pq.write_table(table.slice(0, 500), short := tmp_path / "short.parquet")
    assert "short.parquet: has no whole lap after lap 1" in refused("replay", short, *arguments)
    assert not (tmp_path / "out").exists()
    words = [*arguments[:3], str(tmp_path / "again.waypoints"), *arguments[4:]]
    assert "its lap has fewer than two places" in refused("replay", log, *words)
    (tmp_path / "a.csv").write_text("time_s,time_s,east_m,north_m\n0,0,0,0\n")
    said = refused("replay", tmp_path / "a.csv", *arguments)
    assert "a.csv: time_s: stands 2 times; must stand once" in said
    east_m, same = 10.0 * table["time_s"].to_numpy() - 200.0, np.full(len(table), 10.0)
    straight = {name: table[name].to_numpy() for name in table.column_names}
    straight |= {"ve_mps": same, "vn_mps": 0 * same, "east_m": east_m, "north_m": 75.0 + 0 * same}
    pq.write_table(pa.table(straight), log)
    assert "the wind cannot be told" in refused("replay", log, *arguments)
    assert "give --mission FILE" in refused("replay", log, "--aircraft", "aerosonde")
    said = refused("replay", mission, "--aircraft", "aerosonde")
    assert "is no flight log that is read; must end in .parquet, .csv" in said
