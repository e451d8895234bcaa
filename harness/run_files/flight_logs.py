"""Flight logs of other tools as tracks in the plane of a run: ULog, DataFlash, IGC, MCAP, CSV."""

from __future__ import annotations

import contextlib
import csv
import io
import math
import mmap
import os
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import numpy as np

from aircraft.frames import LocalPlane
from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.flight.record import FloatArray
from harness.run_files.csv_path import ABOVE_GROUND, ALTITUDES, DEGREES, LOCAL
from harness.run_files.igc_path import NEEDS_LOGS, igc_fixes

MAX_BYTES: Final = 1_000_000_000
MAX_TEXT_BYTES: Final = 200_000_000
"""Largest size of a log that is read line by line: some millions of rows."""
FARTHEST_M: Final = 2e7
"""No place on earth is farther from another."""
LONGEST_S: Final = 1e7
"""No flight is longer; where a clock was set meanwhile, times are."""
LEAST_ROWS: Final = 2
FIX_3D: Final = 3
"""`Status` of a receiver with a three-dimensional fix, in DataFlash."""
ULOG_HEADER: Final = 16
ULOG_KINDS: Final = frozenset(b"BFIMPQARDLCSO")
"""Bytes before the messages of a ULog, and the kinds of those."""
DATAFLASH: Final = b"\xa3\x95\x80"
"""What a DataFlash log begins with: a message that describes formats."""
LAST_PAGE: Final = 528
"""Bytes at the end of a DataFlash log that may hold anything: it is written in pages."""
DAMAGED: Final = "damaged: what cannot be read of it is passed over"
TORN: Final = "damaged, or torn: read as far as it goes"


@dataclass(frozen=True, eq=False)
class LogTrack:
    """A flown track out of a log. All arrays are equally long; time begins with 0.

    Attributes:
        time_s: (n,) since the first row.
        east_m: (n,) in the plane of the run beside which it is shown.
        north_m: (n,).
        up_m: (n,) altitude as the log has it, above mean sea level where it says so.
        notes: on what of the log is not there, one sentence each.
    """

    time_s: FloatArray
    east_m: FloatArray
    north_m: FloatArray
    up_m: FloatArray
    notes: tuple[str, ...] = ()

    @property
    def groundspeed_mps(self) -> FloatArray:
        """(n,) from the positions."""
        if len(self.time_s) < LEAST_ROWS:
            return np.zeros(len(self.time_s))
        speed: FloatArray = np.hypot(
            np.gradient(self.east_m, self.time_s), np.gradient(self.north_m, self.time_s)
        )
        return speed

    @property
    def course_deg(self) -> FloatArray:
        """(n,) clockwise from north, from the positions."""
        course: FloatArray = (
            np.degrees(np.arctan2(np.gradient(self.east_m), np.gradient(self.north_m))) % 360.0
        )
        return course


Rows = list[tuple[float, float, float, float]]
"""Time in s, latitude and longitude in degrees, altitude in m."""


def read_log(path: Path, plane: LocalPlane) -> LogTrack:
    """Reads a flight log; the name's ending says which kind it is.

    Args:
        path: .ulg (PX4), .bin (ArduPilot DataFlash), .igc, .mcap (positions as foxglove.LocationFix), .csv (time_s, and
            x_m,y_m or latitude_deg,longitude_deg, and altitude_m where there is one).
        plane: positions in degrees are put into it.

    Raises:
        InputError: the file is none of these, cannot be read, or holds no track; or a package is missing.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: is no flight log that can be shown; must end in {', '.join(READERS)}")
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    size, most = path.stat().st_size, MAX_TEXT_BYTES if reader in (_csv, _igc) else MAX_BYTES
    if size > most:
        raise InputError(f"{path}: has {size / 1e6:.0f} MB; at most {most / 1e6:g} MB are read")
    notes: list[str] = []
    try:
        # Of a damaged file libraries print a line for each byte.
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            rows = reader(path, notes)
    except ImportError as error:
        raise InputError(f"{path}: {NEEDS_LOGS} ({error.name})") from error
    except InputError:
        raise
    except Exception as error:  # whatever a library says of a damaged file
        text = " ".join(str(error).split())[:200] or type(error).__name__
        raise InputError(f"{path}: cannot be read as {path.suffix} ({text})") from error
    return replace(_track(rows, plane, path), notes=tuple(notes))


def _track(rows: Rows | LogTrack, plane: LocalPlane, path: Path) -> LogTrack:
    if isinstance(rows, LogTrack):
        found = rows
    else:
        finite = [row for row in rows if all(map(math.isfinite, row)) and _on_earth(*row[1:3])]
        places = np.array([plane.plane(row[1], row[2]) for row in finite]).reshape(-1, 2)
        times, heights = np.array([row[0] for row in finite]), np.array([row[3] for row in finite])
        found = LogTrack(times, places[:, 0], places[:, 1], heights)
    columns = np.array((found.time_s, found.east_m, found.north_m, found.up_m))
    known = np.isfinite(columns).all(axis=0) & (np.abs(columns[1:]) <= FARTHEST_M).all(axis=0)
    found = LogTrack(*columns[:, known])
    order = np.unique(found.time_s, return_index=True)[1]
    if len(order) < LEAST_ROWS:
        raise InputError(f"{path}: has {len(order)} rows with a position; a track has at least {LEAST_ROWS}")
    time_s = found.time_s[order]
    if time_s[-1] - time_s[0] > LONGEST_S:
        raise InputError(
            f"{path}: its times reach from {time_s[0]:g} to {time_s[-1]:g} s; a flight may take {LONGEST_S:g} s at most"
        )
    return LogTrack(time_s - time_s[0], found.east_m[order], found.north_m[order], found.up_m[order])


def _on_earth(latitude_deg: float, longitude_deg: float) -> bool:
    """Whether a place is one: receivers without a fix say 0, 0."""
    there = abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 360.0
    return there and (latitude_deg, longitude_deg) != (0.0, 0.0)


def _ulog(path: Path, notes: list[str]) -> Rows:
    """PX4: the estimator's global position, https://docs.px4.io (ULog file format)."""
    from pyulog import ULog

    with path.open("rb") as file:
        log = ULog(file, ["vehicle_global_position"])
    if log.file_corruption or not _is_whole(path):
        notes.append(DAMAGED)
    if not log.data_list:
        raise InputError(f"{path}: has no topic vehicle_global_position")
    data = log.data_list[0].data
    degrees = 1e-7 if np.issubdtype(np.asarray(data["lat"]).dtype, np.integer) else 1.0
    rows = np.column_stack(
        (
            np.asarray(data["timestamp"]) / 1e6,
            np.asarray(data["lat"]) * degrees,
            np.asarray(data["lon"]) * degrees,
            np.asarray(data["alt"], dtype=np.float64),
        )
    )
    valid = np.ones(len(rows), dtype=bool)
    for name in ("lat_lon_valid", "alt_valid"):  # since PX4 1.16: else a row is what was known once
        valid &= np.asarray(data.get(name, valid), dtype=bool)
    found: Rows = [(row[0], row[1], row[2], row[3]) for row in rows[valid].tolist()]
    return found


def _is_whole(path: Path) -> bool:
    """Whether a ULog is a row of messages up to its end: two bytes of size, one of kind, and so many more."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        place, end = ULOG_HEADER, len(data)
        while place + 3 <= end:
            if data[place + 2] not in ULOG_KINDS:
                return False
            place += 3 + data[place] + 256 * data[place + 1]
    return place == end


def _dataflash(path: Path, notes: list[str]) -> Rows:
    """ArduPilot: the estimator's position (POS), or the receiver's (GPS) where there is none."""
    from pymavlink.DFReader import DFReader_binary

    found: dict[str, Rows] = {"POS": [], "GPS": []}
    with path.open("rb") as file:
        if file.read(len(DATAFLASH)) != DATAFLASH:
            raise InputError(f"{path}: is no DataFlash log: such a file begins with {DATAFLASH.hex(' ')}")
    with _silent():
        log: Any = DFReader_binary(str(path), zero_time_base=True)
        try:
            while (message := log.recv_match(type=list(found))) is not None:
                if getattr(message, "I", 0) or getattr(message, "Status", FIX_3D) < FIX_3D:
                    continue  # a second receiver, some metres from the first, or one without a fix
                row = (message._timestamp, message.Lat, message.Lng, message.Alt)
                found[message.get_type()].append(tuple(map(float, row)))  # type: ignore[arg-type]
        finally:
            log.data_map.close()
            log.filehandle.close()
    held = sum(len(places) * log.formats[kind].len for kind, places in enumerate(log.offsets) if len(places))
    if log.data_len - held > LAST_PAGE:
        notes.append(DAMAGED)
    return found["POS"] or found["GPS"]


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Lets nothing through to standard error, not of machine code either."""
    with open(os.devnull, "wb") as nothing:
        before = os.dup(2)
        os.dup2(nothing.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(before, 2)
            os.close(before)


def _igc(path: Path, notes: list[str]) -> Rows:
    """Gliders: fixes with the receiver's altitude, or the pressure altitude where that is 0."""
    fixes, broken = igc_fixes(path.read_text(encoding="latin-1"), str(path))
    if broken:
        notes.append(f"{counted(broken, 'B record')} that cannot be read passed over")
    if any(fix["gps_alt"] for fix in fixes) and not all(fix["gps_alt"] for fix in fixes):
        notes.append("where its receiver has no altitude, that of its barometer is shown, if there is one")
    return [
        (
            fix["datetime"].timestamp(),
            fix["lat"],
            fix["lon"],
            float(fix["gps_alt"] or fix["pressure_alt"] or 0),
        )
        for fix in fixes
    ]


def _mcap(path: Path, notes: list[str]) -> Rows:
    """Messages of the schema foxglove.LocationFix, as protobuf or JSON, of the topic that has most of them.

    A file that is torn or damaged is read as far as it goes, which is noted.
    """
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader
    from mcap_protobuf.decoder import DecoderFactory

    factory, topics, broken = DecoderFactory(), dict[str, Rows](), 0
    with path.open("rb") as file:
        messages = NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False)
        try:
            for schema, channel, message in messages:
                if schema is None or schema.name != "foxglove.LocationFix":
                    continue
                decode = factory.decoder_for(channel.message_encoding, schema) or _plain
                try:
                    fix = decode(message.data)
                    row = (
                        message.log_time / 1e9,
                        float(fix.latitude),
                        float(fix.longitude),
                        float(fix.altitude),
                    )
                except Exception:  # whatever a library says of a damaged message
                    broken += 1
                    continue
                topics.setdefault(channel.topic, []).append(row)
        except (McapError, ValueError, EOFError, struct.error) as error:
            if not topics:
                raise InputError(f"{path}: cannot be read as .mcap ({error})") from error
            notes.append(TORN)
    if broken:
        notes.append(f"{counted(broken, 'message')} of foxglove.LocationFix without a position passed over")
    return max(topics.values(), key=len, default=[])


def _plain(data: bytes) -> SimpleNamespace:
    """A message in JSON."""
    import json

    return SimpleNamespace(**{"altitude": 0.0, **json.loads(data)})


def _csv(path: Path, notes: list[str]) -> Rows | LogTrack:
    """A table with the column time_s and those of a path in CSV; a number may be nan."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        table = csv.DictReader(file, skipinitialspace=True)
        header = set(table.fieldnames or ())
        place = next((pair for pair in (*LOCAL, *DEGREES) if header.issuperset(pair)), None)
        if "time_s" not in header or place is None:
            raise InputError(
                f"{path}:1: must have the columns time_s and x_m,y_m or latitude_deg,longitude_deg"
            )
        height = next((name for name in (*ALTITUDES, ABOVE_GROUND) if name in header), None)
        if height is None:
            notes.append("has no altitudes: shown at 0 m")
        elif height == ABOVE_GROUND:
            notes.append("altitudes above the ground, shown as if above the sea")
        wanted = ["time_s", *place, *([height] if height else [])]
        rows: Rows = []
        for row in table:
            try:
                time_s, first, second, *up_m = (float(row[name]) for name in wanted)
            except (TypeError, ValueError) as error:
                told = f"{', '.join(wanted[:-1])} or {wanted[-1]}"
                raise InputError(f"{path}:{table.line_num}: has no number in {told}") from error
            rows.append((time_s, first, second, up_m[0] if up_m else 0.0))
    return LogTrack(*np.array(rows, dtype=np.float64).reshape(-1, 4).T) if place in LOCAL else rows


READERS: Final[dict[str, Callable[[Path, list[str]], Rows | LogTrack]]] = {
    ".ulg": _ulog,
    ".bin": _dataflash,
    ".igc": _igc,
    ".mcap": _mcap,
    ".csv": _csv,
}
"""Reader by the ending of a file's name."""
