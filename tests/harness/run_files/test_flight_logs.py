"""Flight logs of other tools, read into the plane of a run and laid over its recording."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import rerun as rr

from aircraft.frames import LocalPlane
from harness.cli.app import main
from harness.files.input_file import InputError
from harness.recording.overlay import write_overlay
from harness.recording.thin import cross_track_m, write_log_recording
from harness.run_files.exports.exported_path import planned_points
from harness.run_files.flight_logs import LogTrack, read_log
from harness.run_files.run_folder import load_run

PLANE = LocalPlane(47.0, 8.0)
ROWS = np.arange(20, dtype=np.float64)
TRUTH = LogTrack(*np.array((0.5 * ROWS, 10.0 * ROWS, 30.0 * ROWS, 400.0 + ROWS)))
"""A climb to the north-north-east from the origin."""


def degrees() -> list[tuple[float, float]]:
    return [PLANE.geodetic(east, north) for east, north in zip(TRUTH.east_m, TRUTH.north_m, strict=True)]


def write_csv(path: Path) -> None:
    rows = [
        f"{time},{latitude!r},{longitude!r},{up}"
        for time, (latitude, longitude), up in zip(TRUTH.time_s, degrees(), TRUTH.up_m, strict=True)
    ]
    path.write_text("\n".join(["time_s,latitude_deg,longitude_deg,altitude_m", *rows]) + "\n")


def write_igc(path: Path) -> None:
    """Two rows a minute apart tell a date line from none; B records after the FAI's specification."""
    lines = ["AXXXABC", "HFDTE010124"]
    for second, (latitude, longitude) in enumerate(degrees()):
        at = 12 * 3600 + second
        parts = [f"{at // 3600:02}{at // 60 % 60:02}{at % 60:02}"]
        for value, width, sides in ((latitude, 2, "NS"), (longitude, 3, "EW")):
            minutes = round(abs(value) * 60_000)
            parts.append(f"{minutes // 60_000:0{width}}{minutes % 60_000:05}{sides[value < 0]}")
        up = round(float(TRUTH.up_m[second]))
        lines.append(f"B{''.join(parts)}A{up:05}{up:05}")
    path.write_text("\r\n".join(lines) + "\r\n")


def write_ulog(path: Path) -> None:
    """The least ULog there is, after https://docs.px4.io/main/en/dev_log/ulog_file_format.html."""

    def message(kind: bytes, body: bytes) -> bytes:
        return struct.pack("<H", len(body)) + kind + body

    form = b"vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;"
    data = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    data += message(b"B", bytes(40)) + message(b"F", form)
    data += message(b"A", struct.pack("<BH", 0, 0) + b"vehicle_global_position")
    for time, (latitude, longitude), up in zip(TRUTH.time_s, degrees(), TRUTH.up_m, strict=True):
        row = struct.pack("<Qddf", int(1e6 * (5.0 + time)), latitude, longitude, up)
        data += message(b"D", struct.pack("<H", 0) + row)
    path.write_bytes(data)


def write_dataflash(path: Path) -> None:
    """The least DataFlash log: a format of formats, one of POS, and rows of it."""

    def form(kind: int, name: bytes, size: int, types: bytes, columns: bytes) -> bytes:
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, size, name, types, columns)

    data = form(128, b"FMT", 89, b"BBnNZ", b"Type,Length,Name,Format,Columns")
    data += form(140, b"POS", 3 + 8 + 4 + 4 + 4, b"QLLf", b"TimeUS,Lat,Lng,Alt")
    for time, (latitude, longitude), up in zip(TRUTH.time_s, degrees(), TRUTH.up_m, strict=True):
        row = (int(1e6 * time) + 1, round(latitude * 1e7), round(longitude * 1e7), float(up))
        data += b"\xa3\x95" + bytes([140]) + struct.pack("<Qiif", *row)
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("ending", "write", "near_m", "seconds"),
    [
        (".csv", write_csv, 1e-3, 0.5),
        (".igc", write_igc, 2.0, 1.0),
        (".ulg", write_ulog, 1e-3, 0.5),
        (".bin", write_dataflash, 0.05, 0.5),
    ],
)
def test_a_log_is_the_track_that_was_written(
    ending: str, write: Callable[[Path], None], near_m: float, seconds: float, tmp_path: Path
) -> None:
    path = tmp_path / f"flight{ending}"
    write(path)
    found = read_log(path, PLANE)
    assert found.time_s == pytest.approx(seconds * np.arange(20), abs=1e-3)
    assert np.hypot(found.east_m - TRUTH.east_m, found.north_m - TRUTH.north_m).max() < near_m
    assert found.up_m == pytest.approx(TRUTH.up_m, abs=0.01)
    assert found.course_deg == pytest.approx([math.degrees(math.atan2(1, 3))] * 20, abs=5.0)


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("a.kmz", b"", "is no flight log that can be shown; must end in .ulg, .bin, .igc, .mcap, .csv"),
        ("a.ulg", b"not a log", "cannot be read as .ulg"),
        ("a.mcap", b"\x89MCAP0\r\n", "a.mcap: "),
        ("a.csv", b"a,b\n1,2\n", "must have the columns time_s and x_m,y_m or latitude_deg,longitude_deg"),
        ("a.csv", b"time_s,x_m,y_m\n0,1,2\n1,two,3\n", "a.csv:3: has no number in time_s, x_m or y_m"),
        ("a.csv", b"time_s,x_m,y_m\n0,1,2\n", "has 1 rows with a position; a track has at least 2"),
        ("a.csv", b"time_s,x_m,y_m\n", "has 0 rows with a position"),
        (
            "a.csv",
            b"time_s,x_m,y_m,altitude_m\n0,1,2,high\n",
            "a.csv:2: has no number in time_s, x_m, y_m or alti",
        ),
        ("a.csv", b"time_s,x_m,y_m\nnan,0,1\n0,2,inf\n1,1e300,2\n", "has 0 rows with a position"),
        ("a.csv", b"time_s,x_m,y_m\n-1e300,0,1\n1e300,2,3\n", "its times reach from -1e+300 to 1e+300 s"),
        ("a.csv", b"time_s,latitude_deg,longitude_deg\n0,500,8\n1,47,9000\n", "has 0 rows with a position"),
        ("a.bin", b"not a log", "is no DataFlash log: such a file begins with a3 95 80"),
    ],
)
def test_a_file_that_is_no_log_is_told(name: str, content: bytes, sentence: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as raised:
        read_log(tmp_path / name, PLANE)
    assert sentence in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_log_that_is_not_there_is_told_as_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    run.mkdir()
    (run / "flight.rrd").write_bytes(b"")
    assert main(["view", str(run), str(tmp_path / "none.csv"), "--web"]) == 2
    assert capsys.readouterr().err == f"{tmp_path / 'none.csv'}: there is no such file\n"


def test_cross_track_is_positive_right_of_what_was_flown_of_the_plans() -> None:
    """Towards north, then east; what lies beyond the end is as far as the end is."""
    planned = np.array([(0.0, 0.0), (0.0, 1000.0), (1000.0, 1000.0)])
    points = np.array([(30.0, 500.0), (-20.0, 400.0), (500.0, 990.0), (500.0, 1040.0), (0.0, 700.0)])
    off = cross_track_m(points, planned)
    assert off is not None
    np.testing.assert_allclose(off, [30.0, -20.0, 10.0, -40.0, 0.0])
    assert cross_track_m(points, planned[:1]) is None


def test_a_damaged_dataflash_log_is_told_in_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """pymavlink's machine code prints a line for each byte that it skips."""
    whole = tmp_path / "a.bin"
    write_dataflash(whole)
    torn = whole.read_bytes()[:86]
    whole.write_bytes(torn + bytes(300))
    with pytest.raises(InputError, match=r"has 0 rows with a position|cannot be read as"):
        read_log(whole, PLANE)
    assert capfd.readouterr() == ("", "")


def test_a_table_of_a_spreadsheet_is_read(tmp_path: Path) -> None:
    """With a mark of its encoding, spaces, an empty line, a row without a fix, and rows out of order."""
    text = "\ufefftime_s, x_m, y_m\n2, 10, 30\n\n1, nan, nan\n0, 0, 10\n"
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    track = read_log(tmp_path / "a.csv", PLANE)
    assert track.time_s.tolist() == [0.0, 2.0]
    assert (track.east_m.tolist(), track.north_m.tolist()) == ([0.0, 10.0], [10.0, 30.0])


def test_a_long_log_is_thinned_to_its_last_row() -> None:
    row = np.arange(100_001.0)
    track = LogTrack(row, row, row, row).thinned(20_000)
    assert 10_000 < len(track.time_s) <= 20_001
    assert (track.time_s[0], track.up_m[-1]) == (0.0, 100_000.0)
    assert len(LogTrack(row[:5], row[:5], row[:5], row[:5]).thinned(20_000).time_s) == 5


def test_a_log_lies_over_the_run_it_came_from(tmp_path: Path) -> None:
    (tmp_path / "near.yaml").write_text(
        "schema: wayproof/scenario/1\nname: near\narea: {bounds_m: [0, 0, 4000, 4000]}\n"
        "mission: {start_m: [500, 500], goal_m: [1500, 1500]}\n"
    )
    folder = tmp_path / "run"
    assert main(["fly", str(tmp_path / "near.yaml"), "--out", str(folder), "--quiet"]) == 0
    for form in ("csv", "mcap"):
        log = tmp_path / f"flight.{form}"
        assert main(["export", str(folder), "--format", form, "--out", str(log)]) == 0
        run = load_run(folder)
        track = read_log(log, LocalPlane(47.0, 8.0))
        assert track.time_s[-1] == pytest.approx(run.track.time_s[-1], abs=0.2)
        off = cross_track_m(np.column_stack((track.east_m, track.north_m)), planned_points(run)[0])
        assert off is not None
        assert np.abs(off).max() < 2.0
        write_log_recording(log, folder, tmp_path / f"{form}.rrd")
        shown = tmp_path / f"{form}-overlay.rrd"
        write_overlay([folder / "flight.rrd", tmp_path / f"{form}.rrd"], ["run", "log"], shown)
        assert shown.stat().st_size > 50_000
        own = {str(chunk.entity_path) for chunk in rr.chunk.RrdReader(str(tmp_path / f"{form}.rrd")).stream()}
        assert {"/plan/aircraft/shape", "/world/aircraft/shape", "/plan/flown"} <= own
    far = tmp_path / "far.csv"
    far.write_text("time_s,latitude_deg,longitude_deg\n0,-33,150\n1,-33,150.1\n")
    with pytest.raises(InputError, match=r"comes no nearer than \d+ km to the area of "):
        write_log_recording(far, folder, tmp_path / "far.rrd")
