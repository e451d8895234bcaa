"""Files of a scenario as obstacles: read, cut at the flight altitude, placed, simplified; `expanded` is the way in."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final

import numpy as np
import shapely

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.world_files import kinds
from harness.world_files.height_field import HeightField, cell_sides, height_field, window_of
from harness.world_files.parts import Box, Contents, FileSpec
from harness.world_files.plane import CIRCLE_DEG, Mapping, Place, geodetic, in_degrees, pyproj_crs
from harness.world_files.solids import Layer, Solid, clipped, occupied, placed_cells, simplified, sliced_parts

MARGIN: Final = 0.02  # parts further outside the area than this share of its longer side are left out
DECIMALS: Final = 3  # of a corner in metres: corners are rounded to a millimetre
MAX_CORNERS: Final = 900_000  # more corners in all files are refused: such a scenario could not be read again
HEIGHTS_M: Final = (-1000.0, 30_000.0)  # heights above mean sea level of a polygon without a bottom or a top

USED_BY: Final = {  # keys of a file that not every kind uses, and the kinds that do
    "metres_per_cell": ("ascii_grid", *kinds.GROUPS["occupancy"]),
    "crs": (*kinds.GROUPS["terrain"], "cityjson", "geojson"),
    **{"nodata": kinds.GROUPS["terrain"], "unknown": kinds.GROUPS["occupancy"]},
    "default_height_m": kinds.GROUPS["buildings"],
    "ground_m": (*kinds.GROUPS["buildings"], *kinds.GROUPS["airspace"]),
}


def unused_keys(spec: FileSpec, contents: Contents) -> dict[str, str]:
    """Returns the keys set otherwise than by default that a file cannot use, each with the fault to raise."""
    faults = {}
    for key in (key for key in ("shift_m", *USED_BY) if getattr(spec, key) != getattr(FileSpec, key)):
        used_by = dict.fromkeys(USED_BY.get(key, (contents.kind,)))
        if contents.crs is not None and key in ("shift_m", "metres_per_cell"):
            faults[key] = f"has its place on earth, which {key} does not move; leave {key} out"
        elif contents.kind not in used_by:
            faults[key] = f"is of the kind {contents.kind}; {key} is used by {', '.join(used_by)} only: leave it out"
        elif key == "crs" and spec.crs != contents.crs:
            faults[key] = f"names its own crs, {pyproj_crs(str(contents.crs)).name}; leave crs out"
    return faults


@dataclass(frozen=True, eq=False)
class Source:
    """The result of one file: valid polygons in the plane and area, their bottoms and tops, and what was assumed."""

    spec: FileSpec
    kind: str
    sha256: str
    polygons: tuple[Any, ...]
    heights_m: tuple[tuple[float, float], ...]
    notes: tuple[str, ...]
    by_altitude: bool  # whether what is solid depends on the altitude


@dataclass(frozen=True, eq=False)
class Expanded:
    """The result of all files of a scenario: one source a file, and the terrain of all together, None without."""

    sources: tuple[Source, ...]
    ground: HeightField | None
    notes: tuple[str, ...]


class FileFault(InputError):
    """Says what makes a file unusable, and gives its index among the files asked for, and its key that is at fault."""

    def __init__(self, index: int, sentence: str, key: str = "") -> None:
        super().__init__(sentence)
        self.index, self.key = index, key


def expanded(
    specs: Sequence[FileSpec],
    place: Place,
    bounds_m: Box,
    altitude_m: float,
    ground: HeightField | None = None,
) -> Expanded:
    """Returns the obstacles and the ground in the bounds; `ground` is taken where no file has terrain."""
    margin = MARGIN * max(bounds_m[2] - bounds_m[0], bounds_m[3] - bounds_m[1])
    box = bounds_m[0] - margin, bounds_m[1] - margin, bounds_m[2] + margin, bounds_m[3] + margin
    loaded: list[tuple[Contents, Mapping]] = []
    for index, spec in enumerate(specs):
        with blaming(index):
            contents = loaded_file(spec)
            for key, sentence in unused_keys(spec, contents).items():
                raise FileFault(index, sentence, key)
            loaded.append((contents, Mapping(contents.crs, place, spec.shift_m)))
            _check_place(*loaded[-1], box)
    terrain = [(each.terrain, mapping) for each, mapping in loaded if each.terrain is not None]
    with blaming(0):
        field, notes = height_field(terrain, box)
    field = field or ground
    sources, corners = list[Source](), 0
    for index, (spec, (contents, mapping)) in enumerate(zip(specs, loaded, strict=True)):
        with blaming(index):
            reach_m = spec.vertical_clearance_m
            layer = Layer(altitude_m - reach_m, altitude_m + reach_m, field, spec.ground_m, bounds_m)
            sources.append(_cut(spec, contents, mapping, layer, box))
            own = sources[-1].polygons
            corners += int(shapely.get_num_coordinates(np.array(own, dtype=object)).sum())
            if corners > MAX_CORNERS:
                text = f"has {counted(len(own), 'polygon')}, {corners:,} corners in the area"
                text += f" with those of the files before; at most {MAX_CORNERS:,} corners can be kept"
                raise InputError(f"{text}: make area.bounds_m smaller")
    return Expanded(tuple(sources), field, tuple(notes))


@contextmanager
def blaming(index: int) -> Iterator[None]:
    """Turns an InputError raised inside the block into a FileFault with the index of the file."""
    try:
        yield
    except FileFault:
        raise
    except InputError as error:
        raise FileFault(index, str(error)) from error


def loaded_file(spec: FileSpec) -> Contents:
    """Reads a file; the last few are cached, for flights that use the same files many times."""
    stem = "" if spec.path.suffix in (".yaml", ".yml") else f"{spec.path.stem}."  # of its image, its crs
    try:
        beside = sorted(p for p in spec.path.parent.iterdir() if p.name.startswith(stem) and p.is_file())
        stamps = [spec.path.stat(), *(each.lstat() for each in beside)]
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(f"cannot be read ({reason}); give the path of a file") from error
    # One path, however its folder is written, of a link by its name.
    path = spec.path.parent.resolve() / spec.path.name
    read = {key: getattr(spec, key) for key in ("kind", "metres_per_cell", "crs", "default_height_m")}
    return _load(FileSpec(path, **read), tuple((each.st_size, each.st_mtime_ns) for each in stamps))


@lru_cache(maxsize=4)
def _load(spec: FileSpec, stamps: tuple[tuple[int, int], ...]) -> Contents:
    try:
        contents = kinds.read(spec)
        with spec.path.open("rb") as file:
            return replace(contents, sha256=hashlib.file_digest(file, "sha256").hexdigest())
    except MemoryError as error:
        raise InputError("needs more memory than there is; cut the area of interest out of it") from error
    except RecursionError as error:
        raise InputError("is nested too deeply; must be a map") from error


def _check_place(contents: Contents, mapping: Mapping, box: Box) -> None:
    east, north = mapping.to_plane(*contents.corners)
    if not (known := np.isfinite(east) & np.isfinite(north)).any():
        raise InputError("lies where its coordinates have no place on earth; its crs may be another")
    xmin, xmax, ymin, ymax = east[known].min(), east[known].max(), north[known].min(), north[known].max()
    if contents.terrain is not None and in_degrees(contents.crs):
        x, _ = mapping.from_plane(np.array(box[::2]), np.array(box[1::2]), contents.terrain.middle_x)
        if np.ptp(x) > CIRCLE_DEG / 2.0:
            raise InputError("goes round the earth, and its edge lies in the area; cut the area out of it")
    if xmin <= box[2] and xmax >= box[0] and ymin <= box[3] and ymax >= box[1]:
        return
    where = f"lies outside the area, at east {xmin:,.0f} to {xmax:,.0f} m, north {ymin:,.0f} to {ymax:,.0f} m"
    if contents.crs is None:
        raise InputError(f"{where}; must reach into it: give shift_m")
    latitude, longitude = geodetic(contents.crs, *contents.corners)
    middle = f"{np.nanmean(latitude):.4f}, longitude_deg: {np.nanmean(longitude):.4f}"
    raise InputError(f"{where}; area.origin {{latitude_deg: {middle}}} is in its middle")


def _cut(spec: FileSpec, contents: Contents, mapping: Mapping, layer: Layer, box: Box) -> Source:
    """Returns the polygons of one file that are solid in a layer of heights, in a box of the plane."""
    notes = list(contents.notes)
    if layer.field is None and layer.flat_m is None and any(part.rigid for part in contents.parts):
        layer = layer._replace(flat_m=0.0)
        notes.append("no terrain: the ground is taken as flat at 0 m (ground_m)")
    solids = sliced_parts(contents.parts, mapping, layer, box)
    finest_m = 0.1
    if (raster := contents.raster) is not None:
        near = raster.window(*window_of(raster, mapping, box))
        of_map, of_terrain = (spec.unknown, "unknown", HEIGHTS_M), (spec.nodata, "nodata", (layer.low_m,) * 2)
        taken, key, heights_m = of_map if raster.occupancy else of_terrain
        if missing := int(np.isnan(raster.values).sum()):
            notes.append(f"{counted(missing, 'cell')} without a value taken as {taken} ({key})")
        shapes = placed_cells(near, occupied(near, spec, layer.low_m), mapping)
        solids += [Solid(shape, *heights_m) for shape in shapes]
        rows, columns = raster.values.shape
        finest_m = max(cell_sides(raster, mapping, columns / 2, rows / 2) or (finest_m,))
    tolerance_m = finest_m if spec.tolerance_m is None else spec.tolerance_m
    solids = clipped(solids, box)
    polygons = _outlines([each.shape for each in solids], tolerance_m)
    simpler = f"outlines simplified by at most {tolerance_m:.3g} m, outwards only"
    nothing = f"nothing of it is solid in the area between {layer.low_m:g} and {layer.high_m:g} m"
    notes.append(simpler if polygons else nothing)
    heights = tuple(_heights(polygons, solids))
    by_altitude = contents.terrain is not None or any(part.is_limited for part in contents.parts)
    return Source(spec, contents.kind, contents.sha256, tuple(polygons), heights, tuple(notes), by_altitude)


def _outlines(polygons: Sequence[Any], tolerance_m: float) -> list[Any]:
    """Returns the union of polygons, simplified and valid, with corners rounded to `DECIMALS`."""
    grown = simplified(shapely.get_parts(shapely.disjoint_subset_union_all(polygons)), tolerance_m)
    shapes = np.array(shapely.get_parts(shapely.disjoint_subset_union_all(grown)), dtype=object)
    placed = shapely.transform(shapes, lambda points: np.round(points, DECIMALS))
    bad = ~shapely.is_valid(placed)  # a sliver that the grid makes a line, too: of it nothing is left
    placed[bad] = shapely.set_precision(shapes[bad], 10.0**-DECIMALS)
    placed = shapely.remove_repeated_points(placed)
    return [each for each in shapely.get_parts(placed) if each.geom_type == "Polygon" and each.area > 0]


def _heights(polygons: Sequence[Any], solids: Sequence[Solid]) -> Iterator[tuple[float, float]]:
    """Yields bottom and top of each polygon, the lowest and the highest of the solids that it was made of."""
    tree = shapely.STRtree(shapely.point_on_surface(np.array([each.shape for each in solids], dtype=object)))
    for polygon in polygons:
        inside = [solids[index] for index in tree.query(polygon, predicate="intersects").tolist()]
        low = min((each.low_m for each in inside), default=HEIGHTS_M[0])
        high = max((each.high_m for each in inside), default=HEIGHTS_M[1])
        yield max(low, HEIGHTS_M[0]), min(high, HEIGHTS_M[1])
