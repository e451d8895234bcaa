"""Drawn lines and recorded tracks: CSV, GeoJSON (RFC 7946), KML, GPX 1.1, and IGC of gliders' loggers.

Each file has one line, the path; the rest is counted in notes. IGC: FAI, Specification for GNSS Flight Recorders.
"""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from harness.files import kml
from harness.files.input_file import InputError, finite, listed, parsed_json, shown
from harness.files.kml import Point
from harness.files.wording import counted
from planner.interface import BoolArray, FloatArray

LOCAL: Final = (("x_m", "y_m"), ("east_m", "north_m"))  # CSV columns of a place in the local plane
DEGREES: Final = (("latitude_deg", "longitude_deg"), ("latitude", "longitude"), ("lat", "lon"))  # CSV columns
ALTITUDES: Final[tuple[str, ...]] = ("altitude_m", "up_m", "z_m")  # CSV columns above mean sea level
ABOVE_GROUND: Final = "altitude_agl_m"  # CSV column of an altitude above ground
ALTITUDE_WORD: Final = re.compile(  # in the name of a column of altitudes, as `alt_ft`, read or not
    r"altitude(?!_?(mode|type|frame|ref|err|acc|rate))|height_above|(^(up|z|fl)|(?<![a-z])((rel_?)?alt|elev?|elevation"
    r"|height|hgt|hae|agl|[ah]?msl))([ _(\[]+(m|ft|feet|met(er|re)s?|rel|agl|a?msl|above|ground|sea|level)[)\]]?)*$"
)
SPEED_WORD: Final = re.compile(r"^(?!.*wind).*(speed|velocity|(?<![a-z])[tice]as(?![a-z]))")  # of a column
SPEED_NOT_FLOWN: Final = "not flown: the airspeed is --airspeed-mps, else the aircraft's cruise"
SINGLE_TYPES: Final = ("LineString", "Polygon", "Point")  # those with several parts are called Multi...
ABSOLUTE, RELATIVE, CLAMPED = "absolute", "relativeToGround", "clampToGround"
"""Values of KML's altitudeMode, the last the default; at any other value, and at that, the altitude means nothing."""

FLYING_MPS: Final = 15.0 / 3.6  # a flight lasts from the first to the last fix this fast; else it stands
FASTEST_MPS, STEEPEST_MPS = 150.0, 80.0  # over ground, and up or down: a fix that needs more is an error
MOST_BROKEN_SHARE: Final = 0.05  # a file in which more than this share of the fixes cannot be read is refused
DATE_RECORD: Final = re.compile(r"^H[FOP]DTE", re.MULTILINE)  # beginning of an IGC file's line with the date
EARTH_RADIUS_M: Final = 6_371_000.0
NEEDS_LOGS: Final = "needs the extra wayproof[logs]: pip install 'wayproof[logs]'"


class PathAsRead(NamedTuple):
    """A line as its file has it: its place `where`, for faults, and notes on what else is in the file.

    Points are latitude, longitude (deg; `local`: east, north in m), altitude (m) or None, above sea or `above_ground`.
    """

    where: str
    points: list[Point]
    notes: list[str]
    above_ground: bool = False
    local: bool = False


def _notes_on_others(others: Mapping[str, int]) -> list[str]:
    return [f"{counted(n, what)} beside the path passed over" for what, n in others.items() if n > 0]


def read_csv(text: str, source: str, any_altitude: bool = False) -> PathAsRead:
    """Reads a CSV file: a header, and a point a row; with `any_altitude` altitudes not read are passed over."""
    (line, header), *filled = _filled_rows(text, source) or [(1, [])]
    header = [name.strip().lower() for name in header]
    names = _columns(header, f"{source}:{line}", any_altitude)
    points: list[Point] = []
    for number, row in filled:
        at = f"{source}:{number}"
        if len(row) != len(header):
            raise InputError(f"{at}: has {counted(len(row), 'cell')}, the header {len(header)}")
        cells = dict(zip(header, row, strict=True))
        first, second, *height = (finite(cells[name], f"{at}: {name}", text=True) for name in names)
        points.append((first, second, height[0] if height else None))
    above_ground, local = names[2:] == [ABOVE_GROUND], tuple(names[:2]) in LOCAL
    others = ", ".join(name or "one without a name" for name in header if name not in names)
    notes = [f"columns passed over: {shown(others)}"] if others else []
    if speeds := [name for name in header if SPEED_WORD.search(name)]:
        notes.append(f"{shown(', '.join(speeds))} {SPEED_NOT_FLOWN}")
    return PathAsRead(source, points, notes, above_ground, local)


def _filled_rows(text: str, source: str) -> list[tuple[int, list[str]]]:
    """Returns the rows that are neither blank nor a comment, with their line numbers."""
    rows = csv.reader(["" if line.lstrip().startswith("#") else line for line in text.splitlines()])
    try:
        return [(rows.line_num, row) for row in rows if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise InputError(f"{source}: is not CSV ({error})") from error


def _columns(header: list[str], where: str, any_altitude: bool) -> list[str]:
    if (pair := next((pair for pair in (*LOCAL, *DEGREES) if set(pair) <= set(header)), None)) is None:
        text = f"{where}: has the columns {shown(', '.join(header)) or 'none'}; must have x_m,y_m or latitude_deg,"
        raise InputError(f"{text}longitude_deg, and may have altitude_m or altitude_agl_m, parted by commas")
    names = [*pair, *[name for name in (*ALTITUDES, ABOVE_GROUND) if name in header][:1]]
    unread = next(filter(ALTITUDE_WORD.search, header), None)
    if unread is not None and len(names) == 2 and not any_altitude:
        wanted = f"metres as altitude_m (above the sea) or {ABOVE_GROUND}; or give --altitude-m"
        raise InputError(f"{where}: {shown(unread)}: is no altitude that is read; must be {wanted}")
    for name in names:
        if header.count(name) > 1:
            raise InputError(f"{where}: {name}: stands {header.count(name)} times; must stand once")
    return names


def read_geojson(text: str, source: str) -> PathAsRead:
    """Reads the path of a GeoJSON file, its one LineString."""
    from harness.world_files.parts import WGS84
    from harness.world_files.plane import geodetic
    from harness.world_files.readers.maps import crs_named, features_of

    content = parsed_json(text, source)
    try:
        shapes, crs = list(_shapes(content)), crs_named(content)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
    if len(lines := [(key, line) for key, kind, line in shapes if kind == "LineString"]) != 1:
        raise InputError(f"{source}: has {len(lines)} LineStrings; must have exactly one, the path")
    where, points = f"{source}: {lines[0][0]}", []
    for number, point in enumerate(listed(lines[0][1], where, " of [longitude, latitude]")):
        at = f"{where}[{number}]"
        if not isinstance(point, list) or len(point) not in (2, 3):
            raise InputError(f"{at}: must be [longitude, latitude] or [longitude, latitude, altitude]")
        longitude, latitude, *altitude = (finite(value, at) for value in point)
        points.append((latitude, longitude, altitude[0] if altitude else None))
    if points and crs != WGS84:
        y, x, altitudes = zip(*points, strict=True)
        north, east = geodetic(crs, np.array(x), np.array(y))
        points = list(zip(north.tolist(), east.tolist(), altitudes, strict=True))
    notes = _notes_on_others(Counter(kind for _, kind, _ in shapes) - Counter(("LineString",)))
    given = {key for tags, *_ in features_of(content) for key, value in tags.items() if value is not None}
    if others := ", ".join(sorted(given - {"identifier", "name"})):
        notes.append(f"attributes passed over: {shown(others)}")
    return PathAsRead(where, points, notes)


def _shapes(content: Any) -> Iterator[tuple[str, str, Any]]:
    """Yields key, type and coordinates of all geometries in a GeoJSON, of one with several parts each part."""
    from harness.world_files.readers.maps import features_of, simple

    for geometry, at in (one for _, shape, key in features_of(content) for one in simple(shape, key)):
        kind, given = str(geometry.get("type") or ""), geometry.get("coordinates")
        key = f"{at}.coordinates".lstrip(".")
        single = kind.removeprefix("Multi")
        if kind in SINGLE_TYPES:
            yield key, kind, given
        elif single in SINGLE_TYPES:
            yield from ((f"{key}[{number}]", single, part) for number, part in enumerate(listed(given, key)))
        elif geometry:  # else it lies nowhere
            found = f"the type {shown(kind)}" if kind else "no type"
            raise InputError(f"{at}: has {found}; must be a GeoJSON LineString".removeprefix(": "))


def read_kml(data: bytes, source: str, most: int) -> PathAsRead:
    """Reads the path of a KML file, its one LineString, with altitudes if their mode gives them a meaning."""
    if len((found := kml.read_kml(data, source, most)).lines) != 1:
        named = f" ({', '.join(line.name for line in found.lines[:4])})" if found.lines else ""
        raise InputError(f"{found.source}: has {len(found.lines)} lines{named}; must have exactly one, the path")
    (line,) = found.lines
    points, notes = list(line.rings[0]), _notes_on_others({**found.others, "Polygon": len(found.polygons)})
    if line.mode not in (ABSOLUTE, RELATIVE):
        if any(altitude for *_, altitude in points):
            notes.append(f"altitudes passed over: their altitudeMode is {shown(line.mode or CLAMPED)}")
        points = [(latitude, longitude, None) for latitude, longitude, _ in points]
    return PathAsRead(f"{found.source}: {line.name}", points, notes, line.mode == RELATIVE)


def read_gpx(text: str, source: str) -> PathAsRead:
    """Reads the path of a GPX file, its one track, else its one route, without waypoints."""
    root = kml.parsed_xml(text.encode(), source, "gpx")
    tracks, routes = kml.named(root, "trk"), kml.named(root, "rte")
    lines, kind, tag = (tracks, "track", "trkpt") if tracks else (routes, "route", "rtept")
    if len(lines) != 1:
        raise InputError(f"{source}: has {counted(len(lines), kind)}; must have exactly one, the path")
    points: list[Point] = []
    for number, each in enumerate(kml.named(lines[0], tag)):
        where = f"{source}: {tag} {number}"
        latitude, longitude = (finite(each.get(key), f"{where}: {key}", text=True) for key in ("lat", "lon"))
        height = kml.text_of(each, "ele")
        points.append((latitude, longitude, finite(height, f"{where}: ele", text=True) if height else None))
    segments = len(kml.named(lines[0], "trkseg"))
    notes = [f"{segments} segments of the track joined by straight lines"] if segments > 1 else []
    notes += _notes_on_others({"route": len(routes) if tracks else 0, "waypoint": len(kml.named(root, "wpt"))})
    return PathAsRead(f"{source}: {shown(kml.text_of(lines[0], 'name') or tag)}", points, notes)


def read_igc(text: str, source: str) -> PathAsRead:
    """Reads the fixes of a flight from takeoff to landing at GNSS altitudes; without one, all at pressure altitudes."""
    fixes, broken = _fixes(text, source)
    placed = fixes[np.abs(fixes[:, :2]).max(axis=1) > 1e-9]
    leaps, skips = _leaps(placed[:-1], placed[1:]), _leaps(placed[:-2], placed[2:])
    right = placed[~np.pad(leaps[:-1] & leaps[1:] & ~skips, 1)] if len(placed) > 2 else placed
    speed_mps = _away_m(right[:-1], right[1:]) / np.maximum(np.diff(right[:, 4]), 1e-9)
    moving = np.flatnonzero(speed_mps >= FLYING_MPS)
    flown = right[moving[0] : moving[-1] + 2] if len(moving) else right[:0]
    if len(flown) < 2:
        raise InputError(f"{source}: has {len(fixes)} fixes, none of them in flight; must be a flight")
    altitudes, note = flown[:, 2], "GNSS altitudes of the logger taken as above the sea"
    if not (known := altitudes != 0).all() and flown[:, 3].any():
        altitudes, note = flown[:, 3], "pressure altitudes of the logger taken as above the sea"
        known = np.full(len(flown), True)
    if not (has_some := known.sum() >= 2):
        known, note = np.full(len(flown), True), "its logger has no altitudes"
    out = {
        "without an altitude passed over: the logger has no barometer": len(flown) - int(known.sum()),
        "that cannot be read passed over": broken,
        "too far from both neighbours passed over": len(placed) - len(right),
        "on the ground not flown": len(right) - len(flown),
        "without a position passed over": len(fixes) - len(placed),
    }
    rows = zip(flown[known, :2].tolist(), altitudes[known].tolist(), strict=True)
    points = [(*place, altitude if has_some else None) for place, altitude in rows]
    return PathAsRead(source, points, [note, *(f"{counted(n, 'B record')} {w}" for w, n in out.items() if n)])


def _away_m(before: FloatArray, after: FloatArray) -> FloatArray:
    """(k,) distances over the ground (m) between (k, 5) fixes and others."""
    north, east = np.radians((after - before)[:, :2]).T
    east = np.remainder(east + np.pi, 2.0 * np.pi) - np.pi
    return np.asarray(EARTH_RADIUS_M * np.hypot(north, east * np.cos(np.radians(after[:, 0]))))


def _leaps(before: FloatArray, after: FloatArray) -> BoolArray:
    """(k,) whether a glider cannot get from fixes to others in the time between them; an altitude of 0 is none."""
    elapsed = after[:, 4] - before[:, 4]
    rise = np.where(before[:, 2] * after[:, 2] != 0, after[:, 2] - before[:, 2], 0.0)
    fast = (_away_m(before, after) > FASTEST_MPS * elapsed) | (np.abs(rise) > STEEPEST_MPS * elapsed)
    return np.asarray(fast & (elapsed > 0.0))


def _fixes(text: str, source: str) -> tuple[FloatArray, int]:
    """(n, 5) latitude, longitude (deg), GNSS altitude (m; 0: no 3-D fix), barometric one, time (s); unread records."""
    try:
        from aerofiles.igc import Reader
    except ImportError as error:
        raise InputError(f"{source}: {NEEDS_LOGS} ({error.name})") from error
    if not text.lstrip("\ufeff").startswith("A"):
        raise InputError(f"{source}:1: must begin with an A record, the logger's number; is no IGC file")
    if not DATE_RECORD.search(text):
        raise InputError(f"{source}: has no date (an HFDTE record); must have one before the first fix")
    try:
        broken, fixes = Reader(skip_duplicates=True).read(io.StringIO(text))["fix_records"]
    except Exception as error:  # whatever its parser meets
        raise InputError(f"{source}: is not IGC ({type(error).__name__}: {error})") from error
    if len(broken) > MOST_BROKEN_SHARE * len(fixes):
        broken_text = f"{counted(len(broken), 'B record')} that cannot be read, of {len(broken) + len(fixes)}"
        raise InputError(f"{source}: has {broken_text}; must be at most {MOST_BROKEN_SHARE:.0%}")
    rows = []
    for fix in fixes:
        height = 0.0 if fix.get("validity") == "V" else fix["gps_alt"] or 0.0
        rows.append((fix["lat"], fix["lon"], height, fix["pressure_alt"] or 0.0, fix["datetime"].timestamp()))
    return np.array(rows, dtype=np.float64).reshape(-1, 5), len(broken)
