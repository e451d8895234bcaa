"""Files of a scenario as obstacles: read, cut at the flight altitude, placed, simplified; `expanded` is the way in."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.files.input_file import open_regular
from harness.files.wording import counted
from harness.world_files import kinds
from harness.world_files.bounded import uncollected
from harness.world_files.growing import simplified
from harness.world_files.height_field import HeightField
from harness.world_files.parts import Contents, FloatArray, Raster, Reading, WorldFileError
from harness.world_files.plane import Mapping, Place
from harness.world_files.slicing import Box, HeightBand, KnownGround, Solid, sliced_cells, sliced_parts
from harness.world_files.terrain import height_field

MARGIN: Final = 0.02
"""What lies outside the area by more than this share of its longer side is left out."""
DECIMALS: Final = 3
"""Decimals of a corner in metres: corners are rounded to a millimetre."""
MAX_CORNERS: Final = 900_000
"""Most corners of all files together: a scenario with more could not be read again."""
MANY_CORNERS: Final = 20_000
"""Most corners that are compared with the area one by one; of more, only their hull is."""
MAX_POLYGONS: Final = 150_000
HEIGHTS_M: Final = (-1000.0, 30_000.0)
"""Bottom and top of what has none."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class FileSpec:
    """One file of a scenario, as its key `file` has it; units as named there."""

    path: Path
    kind: str | None = None
    vertical_clearance_m: float = 10.0
    metres_per_cell: float | None = None
    shift_m: tuple[float, float] = (0.0, 0.0)
    crs: str | None = None
    tolerance_m: float | None = None
    holes: str = "keep"
    nodata: str = "solid"
    unknown: str = "free"
    default_height_m: float = 6.0
    ground_m: float | None = None

    @property
    def reading(self) -> Reading:
        """What the readers need of it."""
        return Reading(self.metres_per_cell, self.crs, self.default_height_m)


@dataclass(frozen=True, eq=False)
class Source:
    """What became of one file.

    Attributes:
        spec: as asked.
        kind: its format.
        sha256: of its bytes.
        polygons: shapely polygons in the plane, cut to the area and valid.
        heights_m: bottom and top of each, above mean sea level; of terrain the height of the cut, twice.
        notes: what was assumed or passed over.
    """

    spec: FileSpec
    kind: str
    sha256: str
    polygons: tuple[Any, ...]
    heights_m: tuple[tuple[float, float], ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Expanded:
    """What became of all files of a scenario.

    Attributes:
        sources: one a file, in order.
        ground: terrain of all files together; None without.
        notes: what was said of it.
    """

    sources: tuple[Source, ...]
    ground: HeightField | None
    notes: tuple[str, ...]


class FileFault(WorldFileError):
    """A file that cannot be used, and which.

    Attributes:
        index: of the file among those that were asked for.
    """

    def __init__(self, index: int, sentence: str) -> None:
        super().__init__(sentence)
        self.index = index


def expanded(
    specs: Sequence[FileSpec],
    place: Place,
    bounds_m: Box,
    altitude_m: float,
    turn_room_m: float = 0.0,
    progress: Progress | None = None,
    ground: HeightField | None = None,
) -> Expanded:
    """Obstacles and ground of some files.

    Args:
        specs: the files.
        place: where the plane touches the earth.
        bounds_m: of the area; what lies outside is left out.
        altitude_m: of the flight, above mean sea level.
        turn_room_m: radius of a circle that a hole must hold to be kept where holes are `flyable`.
        progress: told what is being done.
        ground: where no file has terrain.

    Raises:
        FileFault: a file cannot be used.
    """
    import shapely

    tell = progress or (lambda _: None)
    box = _with_margin(bounds_m)
    loaded: list[tuple[FileSpec, Contents, Mapping]] = []
    for index, spec in enumerate(specs):
        with _Blaming(index):
            contents = loaded_file(spec.path, spec.kind, spec.reading)
            mapping = Mapping(contents.crs, place, spec.shift_m)
            _check_place(contents, mapping, box)
            loaded.append((spec, contents, mapping))
    terrains = [(each.terrain, mapping) for _, each, mapping in loaded if each.terrain is not None]
    field, notes = height_field(terrains, box)
    field = field or ground
    sources, corners = [], 0
    for index, (spec, contents, mapping) in enumerate(loaded):
        tell(f"cutting {spec.path.name} at {altitude_m:g} m")
        with _Blaming(index):
            source = _cut(spec, contents, mapping, field, bounds_m, altitude_m, turn_room_m)
            corners += int(shapely.get_num_coordinates(np.array(source.polygons, dtype=object)).sum())
            if corners > MAX_CORNERS or len(source.polygons) > MAX_POLYGONS:
                raise WorldFileError(
                    f"has {counted(len(source.polygons), 'polygon')} with {corners:,} corners in the area; at most "
                    f"{MAX_CORNERS:,} corners can be kept: make area.bounds_m smaller"
                )
            sources.append(source)
    return Expanded(tuple(sources), field, tuple(notes))


def loaded_file(path: Path, kind: str | None, reading: Reading) -> Contents:
    """Contents of a file; the last few are kept, for who flies the same files many times."""
    try:
        stamp = path.stat()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise WorldFileError(f"cannot be read ({reason}); give the path of a file") from error
    return _loaded(_plainly(path), kind, reading, (stamp.st_size, stamp.st_mtime_ns))


def _plainly(path: Path) -> Path:
    """The same file by the same path, however its folder is written; of a link the name is kept."""
    return path.parent.resolve() / path.name


@lru_cache(maxsize=4)
def _loaded(path: Path, kind: str | None, reading: Reading, stamp: tuple[int, int]) -> Contents:
    try:
        with uncollected():
            return kinds.read(path, kind, reading)
    except MemoryError as error:
        raise WorldFileError("needs more memory than there is; cut the area of interest out of it") from error
    except RecursionError as error:
        raise WorldFileError("is nested too deeply; must be a map") from error


@lru_cache(maxsize=16)
def _digest(path: Path, stamp: tuple[int, int]) -> str:
    digest = hashlib.sha256()
    with open_regular(path) as file:
        while piece := file.read(1 << 20):
            digest.update(piece)
    return digest.hexdigest()


class _Blaming:
    """Turns an error of a file into one that says which file."""

    def __init__(self, index: int) -> None:
        self._index = index

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, WorldFileError):
            raise FileFault(self._index, str(error)) from error


def _with_margin(bounds_m: Box) -> Box:
    xmin, ymin, xmax, ymax = bounds_m
    margin = MARGIN * max(xmax - xmin, ymax - ymin)
    return xmin - margin, ymin - margin, xmax + margin, ymax + margin


def corners_of(contents: Contents) -> tuple[FloatArray, FloatArray]:
    """X and y, in the file, of the corners of all that it holds, of many those of their hull; empty without any."""
    import shapely

    found = [np.zeros((0, 2))]
    for raster in (contents.terrain, contents.occupied):
        if raster is not None:
            rows, columns = raster.values.shape
            x, y = raster.places(np.array([0.0, columns, columns, 0.0]), np.array([0.0, 0.0, rows, rows]))
            found.append(np.column_stack((x, y)))
    if contents.parts:
        bounds = shapely.bounds(np.array([part.footprint for part in contents.parts], dtype=object))
        found += [bounds[:, [i, j]] for i in (0, 2) for j in (1, 3)]
    corners = np.concatenate(found)
    if len(corners) > MANY_CORNERS and np.isfinite(corners).all():
        corners = shapely.get_coordinates(shapely.convex_hull(shapely.linestrings(corners)))
    return corners[:, 0], corners[:, 1]


def _check_place(contents: Contents, mapping: Mapping, box: Box) -> None:
    """Raises WorldFileError if nothing of a file lies anywhere near the area."""
    east, north = mapping.to_plane(*corners_of(contents))
    known = np.isfinite(east) & np.isfinite(north)
    if not known.any():
        raise WorldFileError("lies where its coordinates have no place on earth; its crs may be another")
    xmin, xmax, ymin, ymax = east[known].min(), east[known].max(), north[known].min(), north[known].max()
    if xmin <= box[2] and xmax >= box[0] and ymin <= box[3] and ymax >= box[1]:
        return
    where = f"east {xmin:,.0f} to {xmax:,.0f} m, north {ymin:,.0f} to {ymax:,.0f} m"
    if contents.crs is None:
        raise WorldFileError(f"lies outside the area, at {where}; must reach into it: give shift_m")
    from harness.world_files.plane import geodetic

    x, y = corners_of(contents)
    latitude, longitude = geodetic(contents.crs, x, y)
    middle = f"{np.nanmean(latitude):.4f}, longitude_deg: {np.nanmean(longitude):.4f}"
    raise WorldFileError(
        f"lies outside the area, at {where}; area.origin {{latitude_deg: {middle}}} is in its middle"
    )


def _cut(
    spec: FileSpec,
    contents: Contents,
    mapping: Mapping,
    field: HeightField | None,
    bounds_m: Box,
    altitude_m: float,
    turn_room_m: float,
) -> Source:
    """The polygons of one file."""
    stamp, box = spec.path.stat(), _with_margin(bounds_m)
    band = HeightBand(altitude_m - spec.vertical_clearance_m, altitude_m + spec.vertical_clearance_m)
    notes = list(contents.notes)
    flat_m = spec.ground_m
    if flat_m is None and field is None and any(part.rigid for part in contents.parts):
        flat_m = 0.0
        notes.append(
            "no terrain: the ground is taken as flat at 0 m, so altitude_m counts from it (ground_m)"
        )
    parts = contents.parts
    solids = sliced_parts(parts, mapping, band, KnownGround(field, flat_m, bounds_m), box)
    polygons = [each.shape for each in solids]
    tolerance_m = 0.1 if spec.tolerance_m is None else spec.tolerance_m
    for raster, solid in _solid_cells(contents, spec, band, notes):
        found, factor = sliced_cells(raster, solid, mapping, box)
        polygons += found
        if factor > 1:
            notes.append(
                f"its cells were taken together {factor} by {factor}: they are too many, or too ragged"
            )
        if spec.tolerance_m is None:
            tolerance_m = factor * _cell_m(raster, mapping)
    final = [
        _with_holes(each, spec.holes, turn_room_m) for each in _rounded(_outlines(polygons, tolerance_m))
    ]
    if final:
        notes.append(f"outlines simplified by at most {tolerance_m:.3g} m, outwards only")
    else:
        notes.append(f"nothing of it is solid in the area between {band.low_m:g} and {band.high_m:g} m")
    heights = _heights(final, solids, None if contents.terrain is None else band.low_m)
    digest = _digest(_plainly(spec.path), (stamp.st_size, stamp.st_mtime_ns))
    return Source(spec, contents.kind, digest, tuple(final), tuple(heights), tuple(notes))


def _outlines(polygons: Sequence[Any], tolerance_m: float) -> list[Any]:
    """The union of polygons, simplified."""
    import shapely

    merged = shapely.get_parts(shapely.disjoint_subset_union_all(polygons)) if polygons else []
    grown = simplified([each for each in merged if each.geom_type == "Polygon"], tolerance_m)
    if tolerance_m > 0 and grown:
        grown = list(shapely.get_parts(shapely.disjoint_subset_union_all(grown)))
    return grown


def _heights(
    polygons: Sequence[Any], solids: Sequence[Solid], cut_m: float | None
) -> list[tuple[float, float]]:
    """Bottom and top of each polygon: the lowest and the highest of the solids that it was made of.

    Args:
        polygons: united solids, or cells.
        solids: parts with their heights.
        cut_m: of what is of no solid, terrain, the height it was cut at; None: there is no end to it.
    """
    import shapely

    lowest, highest = HEIGHTS_M
    if not solids:
        return [HEIGHTS_M if cut_m is None else (cut_m, cut_m)] * len(polygons)
    tree = shapely.STRtree(shapely.point_on_surface(np.array([each.shape for each in solids], dtype=object)))
    low, high = (np.clip([each[k] for each in solids], lowest, highest) for k in (1, 2))
    of, inside = tree.query(np.array(polygons, dtype=object), predicate="intersects")
    bottoms, tops = np.full(len(polygons), np.inf), np.full(len(polygons), -np.inf)
    np.minimum.at(bottoms, of, low[inside])
    np.maximum.at(tops, of, high[inside])
    known = np.isfinite(bottoms)
    bottoms[~known], tops[~known] = HEIGHTS_M
    return list(zip(bottoms.tolist(), tops.tolist(), strict=True))


def _solid_cells(
    contents: Contents, spec: FileSpec, band: HeightBand, notes: list[str]
) -> list[tuple[Raster, Any]]:
    """Rasters of a file with those of their cells that are solid."""
    found: list[tuple[Raster, Any]] = []
    if contents.terrain is not None:
        values = contents.terrain.values
        missing = np.isnan(values)
        solid = values >= band.low_m
        if missing.any():
            solid |= missing if spec.nodata == "solid" else False
            word = "solid" if spec.nodata == "solid" else "free"
            notes.append(f"{counted(int(missing.sum()), 'cell')} without a height taken as {word} (nodata)")
        found.append((contents.terrain, solid))
    if contents.occupied is not None:
        values = contents.occupied.values
        missing = np.isnan(values)
        solid = values > 0.5
        if missing.any():
            solid |= missing if spec.unknown == "occupied" else False
            word = "occupied" if spec.unknown == "occupied" else "free"
            notes.append(f"{counted(int(missing.sum()), 'unknown cell')} taken as {word} (unknown)")
        found.append((contents.occupied, solid))
    return found


def _cell_m(raster: Raster, mapping: Mapping) -> float:
    """The longer side of a cell, in the plane."""
    rows, columns = raster.values.shape
    x, y = raster.places(columns / 2 + np.array([0.0, 1.0, 0.0]), rows / 2 + np.array([0.0, 0.0, 1.0]))
    east, north = mapping.to_plane(x, y)
    return float(np.hypot(east[1:] - east[0], north[1:] - north[0]).max())


def _rounded(polygons: Sequence[Any]) -> list[Any]:
    """The same with corners on a fine grid, valid."""
    import shapely

    shapes = np.array(polygons, dtype=object)
    placed = shapely.transform(shapes, lambda points: np.round(points, DECIMALS))
    bad = ~shapely.is_valid(placed)  # a sliver that the grid makes a line, too: of it nothing is left
    placed[bad] = shapely.set_precision(shapes[bad], 10.0**-DECIMALS)
    placed = shapely.remove_repeated_points(placed)
    return [each for each in shapely.get_parts(placed) if each.geom_type == "Polygon" and each.area > 0]


def _with_holes(polygon: Any, holes: str, turn_room_m: float) -> Any:
    """A polygon with all of its holes, with none, or with those in which an aircraft can turn."""
    import shapely

    if not polygon.interiors or holes == "keep":
        return polygon
    rings = [] if holes == "fill" else list(polygon.interiors)
    kept = [ring for ring in rings if not shapely.Polygon(ring).buffer(-turn_room_m).is_empty]
    return shapely.Polygon(polygon.exterior, kept)
