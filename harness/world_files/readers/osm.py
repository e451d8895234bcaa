"""Buildings of OpenStreetMap, XML or PBF, by osmium (`wayproof[maps]`), which puts ways and relations together.

Buildings and their parts (`building:part`), chimneys, towers and tanks (`man_made`) are all taken, each with its own
height: where they overlap the union is solid, which is never less than the Simple 3D Buildings scheme has it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from harness.files.wording import counted
from harness.world_files.bounded import MAX_BYTES, check_file, check_xml, read_bytes
from harness.world_files.parts import WGS84, Contents, Reading, WorldFileError
from harness.world_files.readers import limits
from harness.world_files.readers.lengths import lengths_of

TALL: Final = frozenset(
    ("chimney", "communications_tower", "cooling_tower", "gasometer", "mast", "silo", "storage_tank", "tower",
     "water_tower")
)  # fmt: skip
"""Values of `man_made` for what stands up like a building; piers, pipelines and the like do not."""


def read_xml(path: Path, reading: Reading) -> Contents:
    """Reads an OpenStreetMap XML file.

    Raises:
        WorldFileError: it is not whole, has no building, or osmium is not installed.
    """
    data = read_bytes(path, MAX_BYTES)
    check_xml(data)
    if re.search(rb"<nd [^>]*\blat=", data):
        raise WorldFileError(
            "has places inside its ways (`out geom`); ask Overpass for `out body; >; out skel`"
        )
    if re.search(rb"<way id=['\"]-|action=['\"]delete", data):
        raise WorldFileError(
            "has ways of JOSM that are new or deleted; upload them, or give a file without them"
        )
    if data.rfind(b"<node ") < data.find(b"<way "):
        return _read(path, reading)
    with TemporaryDirectory() as folder:
        return _read(_in_order(path, Path(folder) / "ordered.osm.pbf"), reading)


def _in_order(path: Path, ordered: Path) -> Path:
    """Writes a file again with nodes before ways before relations, as osmium needs them and Overpass does not."""
    import osmium

    with osmium.SimpleWriter(str(ordered)) as writer:
        for kind in (osmium.osm.NODE, osmium.osm.WAY, osmium.osm.RELATION):
            for each in osmium.FileProcessor(str(path), kind):
                writer.add(each)
    return ordered


def read_pbf(path: Path, reading: Reading) -> Contents:
    """Reads an OpenStreetMap PBF file.

    Raises:
        WorldFileError: it is damaged, has no building, or osmium is not installed.
    """
    check_file(path)
    return _read(path, reading)


class _Found:
    """What a file holds.

    Attributes:
        areas: name, tags and shape of each building that osmium has put together.
        outlines: tags of the others, and the places of their nodes that are in the file, by name.
        others: how many points, ways and relations are high, or masts, and no building.
        highest_m: height of the highest of those.
    """

    def __init__(self) -> None:
        self.areas: list[tuple[str, dict[str, str], Any]] = []
        self.outlines: dict[str, tuple[dict[str, str], list[tuple[float, float]]]] = {}
        self.others = Counter[str]()
        self.highest_m = 0.0

    def take(self, each: Any, shape_of: Any) -> None:
        """One object of osmium."""
        import shapely

        tags = {tag.k: tag.v for tag in each.tags}
        if each.is_area():
            name = f"{'way' if each.from_way() else 'relation'} {each.orig_id()}"
            if is_building(tags) and each.num_rings()[0]:
                shape = shapely.from_wkb(shape_of.create_multipolygon(each))
                self.areas.append((name, tags, shape.geoms[0] if len(shape.geoms) == 1 else shape))
                self.outlines.pop(name, None)
            return
        kind = "point" if each.is_node() else "way" if each.is_way() else "relation"
        heights_m = lengths_of(tags.get("height")).metres
        if is_building(tags) and kind != "point":
            nodes = each.nodes if kind == "way" else ()
            places = [(node.lon, node.lat) for node in nodes if node.location.valid()]
            self.outlines[f"{kind} {each.id}"] = tags, places  # its area comes later, or none
        elif is_tall(tags) or heights_m:
            self.others[kind] += 1
            self.highest_m = max(self.highest_m, *heights_m, 0.0)

    def notes(self, closed: int) -> list[str]:
        """What is to be said of all that is not taken as it stands."""
        notes, broken = [], len(self.outlines) - closed
        if closed:
            notes.append(f"{counted(closed, 'building')} with an open outline closed by a straight line")
        if broken:
            notes.append(f"{counted(broken, 'building')} whose outline is not there passed over")
        kinds = [kind for kind in ("point", "way", "relation") if self.others[kind]]
        if kinds:
            plain = " and ".join(counted(self.others[kind], kind) for kind in kinds)
            top = f", the highest {self.highest_m:g} m" if self.highest_m else ""
            notes.append(f"{plain} with a height, or a mast, without an area passed over{top}")
        return notes


def _read(path: Path, reading: Reading) -> Contents:
    try:
        import osmium
    except ImportError as error:
        raise WorldFileError("is OpenStreetMap, which osmium reads: pip install 'wayproof[maps]'") from error
    import shapely

    keys = osmium.filter.KeyFilter("building", "building:part", "man_made", "power", "height")
    found, shape_of = _Found(), osmium.geom.WKBFactory()
    try:
        for each in osmium.FileProcessor(str(path)).with_locations().with_areas().with_filter(keys):
            found.take(each, shape_of)
    except (RuntimeError, ValueError, OSError, MemoryError) as error:
        said = " ".join(str(error).split())[:80]
        raise WorldFileError(f"cannot be read by osmium ({said}); it may be torn") from error
    cut = [(name, *each) for name, each in found.outlines.items() if len(set(each[1])) >= 3]
    areas = [*found.areas, *((name, tags, shapely.Polygon(places)) for name, tags, places in cut)]
    if not areas:
        raise WorldFileError("has no building with an outline; must be an extract of OpenStreetMap with some")
    doubts = limits.Doubts()
    parts = tuple(limits.building(tags, shape, reading, doubts, name) for name, tags, shape in areas)
    return Contents("osm", WGS84, parts, notes=(*doubts.notes(reading), *found.notes(len(cut))))


def is_building(tags: Mapping[str, Any]) -> bool:
    """Whether tags are those of a building, of a part of one, or of what stands up like one."""
    named = any(tags.get(key, "no") not in ("no", "entrance") for key in ("building", "building:part"))
    return named or tags.get("man_made") in TALL


def is_tall(tags: Mapping[str, Any]) -> bool:
    """Whether tags of a node are those of something that stands up: a building, a tower, a wind turbine."""
    return is_building(tags) or tags.get("power") == "tower" or tags.get("generator:source") == "wind"
