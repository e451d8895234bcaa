"""Vector files that GDAL reads (KML, GeoPackage, Shapefile, FlatGeobuf, DXF ...), by pyogrio (`wayproof[maps]`)."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.files.zip_archive import Unpacked, member_path, unpacked
from harness.world_files.bounded import MAX_BYTES, MAX_TREE_BYTES, check_file, check_xml, read_bytes
from harness.world_files.parts import NO_BOTTOM, NO_TOP, Contents, Datum, Limit, Part, Reading, WorldFileError
from harness.world_files.readers import limits

MAX_FEATURES: Final = 300_000
"""A layer with more features is refused."""
DRAWINGS: Final = (".dxf", ".dwg")
"""Endings of drawings, which never say where on earth they lie."""
COLLECTION: Final = 7
"""Type number of a geometry collection in shapely."""
AREAL: Final = 2
"""Dimension of polygons in shapely."""
POSITION: Final = re.compile(rb"[-+]?[\d.]+(?:[eE][-+]?\d+)?(?:,[-+]?[\d.]+(?:[eE][-+]?\d+)?){1,2}")
"""A position of KML."""
LINKED: Final = (b"<NetworkLink>", b"<GroundOverlay", b"<Model")
"""Elements of KML that name other files."""
DATUMS: Final = {"absolute": Datum.SEA, "relativeToGround": Datum.GROUND}
"""What an altitude of KML is above, by its altitudeMode; clamped to the ground it means nothing."""


class _Feature(NamedTuple):
    """A feature: its attributes, and its shape, None where it has no area."""

    tags: dict[str, Any]
    shape: Any


def read(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of all layers; heights and limits are told from attributes as in GeoJSON.

    Raises:
        WorldFileError: pyogrio is not installed, GDAL cannot read the file, or it has no polygon.
    """
    check_file(path)
    source: Path | str = path
    try:
        if path.suffix.lower() == ".zip":
            source = member_path(path, (".shp", ".gpkg"), MAX_BYTES)
    except InputError as error:
        raise WorldFileError(str(error)) from error
    crs, features = _features(source)
    crs = reading.crs or crs
    notes: list[str] = []
    if crs is None and path.suffix.lower() not in DRAWINGS:
        raise WorldFileError("names no coordinate reference system; give crs, as EPSG:32632")
    if crs is None:
        notes.append("a drawing names no place on earth: taken as metres in a plane of its own")
    solid = [each for each in features if each.shape is not None]
    parts = limits.parts_of([(each.tags, each.shape) for each in solid], reading, notes)
    if len(features) > len(solid):
        notes.append(f"{counted(len(features) - len(solid), 'shape')} without an area passed over")
    return Contents("vector", crs, parts, notes=tuple(notes))


def read_kml(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of a KML file, or of a KMZ archive with one.

    Each is solid from the ground up to its highest corner; on the ground it is solid at every altitude. Limits in its
    ExtendedData go before altitudes.

    Raises:
        WorldFileError: pyogrio is not installed, the file is not whole, or it has no polygon.
    """
    data = read_bytes(path, MAX_TREE_BYTES)
    try:
        packed = (
            unpacked(data, ".kml", MAX_TREE_BYTES, "doc.kml") if data[:2] == b"PK" else Unpacked("", data, 0)
        )
    except InputError as error:
        raise WorldFileError(str(error)) from error
    text = _checked_kml(packed.data)
    _, features = _features(text)
    notes = (
        [f"{counted(packed.others, 'further KML file')} in the archive passed over"] if packed.others else []
    )
    solid = [each for each in features if each.shape is not None]
    parts = tuple(_kml_part(each, notes) for each in solid)
    flat = sum((part.bottom, part.top) == (NO_BOTTOM, NO_TOP) for part in parts)
    if flat:
        notes.append(f"{counted(flat, 'polygon')} on the ground taken as solid at every altitude")
    if len(parts) > flat:
        notes.append("a polygon in the air is taken as solid from the ground up to its highest corner")
    if linked := sum(text.count(each) for each in LINKED):
        notes.append(f"{counted(linked, 'image or link')} to other files passed over")
    if len(features) > len(solid):
        notes.append(f"{counted(len(features) - len(solid), 'point, line or wall')} passed over")
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
    # GDAL parts positions at blanks, which some programs write after commas, too.
    text = re.sub(rb"coordinates>[^<]*", lambda found: re.sub(rb"\s*,\s*", b",", found[0]), text)
    for block in re.findall(rb"coordinates>([^<]*)<", text):  # GDAL makes words zero
        if not all(map(POSITION.fullmatch, block.split())):
            raise WorldFileError("has coordinates that are not longitude,latitude[,altitude]")
    return text


def _kml_part(feature: _Feature, notes: list[str]) -> Part:
    """The part that a polygon of KML is."""
    import shapely

    tags, shape = feature
    name, datum = str(tags.get("Name") or "")[:40], DATUMS.get(str(tags.get("altitudeMode")))
    flat = shapely.force_2d(shape)
    if limits.has_limits(tags):
        return Part(flat, *limits.limits(tags, notes, name), name=name)
    if datum is None:
        return Part(flat, NO_BOTTOM, NO_TOP, name=name)
    top_m = float(np.nanmax(shapely.get_coordinates(shape, include_z=True)[:, 2]))
    return Part(flat, NO_BOTTOM, Limit(top_m, datum), name=name)


def _features(source: Path | str | bytes) -> tuple[str | None, list[_Feature]]:
    """The coordinate reference system and the features of all layers.

    Raises:
        WorldFileError: pyogrio is not installed, or GDAL cannot read the file.
    """
    try:
        import pyogrio
    except ImportError as error:
        raise WorldFileError("is a vector file, which pyogrio reads: pip install 'wayproof[maps]'") from error
    systems: set[str | None] = set()
    found: list[_Feature] = []
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
    return next(iter(systems), None), found


def _rows(names: list[str], shapes: Any, columns: Any) -> Iterator[_Feature]:
    """The features of a layer; attributes without a value are left out."""
    import shapely

    geometries = shapely.from_wkb(shapes, on_invalid="fix")
    broken = sum(each is None and wkb is not None for each, wkb in zip(geometries, shapes, strict=True))
    if broken:
        raise WorldFileError(
            f"has {counted(broken, 'shape')} that cannot be read; repair it, as with ogr2ogr -makevalid"
        )
    for row, shape in enumerate(geometries):
        tags = {
            name: value.item() if isinstance(value, np.generic) else value
            for name, column in zip(names, columns, strict=True)
            if (value := column[row]) is not None and value == value
        }
        pieces = shapely.get_parts(shape) if shapely.get_type_id(shape) == COLLECTION else [shape]
        for piece in pieces:
            yield _Feature(tags, piece if shapely.get_dimensions(piece) == AREAL else None)
