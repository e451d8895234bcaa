"""Drawn lines and recorded tracks of maps and GPS tools: CSV, GeoJSON (RFC 7946), KML, GPX 1.1.

Each file has exactly one line, the path. Polygons are fences; what else is there is counted in notes.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from harness.files import kml
from harness.files.input_file import InputError
from harness.files.kml import Point
from harness.files.mavlink.fences import Fence
from harness.files.values import finite, listed, parsed_json, shown
from harness.files.wording import counted
from harness.run_files.fences import Fences

LOCAL: Final = (("x_m", "y_m"), ("east_m", "north_m"))
"""Columns of CSV: a place in the local plane."""
DEGREES: Final = (("latitude_deg", "longitude_deg"), ("latitude", "longitude"), ("lat", "lon"))
"""Columns of a place in degrees."""
ALTITUDES: Final[tuple[str, ...]] = ("altitude_m", "up_m", "z_m")
"""Columns of an altitude above mean sea level."""
ABOVE_GROUND: Final = "altitude_agl_m"
"""Column of an altitude above ground."""
MOST_NAMED: Final = 4
"""Columns that are not read and that a note names."""
PARTS: Final = {"MultiLineString": "LineString", "MultiPolygon": "Polygon", "MultiPoint": "Point"}
"""What a geometry of several parts is made of."""
COLLECTIONS: Final = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
MEANINGS: Final = ("exclusion", "inclusion", "none")
"""What a feature's property `fence` says of its polygons: to stay out of (the default), inside of, or neither."""
ABSOLUTE, RELATIVE, CLAMPED = "absolute", "relativeToGround", "clampToGround"
"""Values of KML's altitudeMode; with any other the altitude means nothing. The last is the default."""


@dataclass(frozen=True)
class PathAsRead:
    """A path as its file has it.

    Attributes:
        local: positions are east and north in metres; else latitude and longitude in degrees.
        positions: one a point.
        altitudes_m: above mean sea level, one a point; none where the file has none.
        above_ground: the altitudes are above the ground instead.
        fences: areas that come with it, their positions as those of the points.
        notes: what else is in the file and does not change the path, a line each.
    """

    local: bool
    positions: tuple[tuple[float, float], ...]
    altitudes_m: tuple[float, ...]
    above_ground: bool = False
    fences: Fences = field(default_factory=Fences)
    notes: tuple[str, ...] = ()


def _of_points(
    points: Sequence[Point],
    where: str,
    fences: Sequence[Fence],
    notes: Sequence[str],
    above_ground: bool = False,
) -> PathAsRead:
    """A path in degrees."""
    heights = tuple(altitude for *_, altitude in points if altitude is not None)
    if heights and len(heights) != len(points):
        raise InputError(
            f"{where}: has an altitude at {len(heights)} of {len(points)} points; give all or none"
        )
    positions = tuple((latitude, longitude) for latitude, longitude, _ in points)
    above_ground &= bool(heights)
    return PathAsRead(False, positions, heights, above_ground, Fences(tuple(fences)), tuple(notes))


def _beside(others: Mapping[str, int]) -> list[str]:
    """What is said of what else is in a file."""
    return [
        f"{counted(count, what)} beside the path passed over" for what, count in others.items() if count > 0
    ]


def read_csv(text: str, source: str) -> PathAsRead:
    """The path of a CSV file: a header, and a point a row; blank lines and comments after # are passed over."""
    (line, header), *filled = _filled(text, source) or [(1, [])]
    header = [name.strip().lower() for name in header]
    names, heights = _columns(header, f"{source}:{line}")
    wanted = (*names, *heights)
    found = []
    for number, row in filled:
        if len(row) != len(header):
            raise InputError(f"{source}:{number}: has {len(row)} cells, the header {len(header)}")
        cells = dict(zip(header, row, strict=True))
        found.append([finite(cells[name].strip(), f"{source}:{number}: {name}") for name in wanted])
    return PathAsRead(
        names in LOCAL,
        tuple((row[0], row[1]) for row in found),
        tuple(row[2] for row in found if heights),
        above_ground=heights == [ABOVE_GROUND],
        notes=_other_columns([name for name in header if name not in wanted]),
    )


def _other_columns(header: Sequence[str]) -> tuple[str, ...]:
    """What is said of columns that are not read."""
    others = [shown(name) or "one without a name" for name in header]
    more = f" and {len(others) - MOST_NAMED} more" if len(others) > MOST_NAMED else ""
    return (f"columns passed over: {', '.join(others[:MOST_NAMED])}{more}",) if others else ()


def _filled(text: str, source: str) -> list[tuple[int, list[str]]]:
    """The rows that are neither blank nor a comment, with their lines."""
    rows = csv.reader(["" if line.lstrip().startswith("#") else line for line in text.splitlines()])
    try:
        return [(rows.line_num, row) for row in rows if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise InputError(f"{source}: is not CSV ({error})") from error


def _columns(header: list[str], where: str) -> tuple[tuple[str, str], list[str]]:
    """The columns of the place, and that of the altitude where there is one."""
    names = next((pair for pair in (*LOCAL, *DEGREES) if set(pair) <= set(header)), None)
    if names is None:
        raise InputError(
            f"{where}: has the columns {shown(', '.join(header)) or 'none'}; must have x_m,y_m or "
            "latitude_deg,longitude_deg, and may have altitude_m or altitude_agl_m, parted by commas"
        )
    heights = [name for name in (*ALTITUDES, ABOVE_GROUND) if name in header][:1]
    for name in (*names, *heights):
        if header.count(name) > 1:
            raise InputError(f"{where}: {name}: stands {header.count(name)} times; must stand once")
    return names, heights


class _Shape(NamedTuple):
    """A geometry of one part of GeoJSON: where it stands, and what its feature says that it is."""

    key: str
    kind: str
    coordinates: Any
    meaning: str | None


def read_geojson(text: str, source: str) -> PathAsRead:
    """The path of a GeoJSON file: its one LineString."""
    shapes = list(_shapes(parsed_json(text, source), source, "", None))
    lines = [shape for shape in shapes if shape.kind == "LineString"]
    if len(lines) != 1:
        raise InputError(f"{source}: has {len(lines)} LineStrings; must have exactly one, the path")
    fenced = [shape for shape in shapes if shape.kind == "Polygon" and shape.meaning != "none"]
    others = Counter(shape.kind for shape in shapes if shape not in (lines[0], *fenced))
    where = f"{source}: {lines[0].key}"
    fences = [_fence(shape, source) for shape in fenced]
    return _of_points(_places(lines[0].coordinates, where), where, fences, _beside(others))


def _shapes(node: Any, source: str, key: str, meaning: str | None) -> Iterator[_Shape]:
    """All geometries of one part of a GeoJSON object."""
    node = node if isinstance(node, dict) else {}
    kind, before = str(node.get("type") or ""), f"{key}." if key else ""
    if kind == "Feature":
        if node.get("geometry") is not None:  # else it lies nowhere
            meaning = _meaning(node.get("properties"), f"{source}: {before}properties.fence")
            yield from _shapes(node["geometry"], source, f"{before}geometry", meaning)
    elif kind in COLLECTIONS:
        key = f"{before}{COLLECTIONS[kind]}"
        for number, part in enumerate(listed(node.get(COLLECTIONS[kind]), f"{source}: {key}")):
            yield from _shapes(part, source, f"{key}[{number}]", meaning)
    elif kind in PARTS:
        key = f"{before}coordinates"
        for number, part in enumerate(listed(node.get("coordinates"), f"{source}: {key}")):
            yield _Shape(f"{key}[{number}]", PARTS[kind], part, meaning)
    elif kind in PARTS.values():
        yield _Shape(f"{before}coordinates", kind, node.get("coordinates"), meaning)
    else:
        told, where = f"the type {shown(kind)}" if kind else "no type", f"{source}: {key}".removesuffix(": ")
        raise InputError(f"{where}: has {told}; must be a GeoJSON LineString")


def _meaning(properties: Any, where: str) -> str | None:
    meaning = properties.get("fence") if isinstance(properties, dict) else None
    if meaning is not None and meaning not in MEANINGS:
        raise InputError(f"{where}: is {shown(str(meaning))!r}; must be one of {', '.join(MEANINGS)}")
    return meaning


def _fence(shape: _Shape, source: str) -> Fence:
    where = f"{source}: {shape.key}"
    rings = listed(shape.coordinates, where, " of rings, each a list of [longitude, latitude]")
    places = [[place[:2] for place in _places(ring, f"{where}[{k}]")] for k, ring in enumerate(rings)]
    name = shape.key.replace(".coordinates", "").replace(".geometry", "")
    return Fence(name, shape.meaning == "inclusion", tuple(map(tuple, places)))


def _places(coordinates: Any, where: str) -> list[Point]:
    found: list[Point] = []
    for number, point in enumerate(listed(coordinates, where, " of [longitude, latitude]")):
        at = f"{where}[{number}]"
        if not isinstance(point, list) or len(point) not in (2, 3):
            raise InputError(f"{at}: must be [longitude, latitude] or [longitude, latitude, altitude]")
        longitude, latitude, *altitude = (finite(value, at) for value in point)
        found.append((latitude, longitude, altitude[0] if altitude else None))
    return found


def read_kml(data: bytes, source: str, most: int) -> PathAsRead:
    """The path of a KML file: its one LineString or gx:Track, with the altitudes that their mode gives a meaning."""
    found = kml.read_kml(data, source, most)
    source = found.source
    if len(found.lines) != 1:
        told = f" ({', '.join(line.name for line in found.lines[:4])})" if found.lines else ""
        raise InputError(f"{source}: has {len(found.lines)} lines{told}; must have exactly one, the path")
    (line,) = found.lines
    points, notes = line.rings[0], _beside(found.others)
    if line.mode not in (ABSOLUTE, RELATIVE):
        if any(altitude for *_, altitude in points):
            notes.append(f"altitudes passed over: their altitudeMode is {shown(line.mode or CLAMPED)}")
        points = tuple((latitude, longitude, None) for latitude, longitude, _ in points)
    fences = [
        Fence(each.name, False, tuple(tuple(point[:2] for point in ring) for ring in each.rings))
        for each in found.polygons
    ]
    return _of_points(points, f"{source}: {line.name}", fences, notes, line.mode == RELATIVE)


def read_gpx(text: str, source: str) -> PathAsRead:
    """The path of a GPX file: its one track, else its one route; waypoints are passed over."""
    root = kml.parsed_xml(text.encode(), source, "gpx")
    tracks, routes = list(kml.named(root, "trk")), list(kml.named(root, "rte"))
    lines, kind, tag = (tracks, "track", "trkpt") if tracks else (routes, "route", "rtept")
    if len(lines) != 1:
        raise InputError(f"{source}: has {counted(len(lines), kind)}; must have exactly one, the path")
    points: list[Point] = []
    for number, each in enumerate(kml.named(lines[0], tag)):
        where = f"{source}: {tag} {number}"
        latitude, longitude = (finite(each.get(key), f"{where}: {key}") for key in ("lat", "lon"))
        height = kml.text_of(each, "ele")
        points.append((latitude, longitude, finite(height, f"{where}: ele") if height else None))
    segments = sum(1 for _ in kml.named(lines[0], "trkseg"))
    notes = [f"{segments} segments of the track joined by straight lines"] if segments > 1 else []
    notes += _beside(
        {"route": len(routes) if tracks else 0, "waypoint": sum(1 for _ in kml.named(root, "wpt"))}
    )
    return _of_points(points, f"{source}: {shown(kml.text_of(lines[0], 'name') or tag)}", (), notes)
