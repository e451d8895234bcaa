"""The kinds of world files: told from what stands in a file, each with its reader."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

from harness.world_files import bounded
from harness.world_files.parts import Contents, Reading, WorldFileError
from harness.world_files.readers import (
    city_json,
    ed269,
    fences,
    gazebo,
    geo_json,
    geotiff,
    grids,
    kml,
    occupancy,
    open_air,
    osm,
    vector,
)

Reader = Callable[[Path, Reading], Contents]

KINDS: Final[dict[str, Reader]] = {
    "geotiff": geotiff.read,
    "ascii_grid": grids.read_ascii,
    "srtm": grids.read_srtm,
    "numpy_dem": grids.read_numpy,
    "osm": osm.read_xml,
    "osm_pbf": osm.read_pbf,
    "osm_json": osm.read_json,
    "cityjson": city_json.read,
    "geojson": geo_json.read,
    "kml": kml.read,
    "openair": open_air.read,
    "ed269": ed269.read,
    "ed318": geo_json.read_ed318,
    "plan_fence": fences.read_plan,
    "ardupilot_fence": fences.read_ardupilot,
    "ros_map": occupancy.read_ros,
    "moving_ai": occupancy.read_moving_ai,
    "gazebo_world": gazebo.read,
    "vector": vector.read,
}
"""Readers by the name of their kind."""

VECTOR_ENDINGS: Final = (".gpkg", ".shp", ".dxf", ".fgb", ".gml", ".tab", ".gdb")
PACKED: Final = {
    ".hgt": "srtm",
    ".kml": "kml",
    "elevation.npy": "numpy_dem",
    ".shp": "vector",
    ".gpkg": "vector",
}
"""What a ZIP archive is by what lies in it."""
ROOTS: Final = {"osm": "osm", "kml": "kml", "sdf": "gazebo_world", "gazebo": "gazebo_world"}
"""What an XML file is by its first element."""
MEANT: Final = {
    ".pgm": "an image; give the YAML file of its ROS map",
    ".png": "an image; give the YAML file of its ROS map",
    ".jpg": "an image; there is nothing in it that could be an obstacle",
    ".scen": "a list of MovingAI problems; give the .map file that it names",
    ".npy": "a plain array; save it as ESRI ASCII grid or GeoTIFF",
    ".las": "a point cloud; make a GeoTIFF of its heights (pdal, gdal_grid)",
    ".laz": "a point cloud; make a GeoTIFF of its heights (pdal, gdal_grid)",
    ".igc": "a flight, not a world; `wayproof check` takes flown paths",
    ".gpx": "a track, not a world; `wayproof check` takes paths",
    ".gz": "packed; unpack it and give the file",
    ".bz2": "packed; unpack it and give the file",
    ".xz": "packed; unpack it and give the file",
    ".7z": "packed; unpack it and give the file",
    ".shx": "part of a Shapefile; give the .shp file",
    ".dbf": "part of a Shapefile; give the .shp file",
    ".dt2": "DTED; convert it with gdal_translate to GeoTIFF",
    ".obj": "a mesh; give CityJSON or GeoJSON of the footprints",
    ".stl": "a mesh; give CityJSON or GeoJSON of the footprints",
}
"""What some files are that are no world file."""
FAMILIES: Final = (
    "terrain (GeoTIFF, ESRI ASCII, SRTM .hgt), buildings (OSM XML or PBF, CityJSON, GeoJSON), airspace (GeoJSON, KML, "
    "OpenAir, ED-269, ED-318), fences (.plan, ArduPilot), occupancy (ROS map_server, MovingAI, Gazebo .world)"
)

_XML_ROOT: Final = re.compile(rb"<([A-Za-z_][\w.-]*:)?([A-Za-z_][\w.-]*)[\s>/]")
_OPEN_AIR: Final = re.compile(r"^(AC\s|AN\s(.*\n)+?(DP|DC|DA|DB|DY)\s)", re.IGNORECASE | re.MULTILINE)
"""An airspace: a class, or a name and something of a shape."""
_PLACES: Final = re.compile(r"\s*[-+]?\d+\.\d+[\s,]+[-+]?\d+\.\d+\s*$")


def read(path: Path, kind: str | None, reading: Reading) -> Contents:
    """Reads a world file.

    Args:
        path: the file.
        kind: a name of `KINDS`; None: told from the file.
        reading: what the file leaves open.

    Raises:
        WorldFileError: it is of none of the kinds, or cannot be used.
    """
    found = kind or kind_of(path)
    contents = KINDS[found](path, reading)
    return replace(contents, kind=found, notes=_together(contents.notes))


def _together(notes: tuple[str, ...]) -> tuple[str, ...]:
    """Notes with those that say the same of several parts made one."""
    same: dict[str, list[str]] = {}
    for note in notes:
        name, found, sentence = note.partition(": its ")
        same.setdefault(f"its {sentence}" if found else note, []).append(name if found else "")
    return tuple(
        sentence if not names[0] else f"{names[0]}: {sentence}" if len(names) == 1 else
        f"{len(names)} parts, {names[0]} the first: {sentence}"
        for sentence, names in same.items()
    )  # fmt: skip


def kind_of(path: Path) -> str:
    """The kind of a file, told from what stands in it.

    Raises:
        WorldFileError: it is of none of them; the message says what would do.
    """
    first, ending = bounded.head(path), path.suffix.lower()
    if not first:
        raise WorldFileError("is empty; get it again")
    found = _binary(path, first, ending) or _text(path, first, ending)
    if found is not None:
        return found
    meant = MEANT.get(ending)
    if meant:
        raise WorldFileError(f"is {meant}")
    raise WorldFileError(f"is of no kind that is known; give {FAMILIES}")


def _binary(path: Path, first: bytes, ending: str) -> str | None:
    if first[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return "geotiff"
    if first[:2] == b"PK":
        names = _names(path)
        for end, kind in PACKED.items():
            if any(name.endswith(end) for name in names):
                return kind
        if ending == ".zip":
            held = next((name.rpartition("/")[2][:40] for name in names if not name.endswith("/")), "nothing")
            raise WorldFileError(f"is a ZIP archive with {held!r}; unpack it and give the file")
    if ending == ".hgt" or path.name.lower().endswith(".hgt.gz"):
        return "srtm"
    if b"OSMHeader" in first[:64]:
        return "osm_pbf"
    return "vector" if ending in VECTOR_ENDINGS else None


def _names(path: Path) -> list[str]:
    import zipfile

    try:
        with zipfile.ZipFile(path) as archive:
            return [name.lower() for name in archive.namelist()]
    except (zipfile.BadZipFile, OSError, ValueError) as error:
        raise WorldFileError("is a damaged ZIP archive; get it again") from error


def _text(path: Path, first: bytes, ending: str) -> str | None:
    if first.startswith(bounded.UTF_16):
        first = bounded.text_of(first).encode()
    if b"\0" in first:
        return None
    start = first.lstrip(b"\xef\xbb\xbf\x1e \t\r\n")
    if start[:1] == b"<":
        roots = _XML_ROOT.search(start)
        return ROOTS.get(roots[2].decode("ascii").lower()) if roots else None
    if start[:1] in b"{[":
        return _json(path)
    text = bounded.text_of(first)
    lines = text.splitlines()[:-1] if len(first) == 65_536 else text.splitlines()
    lines = [line.strip() for line in lines if line.strip() and not line.lstrip().startswith(("*", "#"))]
    if not lines:
        return None
    words = lines[0].lower().split()
    if words[0] in GRID_KEYS and any(line.lower().startswith("ncols") for line in lines[:6]):
        return "ascii_grid"
    if words[0] == "type" and any(line == "map" for line in lines[:6]):
        return "moving_ai"
    if words[0] == "rally":
        raise WorldFileError("is a list of rally points: places to return to, no obstacles; give the fence")
    if lines[0].startswith("QGC WPL"):
        return "ardupilot_fence"
    if any(line.startswith("image:") for line in lines) and any(
        line.startswith("resolution:") for line in lines
    ):
        return "ros_map"
    if _OPEN_AIR.search("\n".join(lines)):
        return "openair"
    if len(lines) >= 2 and all(_PLACES.match(line) for line in lines[:20]):
        return "ardupilot_fence"
    return None


GRID_KEYS: Final = (
    "ncols",
    "nrows",
    "xllcorner",
    "yllcorner",
    "xllcenter",
    "yllcenter",
    "cellsize",
    "dx",
    "dy",
)
"""Words with which an ESRI ASCII grid may begin."""
_JSON_KINDS: Final = (
    (re.compile(rb'"CityObjects"\s*:'), "cityjson"),
    (re.compile(rb'"geoFence"\s*:|"fileType"\s*:\s*"Plan"'), "plan_fence"),
    (re.compile(rb'"UASZoneList"\s*:|"horizontalProjection"\s*:'), "ed269"),
    (re.compile(rb'"(?:layer|extent)"\s*:\s*\{'), "ed318"),
    (
        re.compile(rb'"type"\s*:\s*"(?:FeatureCollection|Feature|Polygon|MultiPolygon|GeometryCollection)"'),
        "geojson",
    ),
    (re.compile(rb'"elements"\s*:\s*\['), "osm_json"),
)
"""What a JSON file is by what it has somewhere; the first that is found counts."""


def _json(path: Path) -> str | None:
    data = bounded.read_bytes(path, bounded.MAX_TREE_BYTES)
    if data.startswith(bounded.UTF_16):
        data = bounded.text_of(data).encode()
    found = next((kind for pattern, kind in _JSON_KINDS if pattern.search(data)), None)
    if found is None:
        bounded.json_of(path)  # says so where it is no JSON at all
    return found
