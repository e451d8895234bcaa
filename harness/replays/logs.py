"""Flight logs of autopilots as rows of positions: ULog (PX4), DataFlash (ArduPilot)."""

from __future__ import annotations

import io
import mmap
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from aircraft.frames import LocalPlane
from harness.files.input_file import InputError
from harness.flight.record import FloatArray
from harness.run_files.drawn_lines import NEEDS_LOGS

MAX_BYTES: Final = 1_000_000_000  # a larger log is refused
LONGEST_S: Final = 1e7  # a log whose times span more than this is damaged or had its clock set in flight
CLOCK_BACK_S: Final = 1.0  # a log whose clock goes back by more has two flights, or had it set in flight
ULOG_HEADER: Final = 16  # bytes of a ULog before its first message
ULOG_KINDS: Final = frozenset(b"BFIMPQARDLCSO")  # letters of the kinds of messages in a ULog
FIX_3D: Final = 3  # `Status` of a receiver with a three-dimensional fix, in DataFlash
DATAFLASH: Final = b"\xa3\x95\x80"  # a DataFlash log begins with this message, which describes formats
LAST_PAGE_BYTES: Final = 528  # a DataFlash log is written in pages: this much at its end may be anything
LONGEST_HELD_S: Final = 3.0  # a value is not known longer than this before or after it is in the log
DAMAGED: Final = "damaged: what cannot be read of it is passed over"
TRUE_AIRSPEED: Final = "true_airspeed_m_s"  # field of the topics `AIRSPEED_TOPICS` of PX4
AIRSPEED_TOPICS: Final = ("airspeed_validated", "airspeed")  # the first with a value above 0 counts
Series = tuple[FloatArray, dict[str, FloatArray]]
"""(n, 4) time (s), latitude, longitude (deg), altitude (m); (m, 2) time and value, by column of `flown`."""


def read_log(path: Path, plane: LocalPlane) -> tuple[dict[str, FloatArray], list[str]]:
    """Reads the columns of `flown` from a log, in a plane, with notes; InputError if it has no track or is damaged.

    One row for each place on earth, in order of time; other series are interpolated there.
    """
    notes: list[str] = []
    with reading(path):
        found, others = READERS[path.suffix.lower()](path, notes)
    places = found.reshape(-1, 4)
    _, latitude, longitude, _ = places.T
    known = np.isfinite(places).all(axis=1) & (np.abs(latitude) <= 90.0) & (np.abs(longitude) <= 360.0)
    places = places[known & ((latitude != 0.0) | (longitude != 0.0))]  # a receiver without a fix says 0, 0
    if (back_s := -float(np.diff(places[:, 0]).min(initial=0.0))) > CLOCK_BACK_S:
        raise InputError(f"{path}: its clock goes back by {back_s:g} s; give the log of one flight")
    if len(places := places[np.unique(places[:, 0], return_index=True)[1]]) < 2:
        raise InputError(f"{path}: has {len(places)} rows with a position; a track has at least 2")
    times = places[:, 0]
    east, north = np.array([plane.plane(*place) for place in places[:, 1:3].tolist()]).T
    columns = {"time_s": times - times[0], "east_m": east, "north_m": north, "up_m": places[:, 3]}
    return columns | {name: _at(times, *each.T) for name, each in others.items() if len(each)}, notes


def _at(times: FloatArray, known_s: FloatArray, values: FloatArray) -> FloatArray:
    """Returns values interpolated at other times, NaN more than `LONGEST_HELD_S` from those at which one is known."""
    rows = np.searchsorted(known_s, times)
    since_s, until_s = times - np.append(-np.inf, known_s)[rows], np.append(known_s, np.inf)[rows] - times
    return np.where(np.minimum(since_s, until_s) <= LONGEST_HELD_S, np.interp(times, known_s, values), np.nan)


class Command(NamedTuple):
    """One item of a mission in a log."""

    number: int
    command: int  # MAV_CMD
    first: float  # parameter 1
    acceptance_m: float  # parameter 2
    latitude_deg: float
    longitude_deg: float


def logged_mission(path: Path) -> tuple[list[Command], dict[str, float]]:
    """Returns an ArduPilot log's last mission (CMD: the last of each number below `CTot`) and its parameters (PARM)."""
    commands, total, parameters = dict[int, Command](), 0, dict[str, float]()
    with reading(path):
        for each in _messages(path, ("CMD", "PARM"), []):
            if each.get_type() == "PARM":
                parameters[each.Name] = float(each.Value)
            else:
                second, total = getattr(each, "Prm2", 0.0), int(each.CTot)  # not yet in logs of 2014
                row = (int(each.CNum), int(each.CId), each.Prm1, second, each.Lat, each.Lng)
                commands[row[0]] = Command(*row)
    return [commands[number] for number in sorted(commands) if number < total], parameters


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turns whatever a library says of a file, also in machine code, into a one-line InputError."""
    printed, before = io.StringIO(), os.dup(2)
    try:
        with open(os.devnull, "wb") as nothing, redirect_stdout(printed), redirect_stderr(printed):
            os.dup2(nothing.fileno(), 2)  # of a damaged file libraries print a line for each byte
            yield
    except ImportError as error:
        raise InputError(f"{path}: {NEEDS_LOGS} ({error.name})") from error
    except InputError:
        raise
    except Exception as error:
        text = " ".join(str(error).split())[:200] or type(error).__name__
        raise InputError(f"{path}: cannot be read as {path.suffix} ({text})") from error
    finally:
        os.dup2(before, 2)
        os.close(before)


def _ulog(path: Path, notes: list[str]) -> Series:
    """Reads PX4's log: global position, https://docs.px4.io (ULog file format), airspeed and roll where logged."""
    from pyulog import ULog

    with path.open("rb") as file:
        log = ULog(file, ["vehicle_global_position", "vehicle_attitude", *AIRSPEED_TOPICS])
    if log.file_corruption or not _is_whole(path):
        notes.append(DAMAGED)
    topics = {each.name: each.data for each in reversed(log.data_list)}
    if (data := topics.get("vehicle_global_position")) is None:
        raise InputError(f"{path}: has no topic vehicle_global_position")
    degrees = 1e-7 if np.issubdtype(np.asarray(data["lat"]).dtype, np.integer) else 1.0
    times_s, latitude, longitude = data["timestamp"] / 1e6, data["lat"] * degrees, data["lon"] * degrees
    places = np.column_stack((times_s, latitude, longitude, data["alt"]))
    valid = np.ones(len(places), dtype=bool)
    for name in ("lat_lon_valid", "alt_valid"):  # since PX4 1.16: else a row is what was known once
        valid &= np.asarray(data.get(name, valid), dtype=bool)
    others = {}
    for speeds in [topics[name] for name in AIRSPEED_TOPICS[::-1] if TRUE_AIRSPEED in topics.get(name, {})]:
        series = np.column_stack((speeds["timestamp"] / 1e6, speeds[TRUE_AIRSPEED]))
        if (series[:, 1] > 0.0).any():
            others["airspeed_tas_mps"] = series[np.isfinite(series[:, 1])]
    if "q[3]" in topics.get("vehicle_attitude", {}):
        attitude = topics["vehicle_attitude"]
        w, x, y, z = (attitude[f"q[{axis}]"] for axis in range(4))
        roll = np.degrees(np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)))
        others["roll_deg"] = np.column_stack((attitude["timestamp"] / 1e6, roll))
    return places[valid], others


def _is_whole(path: Path) -> bool:
    """Tells whether a ULog is a row of messages up to its end: two bytes of size, one of kind, and the content."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        place, end = ULOG_HEADER, len(data)
        while place + 3 <= end:
            if data[place + 2] not in ULOG_KINDS:
                return False
            place += 3 + data[place] + 256 * data[place + 1]
    return place == end


def _dataflash(path: Path, notes: list[str]) -> Series:
    """Reads ArduPilot's log: position of the estimator (POS), else of the first receiver (GPS), airspeed and roll."""
    place = ("Lat", "Lng", "Alt")
    keys: dict[str, tuple[str, ...]] = {"POS": place, "GPS": place, "ARSP": ("Airspeed",), "ATT": ("Roll",)}
    found: dict[str, dict[int, list[tuple[float, ...]]]] = {kind: {} for kind in keys}
    for each in _messages(path, tuple(keys), notes):
        if getattr(each, "H", True) and getattr(each, "Status", FIX_3D) >= FIX_3D:  # healthy, and with a fix
            kind = each.get_type()
            row = (each._timestamp, *(float(getattr(each, key)) for key in keys[kind]))
            found[kind].setdefault(getattr(each, "I", 0), []).append(row)
    first = {kind: np.array(rows[min(rows)] if rows else []) for kind, rows in found.items()}
    others = {"airspeed_ias_mps": first["ARSP"], "roll_deg": first["ATT"]}
    return first["POS"] if len(first["POS"]) else first["GPS"], others


def _messages(path: Path, kinds: tuple[str, ...], notes: list[str]) -> Iterator[Any]:
    """Yields the messages of some kinds in a DataFlash log, as pymavlink has them; notes where it is damaged."""
    from pymavlink.DFReader import DFReader_binary

    with path.open("rb") as file:
        if file.read(len(DATAFLASH)) != DATAFLASH:
            raise InputError(f"{path}: is no DataFlash log: such a file begins with {DATAFLASH.hex(' ')}")
    log: Any = DFReader_binary(str(path), zero_time_base=True)
    try:
        while (message := log.recv_match(type=list(kinds))) is not None:
            yield message
    finally:
        log.data_map.close()
        log.filehandle.close()
    held = sum(len(places) * log.formats[kind].len for kind, places in enumerate(log.offsets) if len(places))
    if log.data_len - held > LAST_PAGE_BYTES:
        notes.append(DAMAGED)


READERS: Final[dict[str, Callable[[Path, list[str]], Series]]] = {".ulg": _ulog, ".bin": _dataflash}
"""Reader by the ending of a file's name."""
