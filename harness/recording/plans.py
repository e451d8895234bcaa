"""Plans in a recording: the path, its waypoints and the planner's working, as columns with one row a plan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr

from harness.flight.polylines import polylines
from harness.flight.record import AcceptedPlan, FloatArray
from harness.recording import blueprint as look
from harness.recording.scene import fan
from harness.recording.solids import circle, strips_2d, strips_3d
from planner.interface import Plan, PlanPicture

Times = list[rr.TimeColumn]


def send_plans(
    rec: rr.RecordingStream,
    scene: look.Scene,
    plans: Sequence[AcceptedPlan],
    chord_error_m: float,
    thin: bool = False,
) -> None:
    """Draws plans, each from when it takes effect; in a thin recording path and waypoints alone."""
    if not plans:
        return
    times = [look.time_column(np.array([each.time_s for each in plans]))]
    paths = polylines([each.segments for each in plans], chord_error_m)
    _send_points(rec, "waypoints", times, [each.plan.waypoints_m for each in plans])
    rec.send_columns(f"{look.PLAN}/chosen", times, rr.LineStrips2D.columns(strips=strips_2d(paths)))
    if thin:
        return
    along = [np.append(0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T))) for path in paths]
    steep = [np.column_stack((path, scene.held_m(at))) for path, at in zip(paths, along, strict=True)]
    rec.send_columns(f"{look.WORLD}/chosen", times, rr.LineStrips3D.columns(strips=strips_3d(steep)))
    _send_pictures(rec, times, [each.plan for each in plans])
    series = {look.SEARCH: [each.compute_ms for each in plans], look.DELAYS: [each.delay_s for each in plans]}
    for entity, values in series.items() if scene.searches else ():
        rec.send_columns(f"{look.SERIES}/{entity}", times, rr.Scalars.columns(scalars=np.array(values)))


def _send_pictures(rec: rr.RecordingStream, times: Times, plans: Sequence[Plan]) -> None:
    """Draws the planner's working for each plan; where a planner does not show it, a line that joins the waypoints."""
    pictures = [plan.picture() if plan.picture else None for plan in plans]
    strips = [_strips(*each) for each in zip(plans, pictures, strict=True)]
    for entity, rows in zip(("window", "sectors", "candidates"), zip(*strips, strict=True), strict=True):
        flat = strips_2d([strip for row in rows for strip in row])
        columns = rr.LineStrips2D.columns(strips=flat).partition([*map(len, rows)])
        rec.send_columns(f"{look.PLAN}/{entity}", times, columns)
    guides = np.array([picture.guide_m for picture in pictures if picture]).reshape(-1, 2, 2)
    arrows = rr.Arrows2D.columns(origins=guides[:, 0], vectors=guides[:, 1] - guides[:, 0])
    rec.send_columns(f"{look.PLAN}/guide", times, arrows.partition([int(bool(each)) for each in pictures]))
    _send_points(rec, look.MET, times, [each.met_m if each else np.zeros((0, 2)) for each in pictures])


def _strips(plan: Plan, picture: PlanPicture | None) -> tuple[list[FloatArray], ...]:
    """Returns the lines of the window, the free sectors, and the candidates that were not chosen."""
    if picture is None:
        return [], [], [plan.waypoints_m]
    here, window_m = picture.guide_m[0], picture.window_m
    window = [circle(here, window_m)] if window_m else []
    return window, [fan(here, edges, window_m) for edges in picture.sectors], list(picture.candidates[1:])


def _send_points(rec: rr.RecordingStream, entity: str, times: Times, points: Sequence[FloatArray]) -> None:
    columns = rr.Points2D.columns(positions=np.concatenate(points))
    rec.send_columns(f"{look.PLAN}/{entity}", times, columns.partition([len(each) for each in points]))
