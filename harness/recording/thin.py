"""Thin recordings: track, plans and obstacles of a flight, for campaigns that keep thousands; tracks of other tools.

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
from numpy.typing import NDArray

from aircraft.frames import LocalPlane
from aircraft.interface import AircraftState
from harness.files.input_file import InputError
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
    log_shapes,
    log_summary,
    log_trail_style,
    quaternions,
)
from harness.recording.series import send_curves, send_levels, thin_curves, thin_rows
from harness.recording.solids import strips_2d, strips_3d
from harness.recording.states import Nearness, send_events
from harness.run_files.exports.exported_path import planned_points
from harness.run_files.flight_logs import LogTrack, read_log
from harness.run_files.run_folder import Run, load_run

if TYPE_CHECKING:
    from harness.mapping.scan import RangeScan

ROWS = 20
"""Every so many rows of the track are kept: two seconds of flight."""

LOG_ROWS = 20_000
"""Of a log with more rows some are left out."""
LONGEST_GAP_S = 10.0
"""A log without a row for so long, and for `GAP_ROWS` times as long as from row to row, has a gap there."""
GAP_ROWS = 10.0
BEYOND_M = 0.1
"""A place so far along the line beyond an end of what was planned is beyond it."""
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


def write_log_recording(log: Path, run_dir: Path, out: Path) -> tuple[str, ...]:
    """Writes the recording of a flight log beside a run's.

    Its track, altitude error, speed and cross-track error against the plans of the run are drawn; both begin at t = 0.

    Args:
        log: the log (`harness.run_files.flight_logs`).
        run_dir: the run's folder: its plane, its altitude, its plans.
        out: the file to write.

    Returns:
        What of the log is not there, one sentence each.

    Raises:
        InputError: the log cannot be read.
        RunFolderError: the folder holds no complete run.
    """
    from harness.scenario.scenario import parse_scenario  # half of what it takes to come to a viewer

    run = load_run(run_dir)
    scenario = parse_scenario(run.scenario_yaml, str(run_dir / "scenario.yaml"), as_flown=True)
    origin = scenario.area.origin
    track = read_log(log, LocalPlane(origin.latitude_deg, origin.longitude_deg)).thinned(LOG_ROWS)
    frame = look.Frame(
        scenario.area.bounds_m, scenario.mission.altitude_m, scenario.planner.clearance_m or 0.0
    )
    away_m = _outside_m(track, scenario.area.bounds_m)
    if away_m > frame.span_m:  # no view would show it
        raise InputError(
            f"{log}: comes no nearer than {away_m / 1e3:.0f} km to the area of {run_dir}, "
            "whose plane lies on earth where area.origin says"
        )
    rec = recording_stream(log.name)
    file = RecordingFile(rec, out, thin_blueprint(frame))
    try:
        rec.send_recording_name(log.name)
        rec.send_property(
            look.FRAME,
            rr.AnyValues(**frame.kept),
        )
        log_shapes(rec, frame)
        _send_track(rec, track, run, frame.altitude_m)
    finally:
        file.end()
    return track.notes


def _outside_m(track: LogTrack, bounds_m: tuple[float, float, float, float]) -> float:
    """How far from an area a track stays."""
    xmin, ymin, xmax, ymax = bounds_m
    east = np.maximum(np.maximum(xmin - track.east_m, track.east_m - xmax), 0.0)
    north = np.maximum(np.maximum(ymin - track.north_m, track.north_m - ymax), 0.0)
    return float(np.hypot(east, north).min())


def _send_track(rec: rr.RecordingStream, track: LogTrack, run: Run, altitude_m: float) -> None:
    position = np.column_stack((track.east_m, track.north_m, track.up_m))
    times = [look.time_column(track.time_s)]
    level = np.zeros(len(position))
    turned = quaternions(track.course_deg, level, level)
    flat = position * (1.0, 1.0, 0.0)
    for top, place in ((look.WORLD, position), (look.PLAN, flat)):
        moved = rr.Transform3D.columns(translation=place, quaternion=turned)
        rec.send_columns(f"{top}/aircraft", times, moved)
    begins = _begins(track.time_s)
    pieces = [position[row if begins[row] else row - 1 : row + 1] for row in range(len(position))]
    rec.send_columns(
        f"{look.PLAN}/{look.FLOWN}",
        times,
        rr.LineStrips2D.columns(strips=strips_2d([p[:, :2] for p in pieces])),
    )
    log_trail_style(rec)
    rec.send_columns(f"{look.WORLD}/{look.FLOWN}", times, rr.LineStrips3D.columns(strips=strips_3d(pieces)))
    stretches = np.split(position[:, :2], np.flatnonzero(begins)[1:])
    rec.log(f"{look.PLAN}/{look.WHOLE}", lines_2d(stretches, look.WHOLE_TRACK, 1.5, 15), static=True)
    series = {"altitude_error/flown": track.up_m - altitude_m, "speed/flown": track.groundspeed_mps}
    cross = cross_track_m(np.column_stack((track.east_m, track.north_m)), planned_points(run)[0])
    if cross is not None:
        series["cross_track/flown"] = cross
    for name, values in series.items():
        rec.send_columns(f"{look.SERIES}/{name}", times, rr.Scalars.columns(scalars=values))
    steps_m = np.hypot(np.diff(track.east_m), np.diff(track.north_m))
    known: dict[str, Value] = {
        "flown_length_m": float(steps_m.sum()),
        "flight_time_s": float(track.time_s[-1]),
    }
    if cross is not None and np.isfinite(cross).any():
        known["cross_track_max_m"] = float(np.nanmax(np.abs(cross)))
    send_properties(rec, RUN, known)


def _begins(time_s: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether a row is the first, or the first after a gap: what was flown meanwhile is not known."""
    steps_s = np.diff(time_s)
    return np.append(True, steps_s > max(LONGEST_GAP_S, GAP_ROWS * float(np.median(steps_s))))


def cross_track_m(points_m: FloatArray, planned_m: FloatArray) -> FloatArray | None:
    """(n,) distance of (n, 2) points from the nearest part of what was planned, positive right of it.

    NaN before its beginning and beyond its end.

    Args:
        points_m: east and north.
        planned_m: (k, 2) of every plan the part that was in effect, in the order in which it was flown.

    Returns:
        None where there is no plan.
    """
    import shapely

    if len(planned_m) < 2:
        return None
    line, places = shapely.LineString(planned_m), shapely.points(points_m)
    along_m = shapely.line_locate_point(line, places)
    before, near, after = (
        shapely.get_coordinates(shapely.line_interpolate_point(line, np.clip(along_m + by, 0.0, line.length)))
        for by in (-0.5, 0.0, 0.5)
    )
    (east, north), (off_east, off_north) = (after - before).T, (points_m - near).T
    off_m: FloatArray = np.copysign(shapely.distance(line, places), off_east * north - off_north * east)
    past = off_east * east + off_north * north
    outside = ((along_m <= 0.0) & (past < -BEYOND_M)) | ((along_m >= line.length) & (past > BEYOND_M))
    return np.where(outside, np.nan, off_m)
