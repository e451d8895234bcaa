"""Plans in a recording: the path, its waypoints and how it came about, as columns with one row a plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import rerun as rr

from harness.flight.polylines import polylines
from harness.flight.record import AcceptedPlan, FloatArray
from harness.recording import blueprint as look
from harness.recording.scene import fan
from harness.recording.solids import circle, strips_2d, strips_3d


def send_plans(
    rec: rr.RecordingStream,
    plans: Sequence[AcceptedPlan],
    held_m: Callable[[FloatArray], FloatArray],
    chord_error_m: float,
    thin: bool = False,
) -> None:
    """Draws plans, each from the time on at which it takes effect."""
    if not plans:
        return
    times = [look.time_column(np.array([each.time_s for each in plans]))]
    paths = polylines([each.segments for each in plans], chord_error_m)
    waypoints = [each.plan.waypoints_m for each in plans]
    rec.send_columns(
        f"{look.PLAN}/waypoints",
        times,
        rr.Points2D.columns(positions=np.concatenate(waypoints)).partition([len(each) for each in waypoints]),
    )
    rec.send_columns(f"{look.PLAN}/chosen", times, rr.LineStrips2D.columns(strips=strips_2d(paths)))
    if thin:
        return
    pictures = [each.plan.picture() if each.plan.picture else None for each in plans]
    guides = np.array([p.guide_m for p in pictures if p]).reshape(-1, 2, 2)
    strips: dict[str, list[list[FloatArray]]] = {
        "window": [[circle(p.guide_m[0], p.window_m)] if p and p.window_m else [] for p in pictures],
        "sectors": [
            [fan(p.guide_m[0], edges, p.window_m) for edges in p.sectors] if p else [] for p in pictures
        ],
        "candidates": [list(p.candidates[1:]) if p else [] for p in pictures],
    }
    for entity, rows in strips.items():
        flat = [strip for row in rows for strip in row]
        columns = rr.LineStrips2D.columns(strips=strips_2d(flat)).partition([len(row) for row in rows])
        rec.send_columns(f"{look.PLAN}/{entity}", times, columns)
    rec.send_columns(
        f"{look.PLAN}/guide",
        times,
        rr.Arrows2D.columns(origins=guides[:, 0], vectors=guides[:, 1] - guides[:, 0]).partition(
            [1 if p else 0 for p in pictures]
        ),
    )
    met = [p.met_m if p else np.zeros((0, 2)) for p in pictures]
    rec.send_columns(
        f"{look.PLAN}/{look.MET}",
        times,
        rr.Points2D.columns(positions=np.concatenate(met)).partition([len(each) for each in met]),
    )
    steep = [np.column_stack((path, held_m(_along(path)))) for path in paths]
    rec.send_columns(f"{look.WORLD}/chosen", times, rr.LineStrips3D.columns(strips=strips_3d(steep)))
    for entity, values in (
        (look.SEARCH, [each.compute_ms for each in plans]),
        (look.DELAYS, [each.delay_s for each in plans]),
    ):
        rec.send_columns(f"{look.SERIES}/{entity}", times, rr.Scalars.columns(scalars=np.array(values)))


def _along(path: FloatArray) -> FloatArray:
    """(n,) lengths from the begin of a polyline to its points."""
    along: FloatArray = np.append(0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T)))
    return along
