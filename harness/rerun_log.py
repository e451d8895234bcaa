"""The recording of a flight for the rerun viewer: an observer of the loop that writes while it flies.

Coordinates are the local ENU plane throughout (the viewer holds them as float32: exact to a centimetre in 100
km). Everything is on the timeline `sim_time`. What a block of the track gives is sent as columns; scans are
drawn when a plan is accepted and at least every `SCAN_PERIOD_S`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from aircraft.interface import AircraftState
from harness import rerun_blueprint as look
from harness.record import AcceptedPlan, FloatArray, Track, polyline
from harness.rerun_scene import (
    circle,
    fan,
    lines_2d,
    log_moving,
    log_scene,
    log_summary,
    quaternions,
    stands_for_ever,
)
from planner.interface import PlanPicture

if TYPE_CHECKING:
    from harness.range_sensor import RangeScan

SCAN_PERIOD_S = 10.0
TRAIL_PIECE_ROWS = 20
"""Rows of the track in one piece of the trail: 2 s at 10 Hz."""
TRAIL_STEP_ROWS = 5
MARKER_STEP_ROWS = 5
MOTION_STEP_ROWS = 10


class RerunLog:
    """Writes one recording. A process that is killed leaves it readable up to the last flush.

    Args:
        path: the file; its folder must exist.
        scene: what is known before the flight.
        recording_id: identity of the recording; the same run gives the same one.

    Raises:
        OSError: the file cannot be written.
    """

    def __init__(self, path: Path, scene: look.Scene, recording_id: str) -> None:
        if not path.parent.is_dir():
            raise FileNotFoundError(f"no folder {path.parent} for the recording")
        self._scene = scene
        self._rec = rr.RecordingStream("wayproof", recording_id=recording_id)
        self._rec.set_log_time_enabled(False)
        self._rec.set_log_tick_enabled(False)
        self._rec.save(path, default_blueprint=look.blueprint(scene.frame))
        self._rec.send_recording_name(scene.name)
        self._chord_error_m = 1e-5 * scene.frame.span_m
        self._scan: RangeScan | None = None
        self._scan_logged_s = -math.inf
        self._last_point: FloatArray = np.zeros((0, 3))
        self._whole: list[FloatArray] = []
        self._shown_until_s = -math.inf
        self._moving = [each for each in enumerate(scene.obstacles) if not stands_for_ever(each[1])]
        log_scene(self._rec, scene)
        self._log_trail_style()
        self.flush()

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """Takes a scan; draws it when one is due. Cheap otherwise."""
        self._scan = scan
        if scan.time_s - self._scan_logged_s >= SCAN_PERIOD_S:
            self._log_scan(scan)

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        """Draws a plan as it takes effect, how it came about, and the scan before it."""
        if self._scan is not None and self._scan.time_s > self._scan_logged_s:
            self._log_scan(self._scan)
        self._at(accepted.time_s)
        path = polyline(accepted.segments, self._chord_error_m)
        level = np.full(len(path), self._scene.altitude_m)
        waypoints = accepted.plan.waypoints_m
        log = self._rec.log
        log(f"{look.PLAN}/chosen", lines_2d([path], look.CHOSEN, 3.0, 40))
        log(
            f"{look.PLAN}/waypoints",
            rr.Points2D(waypoints, colors=[look.CHOSEN], radii=rr.Radius.ui_points(3.5), draw_order=41),
        )
        log(f"{look.WORLD}/chosen", _lines_3d(np.column_stack((path, level)), look.CHOSEN, 2.5))
        self._log_picture(accepted.plan.picture)
        self.on_event(accepted.time_s, f"plan {accepted.plan_index}: {accepted.plan.reason}")

    def _log_picture(self, picture: PlanPicture | None) -> None:
        """Draws guide vector, window, sectors and candidates, or clears them."""
        if picture is None:
            for entity in ("guide", "window", "candidates"):
                self._rec.log(f"{look.PLAN}/{entity}", rr.Clear(recursive=False))
            return
        origin, aim = picture.guide_m
        guide = rr.Arrows2D(
            origins=[origin],
            vectors=[aim - origin],
            colors=[look.GUIDE],
            radii=rr.Radius.ui_points(1.0),
            draw_order=35,
        )
        sectors = [fan(origin, edges, picture.window_m) for edges in picture.sectors]
        window = [circle(origin, picture.window_m), *sectors]
        colours = [look.WINDOW, *[look.SECTOR] * len(sectors)]
        self._rec.log(f"{look.PLAN}/guide", guide)
        self._rec.log(f"{look.PLAN}/window", lines_2d(window, colours, 1.5, 22))
        self._rec.log(f"{look.PLAN}/candidates", lines_2d(picture.candidates[1:], look.CANDIDATE, 1.0, 30))

    def on_event(self, time_s: float, text: str) -> None:
        """Adds a line to the log of events."""
        self._at(time_s)
        self._rec.log(look.EVENTS, rr.TextLog(text, level=rr.TextLogLevel.INFO, color=look.START))

    def on_block(self, block: Track) -> None:
        """Draws consecutive rows of the track: pose, trail, moving obstacles, time series."""
        times = _time_column(block.time_s)
        position = np.column_stack((block.east_m, block.north_m, block.up_m))
        self._rec.send_columns(
            f"{look.WORLD}/aircraft",
            [times],
            rr.Transform3D.columns(
                translation=position,
                quaternion=quaternions(block.heading_deg, block.pitch_deg, block.roll_deg),
            ),
        )
        self._log_marker(block)
        self._log_trail(block.time_s, position)
        self._log_motion(block)
        clearance = np.where(np.isfinite(block.clearance_m), block.clearance_m, np.nan)
        series = {
            "cross_track/flown": block.cross_track_m,
            "clearance/flown": clearance,
            "clearance/wanted": np.full(len(block), self._scene.mission.clearance_m),
            "bank/commanded": block.roll_command_deg,
            "bank/flown": block.roll_deg,
            "speed/ground": block.groundspeed_mps,
            "speed/flown": block.airspeed_mps,
            "altitude_error/flown": block.up_m - self._scene.altitude_m,
        }
        for entity, values in series.items():
            self._rec.send_columns(f"{look.SERIES}/{entity}", [times], rr.Scalars.columns(scalars=values))

    def flush(self) -> None:
        """Writes out all that has been logged; a process killed afterwards leaves at least that."""
        self._rec.flush()

    def close(self, metrics: Mapping[str, Any] | None = None) -> None:
        """Draws the whole track, writes the summary where there are metrics, and ends the file."""
        if self._whole:
            whole = np.concatenate(self._whole)
            self._rec.log(
                f"{look.PLAN}/{look.WHOLE}", lines_2d([whole], look.WHOLE_TRACK, 1.5, 15), static=True
            )
            self._rec.log(f"{look.WORLD}/{look.WHOLE}", _lines_3d(whole, look.WHOLE_TRACK, 1.5), static=True)
        if metrics is not None:
            log_summary(self._rec, self._scene, metrics)
            self._rec.send_property("metrics", rr.AnyValues(json=json.dumps(metrics)))
        self._rec.flush()
        self._rec.disconnect()

    def _log_trail_style(self) -> None:
        width = rr.Radius.ui_points(1.25)
        self._rec.log(
            f"{look.PLAN}/{look.FLOWN}",
            rr.LineStrips2D.from_fields(colors=[look.TRACK], radii=width, draw_order=50),
            static=True,
        )
        self._rec.log(
            f"{look.WORLD}/{look.FLOWN}",
            rr.LineStrips3D.from_fields(colors=[look.TRACK], radii=width),
            static=True,
        )

    def _at(self, time_s: float) -> None:
        self._rec.set_time(look.TIMELINE, duration=np.timedelta64(round(time_s * 1e9), "ns"))

    def _log_scan(self, scan: RangeScan) -> None:
        self._scan_logged_s = scan.time_s
        hit = np.isfinite(scan.ranges_m)
        points = scan.directions[hit] * scan.ranges_m[hit, None] + (scan.east_m, scan.north_m)
        self._at(scan.time_s)
        self._rec.log(
            f"{look.PLAN}/scan",
            rr.Points2D(points, colors=[look.HIT], radii=rr.Radius.ui_points(1.5), draw_order=25),
        )

    def _log_marker(self, block: Track) -> None:
        rows = slice(None, None, MARKER_STEP_ROWS)
        position = np.column_stack(
            (block.east_m[rows], block.north_m[rows], np.zeros(len(block.time_s[rows])))
        )
        level = np.zeros(len(position))
        self._rec.send_columns(
            f"{look.PLAN}/aircraft",
            [_time_column(block.time_s[rows])],
            rr.Transform3D.columns(
                translation=position, quaternion=quaternions(block.heading_deg[rows], level, level)
            ),
        )

    def _log_trail(self, time_s: FloatArray, position_m: FloatArray) -> None:
        """Sends the trail in pieces, each at the time of its last point and joined to the one before."""
        ends = np.append(np.arange(TRAIL_PIECE_ROWS - 1, len(time_s) - 1, TRAIL_PIECE_ROWS), len(time_s) - 1)
        pieces = []
        first = 0
        for last in ends.tolist():
            rows = np.append(np.arange(first, last, TRAIL_STEP_ROWS), last)
            pieces.append(np.concatenate((self._last_point, position_m[rows])))
            self._last_point = position_m[last : last + 1]
            first = last + 1
        self._whole.append(np.concatenate(pieces))
        times = [_time_column(time_s[ends])]
        for entity, strips in (
            (look.PLAN, rr.LineStrips2D.columns(strips=[piece[:, :2] for piece in pieces])),
            (look.WORLD, rr.LineStrips3D.columns(strips=pieces)),
        ):
            self._rec.send_columns(f"{entity}/{look.FLOWN}", times, strips)

    def _log_motion(self, block: Track) -> None:
        """Shows, moves and hides the obstacles that do so during a block."""
        until = float(block.time_s[-1])
        for index, obstacle in self._moving:
            start, stop = obstacle.active_s or (-math.inf, math.inf)
            if self._shown_until_s < start <= until or (start == -math.inf == self._shown_until_s):
                self._at(max(start, 0.0))
                log_moving(self._rec, self._scene, index)
            if self._shown_until_s < stop <= until:
                self._at(stop)
                for entity in (look.PLAN, look.WORLD):
                    self._rec.log(f"{entity}/moving/{index}", rr.Clear(recursive=True))
            times = block.time_s[::MOTION_STEP_ROWS]
            times = times[(times >= start) & (times <= stop)]
            if obstacle.velocity_mps != (0.0, 0.0) and len(times):
                moved = np.outer(times - obstacle.epoch_s, (*obstacle.velocity_mps, 0.0))
                for entity in (look.PLAN, look.WORLD):
                    self._rec.send_columns(
                        f"{entity}/moving/{index}",
                        [_time_column(times)],
                        rr.Transform3D.columns(translation=moved),
                    )
        self._shown_until_s = until


def _time_column(time_s: FloatArray) -> rr.TimeColumn:
    """Simulated time, rounded to nanoseconds (rerun truncates floats)."""
    return rr.TimeColumn(look.TIMELINE, duration=np.round(time_s * 1e9).astype("timedelta64[ns]"))


def _lines_3d(points_m: FloatArray, colour: look.Colour, width: float) -> rr.LineStrips3D:
    return rr.LineStrips3D([points_m], colors=[colour], radii=rr.Radius.ui_points(0.5 * width))
