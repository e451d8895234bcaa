"""Obstacles and ground as drawings: solids and rims between heights, outlines seen from above, a shaded mesh.

Frame: local ENU plane, metres. Terrain is drawn as a rim at the height it was cut at. Polylines are turned into what
rerun keeps all at once: rerun itself would turn them one by one, a tenth of what a recording costs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.encodings import Vec2DBatch, Vec3DBatch

from harness.flight.record import FloatArray
from harness.recording import blueprint as look
from harness.recording.blueprint import Colour, Scene
from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world_files.height_field import HeightField

if TYPE_CHECKING:
    import pyarrow as pa

CIRCLE_POINTS = 72  # points of a drawn circle, if few obstacles are drawn
MOST_NODES: Final = 160_000
"""The drawn mesh of the ground has at most this many nodes; a screen shows no more."""
TO_LIGHT: Final = (-0.5, 0.5, 0.7071)
"""Vector towards the light: from the north-west and 45 degrees high, as maps are shaded."""
LOW_COLOUR, HIGH_COLOUR = np.array((58.0, 74.0, 62.0)), np.array((150.0, 140.0, 126.0))
"""Colours of the lowest and the highest ground in full light."""
SHADE_SHARE: Final = 0.35  # share of the colour that remains where no light falls

Prism: TypeAlias = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint32]]
"""Vertices (n, 3), their normals (n, 3) and triangles (k, 3) of indices, in the types that rerun keeps."""


def strips_2d(polylines: Sequence[FloatArray]) -> pa.ListArray:
    """Packs polylines (k, 2), each of its own length, as (n,) strips for rerun."""
    return _strips(polylines, 2, Vec2DBatch, rr.components.LineStrip2D)


def strips_3d(polylines: Sequence[FloatArray]) -> pa.ListArray:
    """Packs polylines (k, 3), each of its own length, as (n,) strips for rerun."""
    return _strips(polylines, 3, Vec3DBatch, rr.components.LineStrip3D)


def _strips(polylines: Sequence[FloatArray], axes: int, points: Any, strip: Any) -> pa.ListArray:
    import pyarrow as pa

    ends = np.cumsum([0, *map(len, polylines)], dtype=np.int32)
    joined = np.concatenate([np.zeros((0, axes)), *polylines], dtype=np.float32)
    return pa.ListArray.from_arrays(ends, points(joined).as_arrow_array(), type=strip.arrow_type())


def circle(center_m: Sequence[float] | FloatArray, radius_m: float, points: int = CIRCLE_POINTS) -> FloatArray:
    """(points + 1, 2) closed polygon on a circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, points + 1)
    return np.asarray(center_m) + radius_m * np.column_stack((np.cos(angle), np.sin(angle)))


def outlines(shape: Circle | Polygon, points: int = CIRCLE_POINTS) -> list[FloatArray]:
    """Returns closed rings round a shape and its holes; a circle has `points` corners."""
    if isinstance(shape, Circle):
        return [circle(shape.center_m, shape.radius_m, points)]
    return [np.array([*ring, ring[0]], dtype=np.float64) for ring in shape.rings_m]


def drawn_heights(scene: Scene, obstacle: Obstacle) -> tuple[float, float]:
    """Returns the heights (m) of bottom and top at which an obstacle is drawn: its own, cut to what is shown."""
    if obstacle.heights_m is None:
        return scene.base_m, scene.obstacle_top_m
    low, high = obstacle.heights_m
    return max(low, scene.base_m), max(min(high, scene.obstacle_top_m), scene.base_m)


def rims(scene: Scene, obstacles: Sequence[Obstacle], colour: Colour, points: int = CIRCLE_POINTS) -> rr.LineStrips3D:
    """Draws outlines at the bottom and at the top of obstacles."""
    lines = [
        np.column_stack((ring, np.full(len(ring), height)))
        for obstacle in obstacles
        for ring in outlines(obstacle.shape, points)
        for height in dict.fromkeys(drawn_heights(scene, obstacle))
    ]
    return rr.LineStrips3D(strips_3d(lines), colors=[colour], radii=rr.Radius.ui_points(0.5))


def log_solids(
    rec: rr.RecordingStream,
    entity: str,
    scene: Scene,
    obstacles: Sequence[Obstacle],
    colour: Colour,
    static: bool = True,
) -> None:
    """Logs obstacles as solids: circles as cylinders, polygons as one mesh of prisms, terrain as its rim."""
    shapes = [(each.shape, *drawn_heights(scene, each)) for each in obstacles]
    if circles := [(shape, low, high) for shape, low, high in shapes if isinstance(shape, Circle)]:
        upright = rr.Cylinders3D(
            lengths=[high - low for _, low, high in circles],
            radii=[shape.radius_m for shape, _, _ in circles],
            centers=[(*shape.center_m, 0.5 * (low + high)) for shape, low, high in circles],
            colors=[colour],
            fill_mode="solid",
        )
        rec.log(f"{entity}/circles", upright, static=static)
    prisms = [prism(shape, *ends) for shape, *ends in shapes if isinstance(shape, Polygon) and ends[1] > ends[0]]
    if prisms:
        rec.log(f"{entity}/polygons", _mesh(prisms, colour), static=static)
    if terrain := [each for each, (_, low, high) in zip(obstacles, shapes, strict=True) if high <= low]:
        rec.log(f"{entity}/terrain", rims(scene, terrain, colour), static=static)


def _mesh(prisms: Sequence[Prism], colour: Colour) -> rr.Mesh3D:
    vertices, normals, faces = zip(*prisms, strict=True)
    firsts = np.cumsum([0, *map(len, vertices[:-1])], dtype=np.uint32)
    return rr.Mesh3D(
        vertex_positions=np.concatenate(vertices),
        vertex_normals=np.concatenate(normals),
        triangle_indices=np.concatenate([own + at for own, at in zip(faces, firsts, strict=True)]),
        albedo_factor=colour,
    )


def prism(polygon: Polygon, low_m: float, high_m: float) -> Prism:
    """Returns vertices, normals and triangles of an upright prism without a floor, with sharp edges and open holes."""
    import shapely

    shape = shapely.orient_polygons(shapely.Polygon(polygon.vertices_m, polygon.holes_m))
    rings = [np.array(ring.coords) for ring in (shape.exterior, *shape.interiors)]
    begin, end = np.concatenate([ring[:-1] for ring in rings]), np.concatenate([ring[1:] for ring in rings])
    along = end - begin
    outward = np.column_stack((along[:, 1], -along[:, 0])) / np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    count = len(begin)
    walls = np.empty((count, 4, 3))
    walls[:, 0, :2] = walls[:, 3, :2] = begin
    walls[:, 1, :2] = walls[:, 2, :2] = end
    walls[:, :2, 2], walls[:, 2:, 2] = low_m, high_m
    wall_normals = np.repeat(np.column_stack((outward, np.zeros(count))), 4, axis=0)
    first = 4 * np.arange(count)[:, None]
    faces = np.concatenate((first + np.array((0, 1, 2)), first + np.array((0, 2, 3))))
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shape))
    corners = shapely.get_coordinates(shapely.orient_polygons(triangles)).reshape(-1, 4, 2)[:, :3]
    roof = np.concatenate((corners, np.full((*corners.shape[:2], 1), high_m)), axis=2).reshape(-1, 3)
    return (
        np.concatenate((walls.reshape(-1, 3), roof), dtype=np.float32),
        np.concatenate((wall_normals, np.tile((0.0, 0.0, 1.0), (len(roof), 1))), dtype=np.float32),
        np.concatenate((faces, 4 * count + np.arange(len(roof)).reshape(-1, 3))).astype(np.uint32),
    )


def log_ground(rec: rr.RecordingStream, field: HeightField) -> None:
    """Logs the ground as a mesh, thinned where it is fine; where its height is not known there is a hole."""
    rows, columns = field.heights_m.shape
    step = max(int(np.ceil(np.sqrt(rows * columns / MOST_NODES))), 1)
    heights = field.heights_m[::step, ::step]
    if min(heights.shape) < 2:
        return
    right, up = (step * each for each in field.spacing_m)
    east, north = field.places(*np.meshgrid(*(step * np.arange(float(size)) for size in heights.shape[::-1])))
    mesh = rr.Mesh3D(
        vertex_positions=np.column_stack((east.ravel(), north.ravel(), np.nan_to_num(heights).ravel())),
        vertex_colors=shaded(heights, right, up).reshape(-1, 3),
        triangle_indices=triangles(np.isfinite(heights)),
    )
    rec.log(f"{look.WORLD}/ground", mesh, static=True)


def shaded(heights: FloatArray, right_m: float, up_m: float) -> NDArray[np.uint8]:
    """(rows, columns, 3) colours by height, lit from the north-west (hillshade: Horn, Proc. IEEE 69, 1981)."""
    known = np.where(np.isfinite(heights), heights, np.nanmin(heights))
    slope_north, slope_east = np.gradient(known, up_m, right_m)
    size = np.sqrt(1.0 + slope_east**2 + slope_north**2)
    light = np.clip((-TO_LIGHT[0] * slope_east - TO_LIGHT[1] * slope_north + TO_LIGHT[2]) / size, 0.0, 1.0)
    low, high = float(known.min()), float(known.max())
    colour = LOW_COLOUR + ((known - low) / max(high - low, 1.0))[..., None] * (HIGH_COLOUR - LOW_COLOUR)
    lit = colour * (SHADE_SHARE + (1.0 - SHADE_SHARE) * light / TO_LIGHT[2])[..., None]
    return np.asarray(np.clip(lit, 0, 255).astype(np.uint8))


def triangles(known: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(k, 3) indices of two triangles a cell whose four nodes are known, counter-clockwise from above."""
    columns = known.shape[1]
    row, column = np.nonzero(known[:-1, :-1] & known[:-1, 1:] & known[1:, :-1] & known[1:, 1:])
    low = row * columns + column
    high = low + columns
    lower, upper = np.column_stack((low, low + 1, high + 1)), np.column_stack((low, high + 1, high))
    return np.concatenate((lower, upper))
