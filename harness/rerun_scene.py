"""What stays the same in a recording: area, standing obstacles, shape of the aircraft, summary.

Frame: local ENU plane, metres. Shapes here are drawings: an obstacle is a column without end in the simulated
world and is cut off somewhat above the flight altitude.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr

from harness import rerun_blueprint as look
from harness.obstacle import Circle, Obstacle, Polygon
from harness.record import FloatArray
from harness.rerun_blueprint import Colour, Scene

CIRCLE_POINTS = 72
AIRCRAFT_SHARE = 0.022
"""Wing span of the drawn aircraft as a share of the area: its true size could not be seen."""


def log_scene(rec: rr.RecordingStream, scene: Scene) -> None:
    """Logs all that never changes."""
    frame = scene.frame
    rec.send_property(
        look.FRAME,
        rr.AnyValues(bounds_m=frame.bounds_m, altitude_m=frame.altitude_m, clearance_m=frame.clearance_m),
    )
    rec.log(look.WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    rec.log(look.PLAN, rr.Transform3D(scale=[1.0, -1.0, 1.0]), static=True)
    _log_area(rec, scene)
    standing = [obstacle.shape for obstacle in scene.obstacles if stands_for_ever(obstacle)]
    if standing:
        rec.log(f"{look.PLAN}/obstacles", _outlines(standing, look.OBSTACLE), static=True)
        log_solids(rec, f"{look.WORLD}/obstacles", standing, scene.obstacle_top_m, look.OBSTACLE)
    _log_aircraft(rec, scene)
    for entity, (name, colour, width) in look.SERIES_STYLE.items():
        style = rr.SeriesLines(names=[name], colors=[colour], widths=[width])
        rec.log(f"{look.SERIES}/{entity}", style, static=True)
    log_summary(rec, scene, None)


def stands_for_ever(obstacle: Obstacle) -> bool:
    """Whether an obstacle neither moves nor comes or goes."""
    return obstacle.active_s is None and obstacle.velocity_mps == (0.0, 0.0)


def log_moving(rec: rr.RecordingStream, scene: Scene, index: int) -> None:
    """Shows a moving or timed obstacle from the current time on, where it is at its epoch."""
    shape = scene.obstacles[index].shape
    rec.log(f"{look.PLAN}/moving/{index}", _outlines([shape], look.MOVING))
    log_solids(rec, f"{look.WORLD}/moving/{index}", [shape], scene.obstacle_top_m, look.MOVING, static=False)


def log_solids(
    rec: rr.RecordingStream,
    entity: str,
    shapes: Sequence[Circle | Polygon],
    top_m: float,
    colour: Colour,
    static: bool = True,
) -> None:
    """Logs shapes as solids up to `top_m`: circles as cylinders, polygons as one mesh of prisms."""
    circles = [shape for shape in shapes if isinstance(shape, Circle)]
    if circles:
        rec.log(
            f"{entity}/circles",
            rr.Cylinders3D(
                lengths=[top_m] * len(circles),
                radii=[circle.radius_m for circle in circles],
                centers=[(*circle.center_m, 0.5 * top_m) for circle in circles],
                colors=[colour],
                fill_mode="solid",
            ),
            static=static,
        )
    prisms = [_prism(shape, top_m) for shape in shapes if isinstance(shape, Polygon)]
    if prisms:
        counts = np.cumsum([0, *(len(vertices) for vertices, _, _ in prisms)])
        rec.log(
            f"{entity}/polygons",
            rr.Mesh3D(
                vertex_positions=np.concatenate([vertices for vertices, _, _ in prisms]),
                vertex_normals=np.concatenate([normals for _, normals, _ in prisms]),
                triangle_indices=np.concatenate(
                    [faces + first for (_, _, faces), first in zip(prisms, counts[:-1], strict=True)]
                ),
                albedo_factor=colour,
            ),
            static=static,
        )


def log_summary(rec: rr.RecordingStream, scene: Scene, metrics: Mapping[str, Any] | None) -> None:
    """Logs the summary: what was asked, what came out (if known), what the colours mean."""
    rec.log(
        look.SUMMARY,
        rr.TextDocument(summary(scene, metrics), media_type=rr.MediaType.MARKDOWN),
        static=True,
    )


def summary(scene: Scene, metrics: Mapping[str, Any] | None) -> str:
    """The summary as Markdown."""
    mission = scene.mission
    distance = math.dist(scene.start_m, mission.goal_m)
    lines = [f"### {scene.name}", ""]
    if metrics is None:
        lines += ["Still flying, or stopped before the end.", ""]
    else:
        cross, altitude = metrics["cross_track_m"], metrics["altitude_error_m"]
        table = {
            "outcome": f"{metrics['outcome']}: {metrics['reason']}",
            "flown": f"{_text(metrics['flown_length_m'], 0)} m in {_text(metrics['flight_time_s'], 0)} s",
            "smallest clearance": f"{_text(metrics['min_clearance_m'], 0)} m of {mission.clearance_m:g} m",
            "time below it": f"{_text(metrics['clearance_violation_s'], 1)} s",
            "cross-track p95, max": f"{_text(cross['p95'], 2)} m, {_text(cross['max'], 2)} m",
            "altitude p95, max": f"{_text(altitude['p95'], 2)} m, {_text(altitude['max'], 2)} m",
            "trackable": "yes" if metrics["trackable"] else "no",
            "replans": str(metrics["replans"]),
        }
        rows = [f"| {name} | {value} |" for name, value in table.items()]
        lines += [rows[0], "|---|---|", *rows[1:], ""]
    lines += [
        f"Straight line {distance:.0f} m at {mission.speed_mps:g} m/s and {scene.altitude_m:g} m above sea "
        f"level; smallest turn radius {mission.turn_radius_m:.0f} m; "
        f"sensing range {mission.sensor_range_m:g} m.",
        "",
        look.LEGEND,
        "",
        "The aircraft is drawn larger than it is; obstacles have no top.",
        "",
    ]
    return "\n".join(lines)


def lines_2d(
    polylines: Sequence[FloatArray], colours: Colour | Sequence[Colour], width: float, order: float
) -> rr.LineStrips2D:
    """Polylines (k, 2) in the plan view, `width` in points of the screen."""
    several = colours if polylines and isinstance(colours[0], tuple) else [colours]
    return rr.LineStrips2D(
        [points[:, :2] for points in polylines],
        colors=several,
        radii=rr.Radius.ui_points(0.5 * width),
        draw_order=order,
    )


def circle(
    center_m: Sequence[float] | FloatArray, radius_m: float, points: int = CIRCLE_POINTS
) -> FloatArray:
    """(points + 1, 2) closed polygon on a circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, points + 1)
    return np.asarray(center_m) + radius_m * np.column_stack((np.cos(angle), np.sin(angle)))


def fan(center_m: FloatArray, edges: FloatArray, radius_m: float) -> FloatArray:
    """Outline of a sector from its right edge anticlockwise to its left edge.

    Args:
        center_m: (2,) its corner.
        edges: (4,) unit vectors of the right and the left edge.
        radius_m: its radius.
    """
    right = math.atan2(edges[1], edges[0])
    width = (math.atan2(edges[3], edges[2]) - right) % math.tau or math.tau
    angle = right + np.linspace(0.0, width, max(int(width / 0.1), 1) + 1)
    arc = center_m + radius_m * np.column_stack((np.cos(angle), np.sin(angle)))
    return np.concatenate(([center_m], arc, [center_m]))


def quaternions(heading_deg: FloatArray, pitch_deg: FloatArray, roll_deg: FloatArray) -> FloatArray:
    """(n, 4) xyzw rotations from body axes (x forward, y left, z up) to ENU.

    Heading is clockwise from north and turns about -z, pitch is nose up and turns about -y, roll is right
    wing down and turns about x: q = q_z(90 deg - heading) q_y(-pitch) q_x(roll) (Diebel, Representing
    Attitude, 2006).
    """
    yaw, pitch, roll = (0.5 * np.radians(angle) for angle in (90.0 - heading_deg, -pitch_deg, roll_deg))
    cy, sy, cp, sp, cr, sr = (f(angle) for angle in (yaw, pitch, roll) for f in (np.cos, np.sin))
    return np.column_stack(
        (
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
            cy * cp * cr + sy * sp * sr,
        )
    )


def _text(value: float | None, digits: int) -> str:
    return "none" if value is None else f"{value:.{digits}f}"


def _outlines(shapes: Sequence[Circle | Polygon], colour: Colour) -> rr.LineStrips2D:
    return lines_2d([_outline(shape) for shape in shapes], colour, 1.5, 10)


def _outline(shape: Circle | Polygon) -> FloatArray:
    if isinstance(shape, Circle):
        return circle(shape.center_m, shape.radius_m)
    return np.array([*shape.vertices_m, shape.vertices_m[0]], dtype=np.float64)


def _prism(
    polygon: Polygon, top_m: float
) -> tuple[FloatArray, FloatArray, np.ndarray[Any, np.dtype[np.int64]]]:
    """Vertices, normals and triangles of an upright prism without a floor, with sharp edges."""
    import shapely

    ring = np.array(shapely.geometry.polygon.orient(shapely.Polygon(polygon.vertices_m)).exterior.coords)
    begin, along = ring[:-1], np.diff(ring, axis=0)
    outward = np.column_stack((along[:, 1], -along[:, 0])) / np.hypot(*along.T)[:, None]
    vertices: list[tuple[float, ...]] = []
    normals: list[tuple[float, ...]] = []
    faces: list[tuple[int, int, int]] = []
    for corner, edge, normal in zip(begin, along, outward, strict=True):
        first = len(vertices)
        end = corner + edge
        vertices += [(*corner, 0.0), (*end, 0.0), (*end, top_m), (*corner, top_m)]
        normals += [(*normal, 0.0)] * 4
        faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    for triangle in shapely.constrained_delaunay_triangles(shapely.Polygon(ring)).geoms:
        first = len(vertices)
        corners = shapely.geometry.polygon.orient(triangle).exterior.coords[:3]
        vertices += [(*corner, top_m) for corner in corners]
        normals += [(0.0, 0.0, 1.0)] * 3
        faces.append((first, first + 1, first + 2))
    return np.array(vertices), np.array(normals), np.array(faces, dtype=np.int64)


def _log_area(rec: rr.RecordingStream, scene: Scene) -> None:
    xmin, ymin, xmax, ymax = scene.mission.bounds_m
    bounds = np.array([(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax), (xmin, ymin)])
    goal = circle(scene.mission.goal_m, scene.mission.goal_radius_m)
    rec.log(f"{look.PLAN}/bounds", lines_2d([bounds], look.BOUNDS, 1.5, 5), static=True)
    rec.log(f"{look.PLAN}/goal", lines_2d([goal], look.GOAL, 2.0, 45), static=True)
    rec.log(
        f"{look.PLAN}/ends",
        rr.Points2D(
            [scene.start_m, scene.mission.goal_m],
            colors=[look.START, look.GOAL],
            radii=rr.Radius.ui_points(5.0),
            labels=["start", "goal"],
            show_labels=True,
            draw_order=46,
        ),
        static=True,
    )
    ground = [np.column_stack((points, np.zeros(len(points)))) for points in (bounds, goal)]
    rec.log(
        f"{look.WORLD}/area",
        rr.LineStrips3D(ground, colors=[look.BOUNDS, look.GOAL], radii=rr.Radius.ui_points(0.75)),
        static=True,
    )
    poles = [
        [(*point, 0.0), (*point, 1.5 * scene.obstacle_top_m)]
        for point in (scene.start_m, scene.mission.goal_m)
    ]
    rec.log(
        f"{look.WORLD}/ends",
        rr.LineStrips3D(
            poles,
            colors=[look.START, look.GOAL],
            radii=rr.Radius.ui_points(1.5),
            labels=["start", "goal"],
            show_labels=True,
        ),
        static=True,
    )


def _log_aircraft(rec: rr.RecordingStream, scene: Scene) -> None:
    """The aircraft as a mesh (x forward, y left, z up) and as an arrowhead within the sensing range."""
    half = 0.5 * AIRCRAFT_SHARE * scene.frame.span_m
    corners = np.array(
        [
            [(1.1, 0, 0), (-1.1, 0.10, 0), (-1.1, -0.10, 0)],
            [(0.35, 0, 0.06), (-0.05, 1, 0.06), (-0.30, 0, 0.06)],
            [(0.35, 0, 0.06), (-0.30, 0, 0.06), (-0.05, -1, 0.06)],
            [(-0.8, 0, 0), (-1.1, 0.40, 0), (-1.1, -0.40, 0)],
            [(-0.75, 0, 0), (-1.15, 0, 0), (-1.15, 0, 0.35)],
        ]
    ).reshape(-1, 3)
    rec.log(
        f"{look.WORLD}/aircraft/shape",
        rr.Mesh3D(
            vertex_positions=half * corners,
            triangle_indices=np.arange(len(corners)).reshape(-1, 3),
            albedo_factor=look.AIRCRAFT,
            face_rendering="DoubleSided",
        ),
        static=True,
    )
    arrowhead = half * np.array([(1.0, 0.0), (-0.8, 0.65), (-0.4, 0.0), (-0.8, -0.65), (1.0, 0.0)])
    rec.log(f"{look.PLAN}/aircraft/shape", lines_2d([arrowhead], look.AIRCRAFT, 2.5, 60), static=True)
    rec.log(
        f"{look.PLAN}/aircraft/sensing",
        lines_2d([circle((0.0, 0.0), scene.mission.sensor_range_m)], look.SENSING, 1.0, 20),
        static=True,
    )
