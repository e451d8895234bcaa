"""Vector files that GDAL reads (KML, GeoPackage, Shapefile, FlatGeobuf), by pyogrio (`wayproof[maps]`)."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.files.wording import counted
from harness.files.zip_archive import unpacked
from harness.world_files.bounded import MAX_TREE_BYTES, check_xml, read_bytes
from harness.world_files.parts import NO_BOTTOM, NO_TOP, Contents, Datum, Limit, Part, Reading, WorldFileError
from harness.world_files.readers import limits

MAX_FEATURES: Final = 300_000
"""A layer with more features is refused."""
POSITION: Final = re.compile(rb"[-+]?[\d.]+(?:[eE][-+]?\d+)?(?:,[-+]?[\d.]+(?:[eE][-+]?\d+)?){1,2}")
"""A position of KML."""
LINKED: Final = (b"<NetworkLink>", b"<GroundOverlay", b"<Model")
"""Elements of KML that name other files."""
DATUMS: Final = {"absolute": Datum.SEA, "relativeToGround": Datum.GROUND}
"""What an altitude of KML is above, by its altitudeMode; clamped to the ground it means nothing."""

Feature = tuple[dict[str, Any], Any]
"""Attributes, and a shape."""


def read(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of all layers; heights and limits are told from attributes as in GeoJSON.

    Raises:
        WorldFileError: pyogrio is not installed, GDAL cannot read the file, or it has no polygon.
    """
    read_bytes(path, first=1)
    crs, solid, passed = _features(path)
    crs = reading.crs or crs
    if crs is None:
        raise WorldFileError("names no coordinate reference system; give crs, as EPSG:32632")
    notes: list[str] = []
    parts = limits.parts_of(solid, reading, notes)
    if passed:
        notes.append(f"{counted(passed, 'shape')} without an area passed over")
    return Contents("vector", crs, parts, notes=tuple(notes))


def read_kml(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of a KML file, or of a KMZ archive with one.

    Each is solid from the ground up to its highest corner; on the ground it is solid at every altitude. Limits in its
    ExtendedData go before altitudes.

    Raises:
        WorldFileError: pyogrio is not installed, the file is not whole, or it has no polygon.
    """
    text, others = read_bytes(path, MAX_TREE_BYTES), 0
    if text[:2] == b"PK":
        _, text, others = unpacked(text, ".kml", MAX_TREE_BYTES, "doc.kml")
    text = _checked_kml(text)
    _, solid, passed = _features(text)
    notes = [f"{counted(others, 'further KML file')} in the archive passed over"] if others else []
    parts = tuple(_kml_part(*each, notes) for each in solid)
    flat = sum((part.bottom, part.top) == (NO_BOTTOM, NO_TOP) for part in parts)
    if flat:
        notes.append(f"{counted(flat, 'polygon')} on the ground taken as solid at every altitude")
    if len(parts) > flat:
        notes.append("a polygon in the air is taken as solid from the ground up to its highest corner")
    if linked := sum(text.count(each) for each in LINKED):
        notes.append(f"{counted(linked, 'image or link')} to other files passed over")
    if passed:
        notes.append(f"{counted(passed, 'point, line or wall')} passed over")
    return Contents("kml", reading.crs or "EPSG:4326", parts, notes=tuple(notes))


def _checked_kml(text: bytes) -> bytes:
    """A KML text as GDAL reads it rightly.

    Raises:
        WorldFileError: it is not whole XML, or has what GDAL would take for something else.
    """
    check_xml(text)
    if b"altitudeOffset" in text:
        raise WorldFileError(
            "lifts shapes by gx:altitudeOffset, which is not read; add it to their altitudes"
        )
    # GDAL parts positions at blanks, which some programs write after commas, too; and it makes words zero.
    text = re.sub(rb"coordinates>[^<]*", lambda found: re.sub(rb"\s*,\s*", b",", found[0]), text)
    for block in re.findall(rb"coordinates>([^<]*)<", text):
        if not all(map(POSITION.fullmatch, block.split())):
            raise WorldFileError("has coordinates that are not longitude,latitude[,altitude]")
    return text


def _kml_part(tags: dict[str, Any], shape: Any, notes: list[str]) -> Part:
    """The part that a polygon of KML is."""
    import shapely

    name, datum = str(tags.get("Name") or "")[:40], DATUMS.get(str(tags.get("altitudeMode")))
    flat = shapely.force_2d(shape)
    if limits.has_limits(tags):
        return Part(flat, *limits.limits(tags, notes, name), name=name)
    if datum is None:
        return Part(flat, name=name)
    top_m = float(np.nanmax(shapely.get_coordinates(shape, include_z=True)[:, 2]))
    return Part(flat, top=Limit(top_m, datum), name=name)


def _features(source: Path | bytes) -> tuple[str | None, list[Feature], int]:
    """The coordinate reference system and the polygons of all layers, and how many other shapes there are.

    Raises:
        WorldFileError: pyogrio is not installed, or GDAL cannot read the file.
    """
    try:
        import pyogrio
    except ImportError as error:
        raise WorldFileError("is a vector file, which pyogrio reads: pip install 'wayproof[maps]'") from error
    import shapely

    systems: set[str | None] = set()
    found: list[Feature] = []
    try:
        with warnings.catch_warnings(action="ignore"):  # what GDAL leaves out is counted
            for layer in range(len(pyogrio.list_layers(source))):
                if pyogrio.read_info(source, layer=layer)["features"] > MAX_FEATURES:
                    raise WorldFileError(
                        f"has more than {MAX_FEATURES:,} features; cut the area of interest out of it"
                    )
                meta, _, shapes, columns = pyogrio.raw.read(source, layer=layer, on_invalid="ignore")
                found += _rows([str(name) for name in meta["fields"]], shapes, columns)
                systems |= {meta["crs"]} if len(shapes) else set()
    except WorldFileError:
        raise
    except (pyogrio.errors.DataSourceError, ValueError, RuntimeError, OSError, MemoryError) as error:
        raise WorldFileError(f"cannot be read by GDAL ({' '.join(str(error).split())[:100]})") from error
    if len(systems) > 1:
        raise WorldFileError(
            "has layers in different coordinate reference systems; put them into files of their own"
        )
    solid = [each for each in found if shapely.get_dimensions(each[1]) == 2]
    return next(iter(systems), None), solid, len(found) - len(solid)


def _rows(names: list[str], shapes: Any, columns: Any) -> Iterator[Feature]:
    """The features of a layer, collections of shapes in pieces; attributes without a value are left out."""
    import shapely

    geometries = shapely.from_wkb(shapes, on_invalid="fix")
    broken = sum(each is None and wkb is not None for each, wkb in zip(geometries, shapes, strict=True))
    if broken:
        raise WorldFileError(
            f"has {counted(broken, 'shape')} that cannot be read; repair it, as with ogr2ogr -makevalid"
        )
    for row, shape in enumerate(geometries):
        values = {name: column[row] for name, column in zip(names, columns, strict=True)}
        tags = {
            name: value.item() if isinstance(value, np.generic) else value
            for name, value in values.items()
            if value is not None and value == value
        }
        is_collection = shape is not None and shape.geom_type == "GeometryCollection"
        for piece in shapely.get_parts(shape) if is_collection else (shape,):
            yield tags, piece
