"""Reads a path that somebody gives: CSV, GeoJSON, QGroundControl .plan, MAVLink .waypoints.

What is read is a polyline in the local plane; positions in degrees are put into a plane about the first.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NoReturn

import numpy as np
from numpy.typing import NDArray

from aircraft.frames import LocalPlane
from harness.files.input_file import InputError, read_text
from harness.files.wording import counted
from harness.run_files.given_path import SAME_PLACE_M
from harness.run_files.mission_items import Item, Waypoints, waypoints
from harness.scenario.sections import ALTITUDES_M

FloatArray = NDArray[np.float64]

MAX_BYTES: Final = 64_000_000
MAX_SPAN_M: Final = 500e3
SAME_ALTITUDE_M: Final = 1.0
LOCAL_COLUMNS: Final = (("x_m", "y_m"), ("east_m", "north_m"))
DEGREE_COLUMNS: Final = (("latitude_deg", "longitude_deg"), ("latitude", "longitude"), ("lat", "lon"))
ALTITUDE_COLUMNS: Final = ("altitude_m", "up_m", "z_m")
WPL: Final = "QGC WPL"


@dataclass(frozen=True, eq=False)
class GivenPath:
    """A path as it was given.

    Attributes:
        points_m: (n, 2) east, north; every point of the file, not all in one place.
        origin_deg: latitude and longitude of east = north = 0; None where the file does not say.
        altitude_m: above mean sea level; None where the file does not say.
    """

    points_m: FloatArray
    origin_deg: tuple[float, float] | None
    altitude_m: float | None


def read_path(path: Path, any_altitude: bool = False) -> GivenPath:
    """Reads a path; the name's ending says how it is written.

    Args:
        path: .csv, .geojson or .json, .plan, .waypoints.
        any_altitude: points at different altitudes are taken, for a flight whose altitude is given otherwise.

    Raises:
        InputError: the file cannot be read, is not of its format, or holds more than a path at one
            altitude that can be flown.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: is none of {', '.join(READERS)}; save the path as one of them")
    found = reader(read_text(path, MAX_BYTES, "a path"), str(path))
    if len(found.positions) < 2:
        raise InputError(f"{path}: has {counted(len(found.positions), 'point')}; a path has at least 2")
    origin = None if found.local else found.positions[0]
    points = np.array(found.positions if found.local else _in_plane(found.positions, str(path)))
    with np.errstate(over="ignore"):
        reach = max(float(np.ptp(points, axis=0).max()), float(np.abs(points).max()))
    if reach > MAX_SPAN_M:
        raise InputError(
            f"{path}: reaches {reach / 1e3:.0f} km; must stay within {MAX_SPAN_M / 1e3:.0f} km of its origin"
        )
    if np.hypot(*(points - points[0]).T).max() <= SAME_PLACE_M:
        raise InputError(f"{path}: all its points are in one place; a path has at least 2")
    return GivenPath(points, origin, _altitude(found.altitudes_m, any_altitude, str(path)))


def _in_plane(positions: Sequence[tuple[float, float]], source: str) -> list[tuple[float, float]]:
    for number, (latitude, longitude) in enumerate(positions):
        if not (abs(latitude) <= 85.0 and abs(longitude) <= 180.0):
            raise InputError(
                f"{source}: point {number} is at latitude {latitude:g}, longitude {longitude:g}; must be degrees "
                "within 85 and 180 (local metres can be given as CSV with the columns x_m,y_m)"
            )
    plane = LocalPlane(*positions[0])
    return [plane.plane(latitude, longitude) for latitude, longitude in positions]


def _altitude(altitudes_m: Sequence[float], any_altitude: bool, source: str) -> float | None:
    if any_altitude or not altitudes_m:
        return None
    first = altitudes_m[0]
    for number, altitude in enumerate(altitudes_m):
        if not abs(altitude - first) <= SAME_ALTITUDE_M:
            raise InputError(
                f"{source}: point {number} is at {altitude:g} m, point 0 at {first:g} m; a checked path has one "
                "altitude: level it or give --altitude-m"
            )
    lowest, highest = ALTITUDES_M
    if not lowest <= first <= highest:
        raise InputError(
            f"{source}: is at {first:g} m above the sea; must be between {lowest:g} and {highest:g} m, or give "
            "--altitude-m"
        )
    return first


def _csv(text: str, source: str) -> Waypoints:
    rows = csv.reader(text.splitlines())
    header = [name.strip().lower() for name in next(_rows(rows, source), [])]
    names = next((pair for pair in (*LOCAL_COLUMNS, *DEGREE_COLUMNS) if set(pair) <= set(header)), None)
    if names is None:
        raise InputError(
            f"{source}:1: has the columns {_shown(', '.join(header)) or 'none'}; must have x_m,y_m or "
            "latitude_deg,longitude_deg"
        )
    heights = [name for name in header if name in ALTITUDE_COLUMNS][:1]
    columns = [header.index(name) for name in (*names, *heights)]
    positions, altitudes = [], []
    for row in _rows(rows, source):
        if not any(cell.strip() for cell in row):
            continue
        if len(row) != len(header):
            raise InputError(f"{source}:{rows.line_num}: has {len(row)} cells, the header {len(header)}")
        first, second, *altitude = (
            _number(row[column].strip(), f"{source}:{rows.line_num}: {name}")
            for name, column in zip((*names, *heights), columns, strict=True)
        )
        positions.append((first, second))
        altitudes += altitude
    return Waypoints(names in LOCAL_COLUMNS, tuple(positions), tuple(altitudes))


def _rows(rows: Iterator[list[str]], source: str) -> Iterator[list[str]]:
    """The same rows; what the csv module does not take, as a fault of the file."""
    try:
        yield from rows
    except csv.Error as error:
        raise InputError(f"{source}: is not CSV ({error})") from error


def _shown(text: str) -> str:
    """A text as a line can show it."""
    short = text if len(text) <= 80 else f"{text[:77]}..."
    return short if short.isprintable() else ascii(short)


def _geojson(text: str, source: str) -> Waypoints:
    lines = list(_line_strings(_json(text, source), source, ""))
    if len(lines) != 1:
        raise InputError(f"{source}: has {len(lines)} LineStrings; must have exactly one, the path")
    (key, coordinates) = lines[0]
    if not isinstance(coordinates, list):
        raise InputError(f"{source}: {key}: must be a list of [longitude, latitude]")
    positions, altitudes = [], []
    for number, point in enumerate(coordinates):
        where = f"{source}: {key}[{number}]"
        if not isinstance(point, list) or len(point) not in (2, 3):
            raise InputError(f"{where}: must be [longitude, latitude] or [longitude, latitude, altitude]")
        longitude, latitude, *altitude = (_number(value, where) for value in point)
        positions.append((latitude, longitude))
        altitudes += altitude
    if altitudes and len(altitudes) != len(positions):
        raise InputError(f"{source}: {key}: has an altitude at some points only; give it at all or none")
    return Waypoints(False, tuple(positions), tuple(altitudes))


def _line_strings(node: Any, source: str, key: str) -> list[tuple[str, Any]]:
    """All LineStrings of a GeoJSON object (RFC 7946): where they are, and their coordinates."""
    kind = node.get("type") if isinstance(node, dict) else None
    if kind == "LineString":
        return [(f"{key}.coordinates".lstrip("."), node.get("coordinates"))]
    if kind == "Feature" and node.get("geometry") is None:  # it lies nowhere
        return []
    if kind == "Feature":
        return _line_strings(node.get("geometry"), source, f"{key}.geometry".lstrip("."))
    if kind in ("FeatureCollection", "GeometryCollection"):
        name = "features" if kind == "FeatureCollection" else "geometries"
        inner = node.get(name)
        if not isinstance(inner, list):
            raise InputError(f"{source}: {f'{key}.{name}'.lstrip('.')}: must be a list")
        found = []
        for number, part in enumerate(inner):
            found += _line_strings(part, source, f"{key}.{name}[{number}]".lstrip("."))
        return found
    if kind in ("Point", "MultiPoint", "Polygon", "MultiPolygon", "MultiLineString"):
        return []
    shown = f"the type {_shown(str(kind))}" if kind else "no type"
    raise InputError(f"{source}: {f'{key}: ' if key else ''}has {shown}; must be a GeoJSON LineString")


def _plan(text: str, source: str) -> Waypoints:
    plan = _json(text, source)
    if not isinstance(plan, dict) or plan.get("fileType") != "Plan":
        raise InputError(f'{source}: is not a plan of QGroundControl; must have "fileType": "Plan"')
    mission = plan.get("mission")
    listed = mission.get("items") if isinstance(mission, dict) else None
    if not isinstance(mission, dict) or not isinstance(listed, list):
        raise InputError(f"{source}: mission.items: is missing; it is required")
    home = mission.get("plannedHomePosition", [0.0, 0.0, 0.0])
    if not isinstance(home, list) or len(home) != 3:
        raise InputError(f"{source}: mission.plannedHomePosition: must be [latitude, longitude, altitude]")
    items = [_plan_item(item, number, source) for number, item in enumerate(listed)]
    return waypoints(items, _number(home[2], f"{source}: mission.plannedHomePosition[2]"))


def _plan_item(item: Any, number: int, source: str) -> Item:
    key = f"mission.items[{number}]"
    if not isinstance(item, dict):
        raise InputError(f"{source}: {key}: must be a mission item")
    if item.get("type") != "SimpleItem":
        kind = _shown(str(item.get("complexItemType") or item.get("type") or "without a type"))
        raise InputError(
            f"{source}: {key}: item {number + 1} is a complex item, {kind}; a path to be checked may only have "
            "MAV_CMD_NAV_WAYPOINT (16): remove the item"
        )
    params = item.get("params")
    if not isinstance(params, list) or len(params) != 7:
        raise InputError(f"{source}: {key}.params: must be a list of 7")
    # QGroundControl writes null where one of the first four is left to the autopilot; the others are the place.
    values = [0.0 if value is None else value for value in params[:4]] + params[4:]
    values = [_number(value, f"{source}: {key}.params[{i}]") for i, value in enumerate(values)]
    command, frame = (_whole(item.get(name), f"{source}: {key}.{name}") for name in ("command", "frame"))
    jump_id = item.get("doJumpId")
    shown = jump_id if isinstance(jump_id, int) else number + 1
    return Item(f"{source}: {key}", shown, command, frame, tuple(values))


def _waypoints(text: str, source: str) -> Waypoints:
    lines = text.splitlines()
    if not lines or not lines[0].startswith(WPL):
        raise InputError(f'{source}:1: must begin with "{WPL} 110"')
    items = []
    for number, line in enumerate(lines[1:], start=2):
        cells = line.split()
        if not cells:
            continue
        place = f"{source}:{number}"
        if len(cells) != 12:
            raise InputError(f"{place}: has {len(cells)} fields; a mission item has 12")
        index, frame, command = (_whole(cells[i], place) for i in (0, 2, 3))
        items.append(Item(place, index, command, frame, tuple(_number(c, place) for c in cells[4:11])))
    if not items:
        raise InputError(f"{source}: has no items; the first is home, the others are the path")
    return waypoints(items[1:], items[0].params[6])


def _json(text: str, source: str) -> Any:
    def refuse(name: str) -> NoReturn:
        raise InputError(f"{source}: has the number {name}; must be finite")

    try:
        return json.loads(text, parse_constant=refuse)
    except json.JSONDecodeError as error:
        raise InputError(f"{source}:{error.lineno}: is not JSON ({error.msg})") from error
    except RecursionError as error:
        raise InputError(f"{source}: is nested too deeply; must be a path") from error
    except InputError:
        raise
    except ValueError as error:  # what Python says of a number of thousands of digits
        raise InputError(f"{source}: has a number that is too long; must be a path") from error


def _number(value: Any, where: str) -> float:
    """A finite number, from JSON or from text."""
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{where}: is {_shown(str(value))!r}; must be a finite number")
    return number


def _whole(value: Any, where: str) -> int:
    number = _number(value, where)
    if number != int(number):
        raise InputError(f"{where}: is {number:g}; must be a whole number")
    return int(number)


READERS: Final[dict[str, Callable[[str, str], Waypoints]]] = {
    ".csv": _csv,
    ".geojson": _geojson,
    ".json": _geojson,
    ".plan": _plan,
    ".waypoints": _waypoints,
}
"""Reader by the ending of a file's name."""
