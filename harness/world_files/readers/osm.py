"""Buildings of OpenStreetMap and their parts, chimneys, towers and tanks, XML or PBF, by osmium (`wayproof[maps]`)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import shapely

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.world_files.bounded import MAX_BYTES, read_bytes
from harness.world_files.parts import WGS84, Contents, FileSpec, Part
from harness.world_files.readers import limits
from harness.world_files.readers.footprints import on_earth

TALL_MAN_MADE: Final = frozenset(  # `man_made` that stands up like a building: no piers, pipelines, ...
    ("chimney", "communications_tower", "cooling_tower", "gasometer", "mast", "silo", "storage_tank", "tower",
     "water_tower")
)  # fmt: skip

TALL: Final = {  # tags of what stands up, or hangs, and has no area; every aerialway is such, too
    "power": ("tower", "pole", "portal", "catenary_mast", "line", "minor_line"),
    "man_made": ("crane", "antenna", "flagpole"),
    "generator:source": ("wind",),
}
TALL_PASSED: Final = "that stand up, or hang, without an area passed over: masts, lines, cranes and the like"
NODE: Final = re.compile(  # matches a node of an XML file by its id, latitude and longitude, in any order
    rb"<node\s" + b"".join(rb"(?=[^>]*\b%s=['\"](-?\d+\.?\d*)['\"])" % key for key in (b"id", b"lat", b"lon"))
)
KINDS: Final = {"n": "point", "w": "way"}
NOT_THERE: Final = 2**31 - 1  # coordinate that osmium gives a node which a way names and the file has not


def read_xml(spec: FileSpec) -> Contents:
    """Reads OpenStreetMap XML in any order; InputError: `out geom`, changes of JOSM, a node at two places."""
    if re.search(rb"<nd [^>]*\blat=", (data := read_bytes(spec.path, MAX_BYTES))):
        raise InputError("has places inside its ways (`out geom`); ask for `out body; >; out skel`")
    if re.search(rb"<way id=['\"]-|action=['\"]delete", data):
        raise InputError("has ways of JOSM that are new or deleted; give a file without them")
    rows = (tuple(map(float, node.groups())) for node in NODE.finditer(data))
    placed = np.unique(np.fromiter(rows, np.dtype((float, 3))), axis=0)
    if len(again := np.flatnonzero(np.diff(placed[:, 0]) == 0.0)):
        raise InputError(f"has the node {placed[again[0], 0]:.0f} twice, at two places; keep one")
    osmium = _import_osmium()
    if data.rfind(b"<node ") < data.find(b"<way "):
        return read_pbf(spec)
    # Written again with nodes before ways before relations, as osmium needs them and Overpass does not.
    with TemporaryDirectory() as folder:
        ordered = Path(folder) / "ordered.osm.pbf"
        with _osmium_errors(), osmium.SimpleWriter(str(ordered)) as writer:
            for kind in (osmium.osm.NODE, osmium.osm.WAY, osmium.osm.RELATION):
                for each in osmium.FileProcessor(str(spec.path), kind):
                    writer.add(each)
        return read_pbf(replace(spec, path=ordered))


@contextmanager
def _osmium_errors() -> Iterator[None]:
    """Turns whatever osmium raises, for XML entities too, into an InputError that names the fault of the file."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # of kinds of its own, too
        text = " ".join(str(error).split())[:120].rstrip(".")
        raise InputError(f"cannot be read by osmium: {text}; get it again, or save it in JOSM") from error


def _import_osmium() -> Any:
    try:
        import osmium
    except ImportError as error:
        raise InputError("is OpenStreetMap, which osmium reads: pip install 'wayproof[maps]'") from error
    return osmium


def read_pbf(spec: FileSpec) -> Contents:
    """Reads an OpenStreetMap PBF file."""
    osmium = _import_osmium()
    keys = osmium.filter.KeyFilter("building", "building:part", "man_made", "power", "aerialway", "height")
    found = _Collector(limits.Buildings(spec), osmium.geom.WKBFactory())
    with _osmium_errors():
        for each in osmium.FileProcessor(str(spec.path)).with_locations().with_areas().with_filter(keys):
            if len(tags := {tag.k: tag.v for tag in each.tags}) < len(each.tags):
                twice = next(k for k in tags if [tag.k for tag in each.tags].count(k) > 1)
                raise InputError(f"{each.type_str()}{each.id}: has the tag {twice!r} twice; keep one")
            found.take(each, tags)
    return found.contents()


@dataclass
class _Collector:
    """Parts found so far in a file; `ways` are buildings, by name, whose area may come later or never."""

    buildings: limits.Buildings
    shape_of: Any
    parts: list[Part] = field(default_factory=list)
    tall: int = 0
    below: int = 0
    ways: dict[str, tuple[dict[str, str], list[tuple[float, float]]]] = field(default_factory=dict)

    def take(self, each: Any, tags: dict[str, str]) -> None:
        """Takes an object of osmium: adds it if it is a building's area, keeps it in `ways`, or counts it as tall."""
        if tags.get("location") == "underground":
            self.below += not each.is_area()
        elif each.is_area():
            name = f"{'way' if each.from_way() else 'relation'} {each.orig_id()}"
            if is_building(tags) and each.num_rings()[0]:
                self._add(tags, shapely.from_wkb(self.shape_of.create_multipolygon(each)), name)
                self.ways.pop(name, None)
        elif is_building(tags) and (kind := KINDS.get(each.type_str(), "relation")) != "point":
            places = [
                on_earth(node.location.lon_without_check(), node.location.lat_without_check())
                for node in getattr(each, "nodes", ())
                if node.location.x != NOT_THERE
            ]
            self.ways[f"{kind} {each.id}"] = tags, places
        else:
            self.tall += is_building(tags) or stands_up(tags)

    def _add(self, tags: dict[str, str], shape: Any, name: str) -> None:
        shape = shape.geoms[0] if len(getattr(shape, "geoms", ())) == 1 else shape
        self.parts.append(self.buildings.part(tags, shape, name))

    def contents(self) -> Contents:
        """Returns all buildings, with open outlines closed."""
        whole = {name: (tags, ring) for name, (tags, ring) in self.ways.items() if len(set(ring)) >= 3}
        for name, (tags, ring) in whole.items():
            self._add(tags, shapely.Polygon(ring), name)
        if not self.parts:
            raise InputError("has no building with an outline; must have some")
        closed = sum(ring[0] == ring[-1] for _, ring in whole.values())
        passed = (
            (closed, "building", "whose outline crosses itself or misses a corner"),
            (len(whole) - closed, "building", "with an open outline closed by a straight line"),
            (len(self.ways) - len(whole), "building", "whose outline is not there passed over"),
            (self.tall, "object", TALL_PASSED),
            (self.below, "object", "underground passed over"),
        )
        notes = [f"{counted(number, noun)} {says}" for number, noun, says in passed if number]
        return Contents(WGS84, tuple(self.parts), notes=(*self.buildings.notes(), *notes))


def stands_up(tags: Mapping[str, Any]) -> bool:
    """Tells whether tags are those of what stands up, or hangs, and has no area."""
    listed = any(tags.get(key) in values for key, values in TALL.items())
    return listed or limits.metres_of(tags.get("height")) is not None or tags.get("aerialway", "no") != "no"


def is_building(tags: Mapping[str, Any]) -> bool:
    """Tells whether tags are those of a building, of a part of one, or of what stands up like one."""
    named = any(tags.get(key, "no") not in ("no", "entrance") for key in ("building", "building:part"))
    return named or tags.get("man_made") in TALL_MAN_MADE
