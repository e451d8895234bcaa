"""The unchanging part of a recording: area, standing obstacles, shape of the aircraft, summary, and styles.

Frame: local ENU plane, metres.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import rerun as rr

from harness.analysis.metric import round_length_m
from harness.flight.record import FloatArray
from harness.recording import blueprint as look
from harness.recording.blueprint import Colour, Scene
from harness.recording.series import log_series_styles
from harness.recording.solids import CIRCLE_POINTS, circle, log_ground, log_solids, outlines, rims, strips_2d
from harness.recording.states import AT_LIMIT, FREE, log_colours
from harness.recording.summary import colours, summary

LEAST_CIRCLE_POINTS, THIN_CIRCLE_POINTS, POINTS_OF_ALL = 12, 24, 400_000
"""Points of a circle at the least and in a thin recording, and of all circles together, which must fit into memory."""
AIRCRAFT_SHARE = 0.022
"""Wing span of the drawn aircraft as a share of the area's longer side: its true size could not be seen."""

STYLES: Final[tuple[tuple[str, Any, look.Colour | None, float, float | None], ...]] = (
    (f"{look.PLAN}/{look.SENSED}", rr.Points2D, look.EDGE_POINTS, 1.25, 12),
    (f"{look.PLAN}/window", rr.LineStrips2D, look.WINDOW, 0.75, 22),
    (f"{look.PLAN}/sectors", rr.LineStrips2D, look.SECTOR, 0.75, 23),
    (f"{look.PLAN}/{look.MET}", rr.Points2D, look.MET_DOTS, 1.0, 24),
    (f"{look.PLAN}/scan", rr.Points2D, look.HIT, 1.5, 25),
    (f"{look.PLAN}/{look.TRACKED}", rr.LineStrips2D, look.MOVES, 1.5, 26),
    (f"{look.PLAN}/{look.TRACKED}/velocity", rr.Arrows2D, look.MOVES, 1.0, 27),
    (f"{look.PLAN}/candidates", rr.LineStrips2D, look.CANDIDATE, 0.5, 30),
    (f"{look.PLAN}/guide", rr.Arrows2D, look.GUIDE, 1.0, 35),
    (f"{look.PLAN}/chosen", rr.LineStrips2D, look.CHOSEN, 1.5, 40),
    (f"{look.PLAN}/waypoints", rr.Points2D, look.CHOSEN, 3.5, 41),
    (f"{look.PLAN}/{look.BELIEVED}", rr.LineStrips2D, look.CHOSEN, 0.75, 49),
    (f"{look.PLAN}/{look.FLOWN}", rr.LineStrips2D, None, 1.25, 50),
    (f"{look.WORLD}/{look.SENSED}", rr.LineStrips3D, look.EDGE_POINTS, 0.75, None),
    (f"{look.WORLD}/chosen", rr.LineStrips3D, look.CHOSEN, 1.25, None),
    (f"{look.WORLD}/{look.FLOWN}", rr.LineStrips3D, None, 1.25, None),
    (f"{look.WORLD}/{look.BELIEVED}", rr.LineStrips3D, look.CHOSEN, 0.25, None),
)
"""Entity, archetype, colour (None: it comes with the data), size in points of the screen, order of drawing."""
THIN_ENTITIES: Final = (f"{look.PLAN}/chosen", f"{look.PLAN}/waypoints")
"""Entities of `STYLES` that a thin recording has."""

AIRCRAFT_TRIANGLES = np.array(
    [
        [(1.1, 0, 0), (-1.1, 0.10, 0), (-1.1, -0.10, 0)],
        [(0.35, 0, 0.06), (-0.05, 1, 0.06), (-0.30, 0, 0.06)],
        [(0.35, 0, 0.06), (-0.30, 0, 0.06), (-0.05, -1, 0.06)],
        [(-0.8, 0, 0), (-1.1, 0.40, 0), (-1.1, -0.40, 0)],
        [(-0.75, 0, 0), (-1.15, 0, 0), (-1.15, 0, 0.35)],
    ]
)
"""(5, 3, 3) triangles of the drawn aircraft, of half span 1: body, wings, tailplane, fin."""


def log_scene(rec: rr.RecordingStream, scene: Scene, thin: bool = False) -> None:
    """Logs all that never changes, and styles; a thin recording has few points of circles, and no summary yet."""
    rec.send_property(look.FRAME, rr.AnyValues(**scene.frame.recorded))
    rec.log(look.WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    rec.log(look.PLAN, rr.Transform3D(scale=[1.0, -1.0, 1.0]), static=True)
    _log_area(rec, scene)
    if scene.ground is not None:
        log_ground(rec, scene.ground)
    if standing := [obstacle for obstacle in scene.obstacles if obstacle.stands_for_ever]:
        points = max(LEAST_CIRCLE_POINTS, min(CIRCLE_POINTS, POINTS_OF_ALL // len(standing)))
        if thin:
            points = min(points, THIN_CIRCLE_POINTS)
        # With many obstacles each of these is large: none is kept while the next is made.
        rings = [ring for each in standing for ring in outlines(each.shape, points)]
        rec.log(f"{look.PLAN}/outlines", lines_2d(rings, look.OUTLINE, 1.5, 10), static=True)
        del rings
        if not thin:
            rec.log(f"{look.WORLD}/outlines", rims(scene, standing, look.OUTLINE, points), static=True)
        log_solids(rec, f"{look.WORLD}/{look.TRUE}", scene, standing, look.OBSTACLE)
    _log_aircraft(rec, scene.frame)
    if not thin:
        if scene.searches:
            sensing = lines_2d([circle((0.0, 0.0), scene.mission.sensor_range_m)], look.SENSING, 1.0, 20)
            rec.log(f"{look.PLAN}/aircraft/sensing", sensing, static=True)
        rec.log(look.COLOURS, rr.TextDocument(colours(scene), media_type=rr.MediaType.MARKDOWN), static=True)
        log_summary(rec, scene, None)
    _log_styles(rec, scene, thin)


def _log_styles(rec: rr.RecordingStream, scene: look.Scene, thin: bool) -> None:
    for entity, archetype, colour, size, order in STYLES:
        if entity in THIN_ENTITIES or not (thin or (entity.endswith(look.BELIEVED) and not scene.believes)):
            style = {"colors": colour and [colour], "radii": rr.Radius.ui_points(size)}
            style |= {"draw_order": order} if order else {}
            rec.log(entity, archetype.from_fields(**style), static=True)
    log_series_styles(rec, scene, thin)
    if not thin:
        log_colours(rec, look.BANK_LANE, {FREE: look.CALM, AT_LIMIT: look.HIT})


def log_moving(rec: rr.RecordingStream, scene: Scene, index: int) -> None:
    """Outlines a moving or timed obstacle from the current time on, where it is at its epoch."""
    obstacle = scene.obstacles[index]
    rec.log(f"{look.PLAN}/moving/{index}", lines_2d(outlines(obstacle.shape), look.MOVING_OUTLINE, 1.5, 10))
    rec.log(f"{look.WORLD}/moving/{index}", rims(scene, [obstacle], look.MOVING_OUTLINE))
    log_solids(rec, f"{look.WORLD}/moving/{index}", scene, [obstacle], look.MOVING, static=False)


def log_wrong(rec: rr.RecordingStream, places_m: FloatArray, labels: Sequence[str]) -> None:
    """Marks the places (n, 3) where a flight went wrong, each with a label."""
    mark: dict[str, Any] = {"colors": [look.HIT], "radii": rr.Radius.ui_points(7.0)}
    label: dict[str, Any] = {"labels": list(labels), "show_labels": True}
    label |= {"colors": [look.END_LABEL_COLOUR], "radii": rr.Radius.ui_points(0.0)}
    for below, style, order in (("", mark, 70), ("/label", label, 71)):
        plan, world = f"{look.PLAN}/{look.END}{below}", f"{look.WORLD}/{look.END}{below}"
        rec.log(plan, rr.Points2D(places_m[:, :2], draw_order=order, **style), static=True)
        rec.log(world, rr.Points3D(places_m, **style), static=True)


def log_fences(rec: rr.RecordingStream, scene: Scene, fences: Sequence[Mapping[str, Any]]) -> None:
    """Outlines the fences of a checked path, as `metrics.json` has them, in both views."""
    rings: list[FloatArray] = []
    colours: list[Colour] = []
    for fence in fences:
        sides = [np.array([*ring, ring[0]]) for ring in fence.get("rings_m", ())]
        rings += sides or [circle(fence["center_m"], fence["radius_m"])]
        colours += [look.FENCES[fence["kind"]]] * max(len(sides), 1)
    if rings:
        rec.log(f"{look.PLAN}/fences", lines_2d(rings, colours, 1.5, 12), static=True)
        low = [np.column_stack((ring, np.full(len(ring), scene.base_m))) for ring in rings]
        outlines = rr.LineStrips3D(low, colors=colours, radii=rr.Radius.ui_points(0.75))
        rec.log(f"{look.WORLD}/fences", outlines, static=True)


def log_summary(rec: rr.RecordingStream, scene: Scene, metrics: Mapping[str, Any] | None) -> None:
    """Logs the summary: the task, the results (if known), and the meaning of the colours."""
    page = rr.TextDocument(summary(scene, metrics), media_type=rr.MediaType.MARKDOWN)
    rec.log(look.SUMMARY, page, static=True)


def lines_2d(
    polylines: Sequence[FloatArray],
    colours: Colour | Sequence[Colour],
    width: float,
    order: float,
    label: str = "",
) -> rr.LineStrips2D:
    """Returns polylines (k, 2) for the plan view, `width` in points of the screen, with a label at their middle."""
    return rr.LineStrips2D(
        strips_2d([points[:, :2] for points in polylines]),
        colors=colours if polylines and isinstance(colours[0], tuple) else [colours],
        radii=rr.Radius.ui_points(0.5 * width),
        draw_order=order,
        labels=[label] if label else None,
        show_labels=True if label else None,
    )


def fan(center_m: FloatArray, edges: FloatArray, radius_m: float) -> FloatArray:
    """Returns the outline of a sector from its right edge anticlockwise to its left edge."""
    right = math.atan2(edges[1], edges[0])
    width = (math.atan2(edges[3], edges[2]) - right) % math.tau or math.tau
    angle = right + np.linspace(0.0, width, max(int(width / 0.1), 1) + 1)
    arc = center_m + radius_m * np.column_stack((np.cos(angle), np.sin(angle)))
    return np.concatenate(([center_m], arc, [center_m]))


def quaternions(heading_deg: FloatArray, pitch_deg: FloatArray, roll_deg: FloatArray) -> FloatArray:
    """Returns (n, 4) xyzw rotations from body axes (x forward, y left, z up) to ENU.

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


def _log_area(rec: rr.RecordingStream, scene: Scene) -> None:
    ends = [look.START_COLOUR, look.GOAL_LABEL_COLOUR]
    xmin, ymin, xmax, ymax = scene.mission.bounds_m
    bounds = np.array([(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax), (xmin, ymin)])
    goal = circle(scene.mission.goal_m, scene.mission.goal_radius_m)
    rec.log(f"{look.PLAN}/bounds", lines_2d([bounds], look.BOUNDS, 1.5, 5), static=True)
    rec.log(f"{look.PLAN}/goal", lines_2d([goal], look.GOAL, 2.0, 45), static=True)
    places = scene.start_m, scene.mission.goal_m
    style: dict[str, Any] = {"colors": ends, "labels": ["start", "goal"]}
    dots = rr.Points2D(places, radii=rr.Radius.ui_points(5.0), show_labels=True, draw_order=46, **style)
    rec.log(f"{look.PLAN}/ends", dots, static=True)
    _log_scale_and_wind(rec, scene)
    ground = [np.column_stack((points, np.full(len(points), scene.base_m))) for points in (bounds, goal)]
    area = rr.LineStrips3D(ground, colors=[look.BOUNDS, look.GOAL], radii=rr.Radius.ui_points(0.75))
    rec.log(f"{look.WORLD}/area", area, static=True)
    top_m = 1.5 * scene.obstacle_top_m - 0.5 * scene.base_m
    poles = [[(*place, scene.base_m), (*place, top_m)] for place in places]
    lines = rr.LineStrips3D(poles, radii=rr.Radius.ui_points(1.5), show_labels=True, **style)
    rec.log(f"{look.WORLD}/ends", lines, static=True)


def _log_scale_and_wind(rec: rr.RecordingStream, scene: Scene) -> None:
    """Logs a scale bar and an arrow along the wind, in two corners of the plan view."""
    xmin, ymin, xmax, ymax = scene.frame.bounds_m
    margin_m = 0.04 * scene.frame.span_m
    bar_m = round_length_m(0.25 * scene.frame.span_m)
    bar = np.array([(xmax - margin_m - bar_m, ymin + margin_m), (xmax - margin_m, ymin + margin_m)])
    label = f"{bar_m / 1000:g} km" if bar_m >= 1000 else f"{bar_m:g} m"
    rec.log(f"{look.PLAN}/scale", lines_2d([bar], look.START_COLOUR, 2.0, 47, label), static=True)
    from_deg, blows = scene.wind
    if blows:
        towards = -np.array((math.sin(math.radians(from_deg)), math.cos(math.radians(from_deg))))
        middle = np.array((xmin + 3.0 * margin_m, ymax - 3.0 * margin_m))
        left = np.array((-towards[1], towards[0]))
        head = middle + margin_m * towards
        arrow = [middle - margin_m * towards, head, head - 0.5 * margin_m * (towards - 0.5 * left)]
        arrow += [head, head - 0.5 * margin_m * (towards + 0.5 * left)]
        label = blows.replace(" from", "\nfrom").replace(" at", "\nat")
        wind = lines_2d([np.array(arrow)], look.START_COLOUR, 2.0, 47, label)
        rec.log(f"{look.PLAN}/wind", wind, static=True)


def _log_aircraft(rec: rr.RecordingStream, frame: look.Frame) -> None:
    """Logs the aircraft as a mesh (x forward, y left, z up) in the 3-D view, and as an arrowhead in the plan view."""
    half = 0.5 * AIRCRAFT_SHARE * frame.span_m
    corners = half * AIRCRAFT_TRIANGLES.reshape(-1, 3)
    mesh = rr.Mesh3D(
        vertex_positions=corners,
        triangle_indices=np.arange(len(corners)).reshape(-1, 3),
        albedo_factor=look.AIRCRAFT,
        face_rendering="DoubleSided",
    )
    rec.log(f"{look.WORLD}/aircraft/shape", mesh, static=True)
    arrowhead = half * np.array([(1.0, 0.0), (-0.8, 0.65), (-0.4, 0.0), (-0.8, -0.65), (1.0, 0.0)])
    rec.log(f"{look.PLAN}/aircraft/shape", lines_2d([arrowhead], look.AIRCRAFT, 2.5, 60), static=True)
