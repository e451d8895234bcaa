"""Flight logs and tables written by hand after their specifications, read into the plane of a replay."""

import math
import struct
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from aircraft.frames import LocalPlane
from harness.replays.flown import read_flown
from wayproof import InputError, replay

PLANE = LocalPlane(47.0, 8.0)
ROWS = np.arange(20, dtype=np.float64)
TIME_S, EAST_M, NORTH_M, UP_M = 0.5 * ROWS, 10.0 * ROWS, 30.0 * ROWS, 400.0 + ROWS
"""A climb to the north-north-east from the origin."""


def degrees() -> list[tuple[float, float]]:
    return [PLANE.geodetic(east, north) for east, north in zip(EAST_M, NORTH_M, strict=True)]


def write_csv(path: Path) -> None:
    rows = [f"{t},{a!r},{b!r},{up}" for t, (a, b), up in zip(TIME_S, degrees(), UP_M, strict=True)]
    path.write_text("\n".join(["time_s,latitude_deg,longitude_deg,altitude_m", *rows]) + "\n")


def message(kind: bytes, body: bytes) -> bytes:
    """A message of a ULog, after https://docs.px4.io/main/en/dev_log/ulog_file_format.html."""
    return struct.pack("<H", len(body)) + kind + body


def write_ulog(path: Path, unknown: int = 2) -> None:
    """Positions with their flags of validity, false at rows 3 and 4, and true airspeed, one topic of it all NaN."""
    forms = (
        b"vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;"
        b"bool lat_lon_valid;bool alt_valid;",
        b"airspeed_validated:uint64_t timestamp;float true_airspeed_m_s;",
        b"airspeed:uint64_t timestamp;float true_airspeed_m_s;",
    )
    data = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message(b"B", bytes(40))
    data += b"".join(message(b"F", form) for form in forms)
    for number, form in enumerate(forms):
        data += message(b"A", struct.pack("<BH", 0, number) + form.partition(b":")[0])
    for row, (latitude, longitude) in enumerate(degrees()):
        time_us = int(1e6 * (5.0 + TIME_S[row]))
        place = struct.pack("<Qddf??", time_us, latitude, longitude, UP_M[row], row != 3, row != 4)
        data += message(b"D", struct.pack("<H", 0) + place)
        for topic in (1, 2):
            speed = math.nan if topic == unknown else 15.0 + 0.5 * row
            data += message(b"D", struct.pack("<HQf", topic, time_us, speed))
    path.write_bytes(data)


def form(kind: int, name: bytes, size: int, types: bytes, columns: bytes) -> bytes:
    return DATAFLASH + struct.pack("<BB4s16s64s", kind, size, name, types, columns)


DATAFLASH = b"\xa3\x95\x80"
FORMATS = form(128, b"FMT", 89, b"BBnNZ", b"Type,Length,Name,Format,Columns")


def write_dataflash(path: Path) -> None:
    """The least DataFlash log: a format of formats, those of POS and ARSP, and rows of them; sensor 0 is broken."""
    data = FORMATS + form(140, b"POS", 3 + 8 + 4 + 4 + 4, b"QLLf", b"TimeUS,Lat,Lng,Alt")
    data += form(142, b"ARSP", 3 + 8 + 1 + 1 + 4, b"QBBf", b"TimeUS,I,H,Airspeed")
    for row, (latitude, longitude) in enumerate(degrees()):
        at = (int(1e6 * TIME_S[row]) + 1, round(latitude * 1e7), round(longitude * 1e7), UP_M[row])
        data += b"\xa3\x95\x8c" + struct.pack("<Qiif", *at)
        for sensor in ((0, 0, 5.0), (1, 1, 15.0 + 0.5 * row)):
            data += b"\xa3\x95\x8e" + struct.pack("<QBBf", at[0], *sensor)
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("ending", "write", "near_m", "seconds", "airspeed"),
    [
        (".csv", write_csv, 1e-3, 0.5, ""),
        (".ulg", write_ulog, 1e-3, 0.5, "airspeed_tas_mps"),
        (".ulg", partial(write_ulog, unknown=1), 1e-3, 0.5, "airspeed_tas_mps"),
        (".bin", write_dataflash, 0.05, 0.5, "airspeed_ias_mps"),
    ],
)
def test_a_log_is_the_track_that_was_written(
    ending: str, write: Callable[[Path], None], near_m: float, seconds: float, airspeed: str, tmp_path: Path
) -> None:
    path = tmp_path / f"flight{ending}"
    write(path)
    found = read_flown(path, PLANE)
    kept = np.setdiff1d(np.arange(20), (3, 4) if ending == ".ulg" else ())
    assert found["time_s"] == pytest.approx(seconds * kept, abs=1e-3)
    assert np.hypot(found["east_m"] - EAST_M[kept], found["north_m"] - NORTH_M[kept]).max() < near_m
    assert found["up_m"] == pytest.approx(UP_M[kept], abs=0.01)
    course = np.degrees(np.arctan2(found["ve_mps"], found["vn_mps"]))
    assert course == pytest.approx([math.degrees(math.atan2(1, 3))] * len(kept), abs=5.0)
    if airspeed:
        assert found[airspeed] == pytest.approx(15.0 + 0.5 * kept, abs=1e-5)
        assert found.notes == ("velocity over the ground: from the positions",)
    else:
        assert found.airspeed_mps is None


def mission_in(folder: Path) -> Path:
    (folder / "mission.json").write_text('{"mission": {"corners_east_north_m": [[0, 0], [900, 0]]}}')
    return folder / "mission.json"


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("a.igc", b"", "is no flight log that is read; must end in .parquet, .csv, .ulg, .bin"),
        ("a.ulg", b"not a log", "cannot be read as .ulg"),
        ("a.csv", b"a,b\n1,2\n", "has no column time_s; must have time_s, and east_m, north_m or latitude_deg"),
        ("a.csv", b"time_s,x_m,y_m\n0,1,2\n1,1,2\n2,1,2\n", "is slower than 4.2 m/s over the ground; must be"),
        ("a.csv", b"time_s,x_m,y_m\n0,1,2\n1,two,3\n", "x_m: row 2: is 'two'; must be a finite number"),
        ("a.csv", b"time_s,x_m,y_m,e\n0,1,2,3\n", "time_s: must have at least 3 rows; columns passed over: e"),
        ("a.csv", b"time_s,x_m,y_m\n2,1,2\n1,1,2\n0,1,2\n", "goes back from 2 to 1; must rise from row to row"),
        ("a.csv", b"time_s,x_m,y_m\n0,1,2\n1e6,1,2\n2e8,1,2\n", "lasts 2e+08 s; must be at most 1e+07 s"),
        ("a.csv", b"time_s,x_m,y_m\n" + b"".join(b"%d,%d,%d\n" % (k, 10 * k, 900 * (k % 2)) for k in range(9)),
            "its places go to and fro, 1800 m in 2 s to come 20 m on (medians); must be one aircraft's"),
        ("a.csv", b"time_s,x_m,y_m,ve_mps,vn_mps\n" + b"".join(b"%d,%d,0,0,10\n" % (k, 10 * k) for k in range(9)),
            "ve_mps, vn_mps: lead 28 m off the places after 2 s, in which these move 20 m (medians)"),
        ("a.csv", b"time_s,x_m,y_m\n0,1\n", "a.csv:2: has 2 cells, the header 3"),
        ("a.csv", b"time_s,latitude_deg,longitude_deg\n0,1,2\n1,2,3\n2,3,4\n", "and the mission in metres"),
        ("a.parquet", b"PAR1", "cannot be read as .parquet"),
        ("a.bin", b"not a log", "is no DataFlash log: such a file begins with a3 95 80"),
    ],
)  # fmt: skip
def test_a_file_that_is_no_log_is_told(name: str, content: bytes, sentence: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as raised:
        replay(tmp_path / name, "aerosonde", mission_in(tmp_path))
    assert sentence in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_damaged_or_doubled_log_is_told_in_a_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """pymavlink's machine code prints a line for each byte that it skips."""
    write_dataflash(whole := tmp_path / "a.bin")
    (tmp_path / "two.bin").write_bytes(2 * whole.read_bytes())
    with pytest.raises(InputError, match=r"its clock goes back by 9\.5 s; give the log of one flight"):
        read_flown(tmp_path / "two.bin", PLANE)
    whole.write_bytes(whole.read_bytes()[:86] + bytes(300))
    with pytest.raises(InputError, match=r"has 0 rows with a position|cannot be read as"):
        replay(whole, "aerosonde", mission_in(tmp_path))
    assert capfd.readouterr() == ("", "")


def test_a_row_without_a_place_or_a_time_of_its_own_is_no_row_and_told(tmp_path: Path) -> None:
    rows = b"0,0,10, True\n2,nan,nan, True\n2,10,30, true\n2,10,30, true\n3,20,50, True\n4,0,0, False\n"
    (tmp_path / "a.csv").write_bytes(b"\xef\xbb\xbftime_s, x_m, y_m, autonomous\n" + rows)
    track = read_flown(tmp_path / "a.csv", PLANE)
    assert [*track["time_s"], *track["east_m"], *track["north_m"]] == [0, 2, 3, 0, 10, 20, 10, 30, 50]
    passed = [each.removesuffix(" passed over") for each in track.notes[:2]]
    assert passed == ["1 row without time_s, east_m or north_m", "1 row at the time of the row before"]
    assert "altitude: the table has none; taken to be 0 m" in track.notes


def test_places_off_the_earth_and_infinite_airspeeds_are_not_known(tmp_path: Path) -> None:
    rows = ["0,0,0,17", "1,95,8,17", "3,-45,179.9999,0", "5,-45,-179.9999,17", "6,-45,-179.9998,inf"]
    (tmp_path / "a.csv").write_text("\n".join(["time_s,lat,lon,airspeed_tas_mps", *rows]))
    track = read_flown(tmp_path / "a.csv")
    assert track["time_s"].tolist() == [3.0, 5.0, 6.0]
    assert track["east_m"] == pytest.approx([0.0, 15.77, 23.65], abs=0.05)  # 7.885 m are 1e-4 deg there
    assert np.isfinite(track["airspeed_tas_mps"]).tolist() == [False, True, False]
    assert track.notes[-1] == "2 rows without airspeed_tas_mps above 0"
    (tmp_path / "a.csv").write_text("time_s,lat,lon\n0,470000000,80000000\n")
    with pytest.raises(InputError, match="lat, lon: is 470000000, 80000000 in row 1; must be degrees"):
        read_flown(tmp_path / "a.csv")


def test_an_airspeed_that_ends_is_held_for_seconds_and_told(tmp_path: Path) -> None:
    """The sensor's last row is at 3.5 s; later ones are those of another."""
    write_dataflash(log := tmp_path / "a.bin")
    for row in range(8, 20):
        at = b"\x8e" + struct.pack("<Q", int(1e6 * TIME_S[row]) + 1)
        log.write_bytes(log.read_bytes().replace(at + b"\x01", at + b"\x02"))
    known = np.isfinite((found := read_flown(log, PLANE))["airspeed_ias_mps"])
    assert known[[*range(13), *range(14, 20)]].tolist() == [True] * 13 + [False] * 6
    assert found.notes[-1].endswith("rows without airspeed_ias_mps above 0")


def test_of_two_receivers_the_first_is_taken_where_it_has_a_fix(tmp_path: Path) -> None:
    data = FORMATS
    data += form(141, b"GPS", 3 + 8 + 1 + 1 + 4 + 4 + 4, b"QBBLLf", b"TimeUS,I,Status,Lat,Lng,Alt")
    for row, (latitude, longitude) in enumerate(degrees()):
        for receiver, off_deg in ((0, 0.0), (1, 1e-4)):
            at = (round((latitude + off_deg) * 1e7), round(longitude * 1e7), 400.0)
            fix = (500_000 * row + receiver + 1, receiver, 1 if row < 2 else 3, *at)
            data += b"\xa3\x95\x8d" + struct.pack("<QBBiif", *fix)
    (tmp_path / "a.bin").write_bytes(data)
    found = read_flown(tmp_path / "a.bin", PLANE)
    assert len(found["time_s"]) == 18
    assert np.hypot(found["east_m"] - EAST_M[2:], found["north_m"] - NORTH_M[2:]).max() < 0.05


@pytest.mark.parametrize(
    ("ending", "write", "row"), [(".ulg", write_ulog, 3 + 2 + 30), (".bin", write_dataflash, 3 + 20)]
)
def test_of_a_damaged_log_it_is_said_that_it_is(
    ending: str, write: Callable[[Path], None], row: int, tmp_path: Path
) -> None:
    def notes_of(name: str) -> list[str]:
        found = read_flown(tmp_path / name, PLANE)
        assert len(found["time_s"]) >= 7
        return [note for note in found.notes if note.endswith("passed over")]

    write(tmp_path / f"a{ending}")
    assert notes_of(f"a{ending}") == []
    whole = (tmp_path / f"a{ending}").read_bytes()
    garbage = b"B99zz\r\n" * (100 if ending == ".bin" else 3)  # more than the last page
    (tmp_path / f"damaged{ending}").write_bytes(whole[: -10 * row] + garbage + whole[-10 * row :])
    assert len(notes_of(f"damaged{ending}")) == 1
    if ending == ".ulg":
        (tmp_path / "torn.ulg").write_bytes(whole[:-9])
        assert len(notes_of("torn.ulg")) == 1
