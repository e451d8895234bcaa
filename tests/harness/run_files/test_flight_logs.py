"""Flight logs of other tools, read into the plane of a run and laid over its recording."""

from __future__ import annotations

import json
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
from harness.run_files.flight_logs import LogTrack, read_log

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


def test_rows_that_px4_calls_invalid_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "a.ulg"
    write_ulog(path)
    plain = b"vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;"
    flagged = plain + b"bool lat_lon_valid;bool alt_valid;"
    whole = path.read_bytes()
    data = whole.replace(
        struct.pack("<H", len(plain)) + b"F" + plain, struct.pack("<H", len(flagged)) + b"F" + flagged
    )
    head, *rows = data.split(struct.pack("<H", 30) + b"D")
    assert len(rows) == 20
    for number, row in enumerate(rows):
        flags = (number != 3, number != 4)
        head += struct.pack("<H", 32) + b"D" + row + bytes(flags)
    path.write_bytes(head)
    assert len(read_log(path, PLANE).time_s) == 18


def test_of_two_receivers_the_first_is_taken_where_it_has_a_fix(tmp_path: Path) -> None:
    def form(kind: int, name: bytes, size: int, types: bytes, columns: bytes) -> bytes:
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, size, name, types, columns)

    data = form(128, b"FMT", 89, b"BBnNZ", b"Type,Length,Name,Format,Columns")
    data += form(141, b"GPS", 3 + 8 + 1 + 1 + 4 + 4 + 4, b"QBBLLf", b"TimeUS,I,Status,Lat,Lng,Alt")
    for row, (latitude, longitude) in enumerate(degrees()):
        for receiver, off_deg in ((0, 0.0), (1, 1e-4)):
            status = 1 if row < 2 else 3
            at = (round((latitude + off_deg) * 1e7), round(longitude * 1e7), 400.0)
            data += b"\xa3\x95\x8d" + struct.pack(
                "<QBBiif", 500_000 * row + receiver + 1, receiver, status, *at
            )
    (tmp_path / "a.bin").write_bytes(data)
    found = read_log(tmp_path / "a.bin", PLANE)
    assert len(found.time_s) == 18
    assert np.hypot(found.east_m - TRUTH.east_m[2:], found.north_m - TRUTH.north_m[2:]).max() < 0.05


def write_mcap(path: Path) -> None:
    """Fixes of two receivers as JSON, the second twice as often and 11 m off, in chunks of their own."""
    from mcap.writer import CompressionType, Writer

    with path.open("wb") as file:
        writer = Writer(file, chunk_size=400, compression=CompressionType.NONE)
        writer.start()
        schema = writer.register_schema("foxglove.LocationFix", "jsonschema", b"{}")
        topics = [writer.register_channel(f"/gps{number}", "json", schema) for number in (0, 1)]
        for row, (latitude, longitude) in enumerate(degrees()):
            for topic, half, off_deg in ((0, 0, 1e-4), (1, 0, 0.0), (1, 1, 0.0)):
                if half and row == 19:
                    continue
                at = {"latitude": latitude + off_deg, "longitude": longitude, "altitude": 400.0 + row}
                time_ns = 500_000_000 * row + 250_000_000 * half
                writer.add_message(topics[topic], time_ns, json.dumps(at).encode(), time_ns)
        writer.finish()  # type: ignore[no-untyped-call]


def test_of_two_topics_with_fixes_the_longer_is_taken(tmp_path: Path) -> None:
    write_mcap(tmp_path / "a.mcap")
    found = read_log(tmp_path / "a.mcap", PLANE)
    assert len(found.time_s) == 39
    assert np.hypot(found.east_m[::2] - TRUTH.east_m, found.north_m[::2] - TRUTH.north_m).max() < 1e-3


def test_a_torn_mcap_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    write_mcap(tmp_path / "a.mcap")
    whole = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "torn.mcap").write_bytes(whole[: len(whole) // 3])
    found = read_log(tmp_path / "torn.mcap", PLANE)
    assert 4 <= len(found.time_s) < 39
    assert found.east_m[0] == pytest.approx(TRUTH.east_m[0], abs=1e-3)
    assert found.notes == ("damaged, or torn: read as far as it goes",)
    assert read_log(tmp_path / "a.mcap", PLANE).notes == ()


def test_a_damaged_mcap_is_not_taken_for_whole(tmp_path: Path) -> None:
    write_mcap(tmp_path / "a.mcap")
    whole = (tmp_path / "a.mcap").read_bytes()
    inside = whole.index(b'"longitude"', len(whole) // 2)
    for name, data, most, note in (
        ("digit", whole[:inside] + whole[inside:].replace(b"8.0", b"9.0", 1), 38, "damaged, or torn"),
        ("key", whole[:inside] + b'"longitudo"' + whole[inside + 11 :], 38, "damaged, or torn"),
    ):
        (tmp_path / f"{name}.mcap").write_bytes(data)
        found = read_log(tmp_path / f"{name}.mcap", PLANE)
        assert 4 <= len(found.time_s) <= most, name
        assert np.hypot(found.east_m, found.north_m).max() < 1000.0, name
        assert [each.startswith(note) for each in found.notes] == [True], name


def test_messages_without_a_position_are_counted(tmp_path: Path) -> None:
    from mcap.writer import Writer

    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("foxglove.LocationFix", "jsonschema", b"{}")
        topic = writer.register_channel("/gps", "json", schema)
        for row, (latitude, longitude) in enumerate(degrees()):
            at = {"latitude": latitude} if row in (3, 4) else {"latitude": latitude, "longitude": longitude}
            writer.add_message(topic, 10**9 * row, json.dumps(at).encode(), 10**9 * row)
        writer.finish()  # type: ignore[no-untyped-call]
    found = read_log(tmp_path / "a.mcap", PLANE)
    assert len(found.time_s) == 18
    assert found.notes == ("2 messages of foxglove.LocationFix without a position passed over",)


@pytest.mark.parametrize(
    ("ending", "write", "row"),
    [(".ulg", write_ulog, 3 + 2 + 28), (".bin", write_dataflash, 3 + 20), (".igc", write_igc, 37)],
)
def test_of_a_damaged_log_it_is_said_that_it_is(
    ending: str, write: Callable[[Path], None], row: int, tmp_path: Path
) -> None:
    write(tmp_path / f"a{ending}")
    assert read_log(tmp_path / f"a{ending}", PLANE).notes == ()
    whole = (tmp_path / f"a{ending}").read_bytes()
    garbage = b"B99zz\r\n" * (
        100 if ending == ".bin" else 3
    )  # as much as a page may be at the end of such a log
    (tmp_path / f"damaged{ending}").write_bytes(whole[: -10 * row] + garbage + whole[-10 * row :])
    found = read_log(tmp_path / f"damaged{ending}", PLANE)
    assert len(found.time_s) >= 7
    assert [note.endswith("passed over") for note in found.notes] == [True]
    if ending == ".ulg":
        (tmp_path / "torn.ulg").write_bytes(whole[:-9])
        assert len(read_log(tmp_path / "torn.ulg", PLANE).notes) == 1


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short flight, with its recording."""
    place = tmp_path_factory.mktemp("flown")
    (place / "near.yaml").write_text(
        "schema: wayproof/scenario/1\nname: near\narea: {bounds_m: [0, 0, 4000, 4000]}\n"
        "mission: {start_m: [500, 500], goal_m: [1500, 1500]}\n"
    )
    assert main(["fly", str(place / "near.yaml"), "--out", str(place / "run"), "--quiet"]) == 0
    return place / "run"


def summary_of(recording: Path) -> str:
    """The page beside the events."""
    for chunk in rr.chunk.RrdReader(str(recording)).stream():
        if str(chunk.entity_path) == "/summary":
            cells = chunk.to_record_batch().to_pydict()
            return str(next(cell for name, cell in cells.items() if name.endswith("text"))[0][0])
    return ""
