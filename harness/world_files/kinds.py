"""The kinds of world files, recognised by the content of a file, each with its reader."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

from harness.files.input_file import InputError
from harness.world_files import bounded
from harness.world_files.parts import Contents, FileSpec
from harness.world_files.readers import city_json, fences, maps, occupancy, open_air, osm, raster, zones
from harness.world_files.readers.footprints import finished

Reader = Callable[[FileSpec], Contents]
GROUPS: Final[dict[str, dict[str, Reader]]] = {  # readers by kind; a group stands for any of its kinds
    "terrain": {
        **dict.fromkeys(("geotiff", "ascii_grid", "srtm"), raster.read),
        "numpy_dem": raster.read_numpy,
    },
    "buildings": {
        "osm": osm.read_xml,
        "osm_pbf": osm.read_pbf,
        "cityjson": city_json.read,
        "geojson": maps.read_geojson,
    },
    "airspace": {
        "geojson": maps.read_geojson,
        "kml": maps.read_kml_polygons,
        "openair": open_air.read,
        "ed269": zones.read_ed269,
        "ed318": zones.read_ed318,
    },
    "fences": {"plan_fence": fences.read_plan, "ardupilot_fence": fences.read_ardupilot},
    "occupancy": {"ros_map": occupancy.read_ros, "moving_ai": occupancy.read_moving_ai},
}
KINDS: Final[dict[str, Reader]] = {kind: read for group in GROUPS.values() for kind, read in group.items()}

IMAGE: Final = "an image; give the YAML file of its ROS map"
GAZEBO: Final = "a Gazebo world; give its footprints as GeoJSON, or its cells as a MovingAI .map"
FLIGHT: Final = "a flight, not a world; `wayproof check` takes flown paths"
REFUSED: Final = {  # what a file that is not read is, by its ending or kind, and what to give instead
    **{".pgm": IMAGE, ".png": IMAGE, ".world": GAZEBO, ".sdf": GAZEBO, ".igc": FLIGHT, ".gpx": FLIGHT},
    **dict.fromkeys((".gpkg", ".shp", ".fgb"), "a vector file; make GeoJSON of it (ogr2ogr a.geojson FILE)"),
    ".scen": "a list of MovingAI problems; give the .map file that it names",
    ".gz": "a packed file; unpack it",
    ".npy": "a plain array; save it as GeoTIFF or ESRI ASCII grid",
    "rally": "a list of rally points: places to return to, no obstacles; give the fence",
    "cityjsonseq": "a sequence of CityJSON features; make CityJSON of it (cjseq collect)",
    "overpass": "JSON of Overpass; ask it for XML ([out:xml]) and give that",
}
FAMILIES: Final = "; ".join(f"{group} ({', '.join(kinds)})" for group, kinds in GROUPS.items())
HEAD_BYTES: Final = 65_536  # a file that is not JSON is recognised by this many bytes at its beginning
_BINARY_BEGINS: Final = (
    ("geotiff", re.compile(rb"II[*+]\0|MM\0[*+]")),
    ("osm_pbf", re.compile(rb"(?s).{0,53}OSMHeader")),
)
_KIND_IN_ZIP: Final = {".hgt": "srtm", "elevation.npy": "numpy_dem", ".kml": "kml"}  # by the end of a name
_PLACE_LINE: Final = r"[ \t]*[-+]?\d+\.\d+[ \t,]+[-+]?\d+\.\d+[ \t]*\n"  # latitude and longitude in a line
_TEXTS: Final = (  # kinds of texts without comments; an airspace has a class, or a name and a shape
    ("rally", r"\Arally\b"),
    ("osm", r"\A<(?:[?!][^<]*<)*osm[\s>/]"),
    ("kml", r"\A<(?:[?!][^<]*<)*(?:[a-z_][\w.-]*:)?kml[\s>/]"),
    ("ascii_grid", r"\A(?:(?:nrows|[xy]ll(?:corner|center)|cellsize)\b.*\n){0,5}ncols\b"),
    ("moving_ai", r"\Atype\b(?:.*\n){1,5}?map$"),
    ("ros_map", r"\A(?=[^\0]*^image:)(?=[^\0]*^resolution:)"),
    ("openair", r"^(AC\s|AN\s(.*\n)+?(DP|DC|DA|DB|DY)\s)"),
    ("ardupilot_fence", rf"\A(?:QGC WPL.*\n.|(?:{_PLACE_LINE}){{3}})"),
)
_JSON_PATTERNS: Final = (  # kind of a JSON file by a key that it has anywhere; the first that is found counts
    ("overpass", r'"generator"\s*:\s*"Overpass'),
    ("cityjsonseq", r'"CityJSONFeature"'),
    ("cityjson", r'"CityObjects"\s*:'),
    ("plan_fence", r'"geoFence"\s*:|"fileType"\s*:\s*"Plan"'),
    ("ed269", r'"UASZoneList"\s*:|"horizontalProjection"\s*:'),
    ("ed318", r'"(?:layer|extent)"\s*:\s*\{[^{}]*"(?:upper|lower|uom|subType|radius)'),
    ("geojson", r'"type"\s*:\s*"((Feature|Geometry)(Collection)?|(Multi)?(Polygon|LineString|Point))"'),
)


def read(spec: FileSpec) -> Contents:
    """Reads a world file as its kind; where that is None or one of `GROUPS`, the content tells the kind."""
    bounded.read_bytes(spec.path, first=1)  # a library might wait for who writes a pipe
    found = spec.kind if spec.kind in KINDS else kind_of(spec.path)
    if spec.kind in GROUPS and found not in GROUPS[spec.kind]:
        raise InputError(f"is of the kind {found}, not {spec.kind}; leave kind out, or give {found}")
    contents = finished(replace(KINDS[found](spec), kind=found))
    return replace(contents, notes=_merge(contents.notes))


def _merge(notes: tuple[str, ...]) -> tuple[str, ...]:
    """Joins notes that say the same of several parts into one."""
    names: dict[str, list[str]] = {}
    for note in notes:
        name, its, sentence = note.rpartition(": its ")
        names.setdefault(its + sentence, []).append(name)
    merged = []
    for sentence, of in names.items():
        first = of[0] or ("a part" if sentence.startswith(": its ") else "")
        merged.append((f"{len(of)} parts, {first} the first" if first and len(of) > 1 else first) + sentence)
    return tuple(merged)


def kind_of(path: Path) -> str:
    """Tells the kind of a file from its content; for any other file the InputError says what to give instead."""
    first, ending = bounded.read_bytes(path, first=HEAD_BYTES), path.suffix.lower()
    if not first:
        raise InputError("is empty; get it again")
    if first.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError("is UTF-16; save it as UTF-8")
    if ending == ".hgt":
        return "srtm"
    found = next((kind for kind, pattern in _BINARY_BEGINS if pattern.match(first)), None)
    found = found or (_zip_kind(path) if first[:2] == b"PK" else _text_kind(path, first))
    if found is None or found in REFUSED:
        given_up = REFUSED.get(found or ending)
        raise InputError(f"is {given_up}" if given_up else f"is of no kind that is known; give {FAMILIES}")
    return found


def _zip_kind(path: Path) -> str:
    try:
        with zipfile.ZipFile(path) as archive:
            names = [name.lower() for name in archive.namelist() if not name.endswith("/")]
    except (zipfile.BadZipFile, OSError, ValueError) as error:
        raise InputError("is a damaged ZIP archive; get it again") from error
    found = [kind for end, kind in _KIND_IN_ZIP.items() if any(name.endswith(end) for name in names)]
    if not found:
        held = names[0].rpartition("/")[2][:40] if names else "nothing"
        raise InputError(f"is a ZIP archive with {held!r}; unpack it and give the file")
    return found[0]


def _text_kind(path: Path, first: bytes) -> str | None:
    """Tells the kind of a text file; None where no pattern matches. An InputError says that it is no JSON."""
    if b"\0" in first:
        return None
    if (text := bounded.text_of(first).lstrip("\ufeff\x1e \t\r\n"))[:1] in ("{", "["):
        text = bounded.text_of(bounded.read_bytes(path, bounded.MAX_TREE_BYTES))
        found = next((kind for kind, pattern in _JSON_PATTERNS if re.search(pattern, text)), None)
        if found is None:
            bounded.json_of(path)  # says so where it is no JSON at all
        return found
    text = re.sub(r"(?s)<!--.*?-->", "", text)  # of XML; any character may be in it
    lines = [line.strip() for line in text.splitlines()]
    text = "\n".join(line for line in lines if line and line[0] not in "*#") + "\n"
    return next((kind for kind, pattern in _TEXTS if re.search(f"(?im){pattern}", text)), None)
