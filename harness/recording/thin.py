"""Thin recordings: track, plans and obstacles of a flight, for campaigns that keep thousands.

It has the entities and the layout of a whole recording (`harness.recording.log`), without scans, sensed edges, search
and most of the time series' rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from aircraft.interface import AircraftState
from harness.flight.polylines import polylines
from harness.flight.record import AcceptedPlan, FloatArray, Track
from harness.recording import blueprint as look
from harness.recording.file import RecordingFile, recording_stream
from harness.recording.layout import thin_blueprint
from harness.recording.plans import log_plan_style
from harness.recording.properties import RUN, VARIED, Value, send_properties
from harness.recording.scene import (
    lines_2d,
    log_end,
    log_scene,
    log_summary,
    quaternions,
)
from harness.recording.series import send_curves, send_levels, thin_curves, thin_rows
from harness.recording.solids import strips_2d, strips_3d
from harness.recording.states import Nearness, send_events

if TYPE_CHECKING:
    from harness.mapping.scan import RangeScan

ROWS = 20
"""Every so many rows of the track are kept: two seconds of flight."""

CHORD_ERROR = 1e-2
"""How far a drawn plan may be off the true one, as a share of the turn radius: a pixel of the plan view is more."""


class ThinLog:
    """Writes one thin recording; an observer of the loop like `RerunLog`.

    Args:
        path: the file; its folder must exist.
        scene: what is known before the flight.
        recording_id: identity of the recording.

    Raises:
        OSError: the file cannot be written.
    """

    def __init__(self, path: Path, scene: look.Scene, recording_id: str) -> None:
        if not path.parent.is_dir():
            raise FileNotFoundError(f"no folder {path.parent} for the recording")
        self._scene = scene
        self._rec = recording_stream(recording_id)
        self._file = RecordingFile(self._rec, path, thin_blueprint(scene.frame))
        self._rec.send_recording_name(recording_id)
        self._plans: list[AcceptedPlan] = []
        self._events: list[tuple[float, str]] = []
        self._whole: list[FloatArray] = []
        self._last: Track | None = None
        self._nearness = Nearness(scene.limits.clearance_m)
        log_scene(self._rec, scene, thin=True)
        log_plan_style(self._rec, thin=True)

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """Scans are not kept."""

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        """Takes a plan as it takes effect."""
        self._plans.append(accepted)

    def on_event(self, time_s: float, text: str) -> None:
        """Takes a line of the log of events."""
        self._events.append((time_s, text))

    def on_block(self, block: Track) -> None:
        """Draws consecutive rows of the track, and the plans meanwhile."""
        self._send_plans()
        self._events += self._nearness.events(block)
        self._last = block
        rows = np.unique(np.append(np.arange(0, len(block), ROWS), len(block) - 1))
        times = [look.time_column(block.time_s[rows])]
        position = np.column_stack((block.east_m, block.north_m, block.up_m))[rows]
        self._whole.append(position)
        level = np.zeros(len(rows))
        for entity, place, turn in (
            (
                f"{look.WORLD}/aircraft",
                position,
                quaternions(block.heading_deg[rows], block.pitch_deg[rows], block.roll_deg[rows]),
            ),
            (
                f"{look.PLAN}/aircraft",
                position * (1.0, 1.0, 0.0),
                quaternions(block.heading_deg[rows], level, level),
            ),
        ):
            self._rec.send_columns(entity, times, rr.Transform3D.columns(translation=place, quaternion=turn))
        for name, curve in thin_curves(block).items():
            kept = thin_rows(name, curve, ROWS)
            send_curves(self._rec, {name: curve[kept]}, block.time_s[kept])
        send_levels(self._rec, self._scene, block.time_s)

    def end(self) -> None:
        """Ends the file as it is, without summary; after `close` it does nothing."""
        self._file.end()

    def close(
        self,
        metrics: Mapping[str, Any],
        run: Mapping[str, Value] | None = None,
        varied: Mapping[str, Value] | None = None,
    ) -> None:
        """Draws the whole track and the events, writes the summary and the typed properties, and ends the file."""
        self._send_plans()
        if self._whole:
            whole = np.concatenate(self._whole)
            track = lines_2d([whole], look.TRACK, 1.5, 15)
            self._rec.log(f"{look.PLAN}/{look.WHOLE}", track, static=True)
            # No width, for every component takes 1.5 kB of the file: the viewer's own will do.
            line = rr.LineStrips3D(strips_3d([whole]), colors=[look.TRACK])
            self._rec.log(f"{look.WORLD}/{look.WHOLE}", line, static=True)
        send_events(self._rec, [(*event, look.TOLD) for event in self._events])
        log_summary(self._rec, replace(self._scene, scenario_yaml=""), metrics)
        if self._last is not None and metrics["outcome"] not in ("reached", "unreachable"):
            log_end(self._rec, self._last, metrics["outcome"], thin=True)
        send_properties(self._rec, RUN, run or {})
        send_properties(self._rec, VARIED, varied or {})
        self._file.flush()
        self._file.end()

    def _send_plans(self) -> None:
        plans, self._plans = self._plans, []
        if not plans:
            return
        times = [look.time_column(np.array([plan.time_s for plan in plans]))]
        paths = polylines([plan.segments for plan in plans], CHORD_ERROR * self._scene.mission.turn_radius_m)
        self._rec.send_columns(f"{look.PLAN}/chosen", times, rr.LineStrips2D.columns(strips=strips_2d(paths)))
        points = [plan.plan.waypoints_m for plan in plans]
        self._rec.send_columns(
            f"{look.PLAN}/waypoints",
            times,
            rr.Points2D.columns(positions=np.concatenate(points)).partition([len(each) for each in points]),
        )
