"""Any vector file that GDAL knows (GeoPackage, Shapefile, FlatGeobuf, DXF ...), with pyogrio (`wayproof[maps]`)."""

from __future__ import annotations

import warnings
import zipfile
from pathlib import Path

import numpy as np

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.files.zip_archive import chosen
from harness.world_files.bounded import MAX_BYTES
from harness.world_files.parts import Contents, Part, Reading, WorldFileError
from harness.world_files.plane import in_degrees
from harness.world_files.readers import limits, rings

MAX_FEATURES = 300_000
PACKED = (".shp", ".gpkg")
"""What of an archive is read."""
DRAWINGS = (".dxf", ".dwg")
"""Files that never say where on earth they lie."""


def read(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of a file, as `_read` has it, without the warnings of GDAL: what is left out is counted."""
    with warnings.catch_warnings():
        return _read(path, reading)


def _read(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of a file's layers; heights and limits are told from their attributes as in GeoJSON.

    Raises:
        WorldFileError: pyogrio is not there, or GDAL cannot read the file.
    """
    try:
        import pyogrio
        from pyogrio.errors import DataLayerError, DataSourceError
    except ImportError as error:
        raise WorldFileError("is a kind of file that pyogrio reads: pip install 'wayproof[maps]'") from error
    import shapely

    notes: list[str] = []
    doubts = limits.Doubts()
    parts: list[Part] = []
    crs: str | None = None
    passed = bare = 0
    source = _source(path)
    try:
        warnings.simplefilter("ignore")
        for layer in np.atleast_2d(pyogrio.list_layers(source))[:, 0]:
            if pyogrio.read_info(source, layer=layer)["features"] > MAX_FEATURES:
                raise WorldFileError(
                    f"has more than {MAX_FEATURES:,} features; cut the area of interest out of it"
                )
            meta, _, geometries, columns = pyogrio.raw.read(source, layer=layer, on_invalid="ignore")
            if len(geometries) and crs is not None and meta["crs"] != crs:
                raise WorldFileError(
                    "has layers in different coordinate reference systems; put them into files of their own"
                )
            crs = crs or meta["crs"]
            shapes = shapely.make_valid(
                shapely.force_2d(shapely.from_wkb(geometries, on_invalid="ignore")), method="structure",
                keep_collapsed=False,
            )  # fmt: skip
            if in_degrees(reading.crs or crs):
                shapes = [rings.together(each) for each in shapes]
            for row, shape in enumerate(shapes):
                if shape is None or shape.area == 0.0:
                    passed += 1
                    continue
                tags = {str(name): column[row] for name, column in zip(meta["fields"], columns, strict=True)}
                tags = {name: value for name, value in tags.items() if value is not None and value == value}
                parts.append(_part(tags, shape, reading, notes, doubts))
                bare += not (parts[-1].rigid or limits.has_limits(tags))
    except (DataSourceError, DataLayerError, ValueError, RuntimeError, OSError, MemoryError) as error:
        if isinstance(error, WorldFileError):
            raise
        raise WorldFileError(f"cannot be read by GDAL ({' '.join(str(error).split())[:100]})") from error
    if not parts:
        raise WorldFileError("has no polygon; must have some")
    notes += _told(path, reading.crs or crs, bare)
    notes += doubts.notes(reading)
    if passed:
        notes.append(f"{counted(passed, 'shape')} without an area passed over")
    return Contents("vector", reading.crs or crs, tuple(parts), notes=tuple(notes))


def _part(
    tags: dict[str, object], shape: object, reading: Reading, notes: list[str], doubts: limits.Doubts
) -> Part:
    plain = {name: value.item() if isinstance(value, np.generic) else value for name, value in tags.items()}
    name = str(plain.get("name", ""))[:40]
    if limits.is_building(plain):
        return limits.building(plain, shape, reading, doubts, name)
    return Part(shape, *limits.limits(plain, notes, name), name=name)


def _source(path: Path) -> Path | str:
    """What GDAL opens: the file, or the one in an archive.

    Raises:
        WorldFileError: it unpacks to too much, or the archive has none or several.
    """
    if path.suffix.lower() != ".zip":
        return path
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, OSError, ValueError) as error:
        raise WorldFileError("is a damaged ZIP archive; get it again") from error
    if sum(each.file_size for each in members) > MAX_BYTES:
        raise WorldFileError(
            f"unpacks to more than {MAX_BYTES // 10**6} MB; cut the area of interest out of it"
        )
    try:
        inner, _ = chosen([each.filename for each in members], PACKED)
    except InputError as error:
        raise WorldFileError(str(error)) from error
    return f"/vsizip/{path.absolute()}/{inner}"


def _told(path: Path, crs: str | None, bare: int) -> list[str]:
    """What is to be said of where a file lies, and of polygons without heights.

    Raises:
        WorldFileError: nothing says where it lies; a drawing is taken as metres.
    """
    notes = []
    if crs is None and path.suffix.lower() not in DRAWINGS:
        raise WorldFileError("names no coordinate reference system; give crs, as EPSG:32632")
    if crs is None:
        notes.append("a drawing names no place on earth: taken as metres in a plane of its own")
    if bare:
        notes.append(f"{counted(bare, 'polygon')} without height limits taken as solid at every altitude")
    return notes
