"""The recording of a flight for the rerun viewer: an observer of the loop that writes while it flies.

Frame: local ENU plane (float32 in the viewer: exact to a centimetre in 100 km). What happens is kept until the block of
the track that it belongs to, so that a recording that stops shows everything up to the same moment.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from aircraft.interface import AircraftState
from harness.analysis.causes import NAVIGATION_ERROR
from harness.files.wording import metres
from harness.flight.observer import NOMINAL, Caution, ShieldState
from harness.flight.record import AcceptedPlan, FloatArray, IntArray, Track
from harness.mapping.scan import RangeScan
from harness.recording import blueprint as look
from harness.recording import states
from harness.recording.file import RecordingFile, RunningViewer, recording_stream
from harness.recording.layout import WHOLE_ONLY_SERIES, blueprint
from harness.recording.moving import Changing, Tracked
from harness.recording.plans import send_plans
from harness.recording.properties import RUN, VARIED, Value, send_properties
from harness.recording.scene import lines_2d, log_fences, log_scene, log_summary, log_wrong, quaternions
from harness.recording.series import curves, send_curves, send_levels, thin_curves, thin_rows
from harness.recording.solids import strips_3d
from harness.recording.trail import Sensed, Trail
from planner.interface import MovingEdges

SCAN_SHARE = 0.004
"""A scan is drawn each time that this share of the area's longer side was flown, and before every plan."""
LEAST_PERIOD_S = 2.0
"""Except before plans, scans are drawn no more often than this, so that an hour stays small in any area."""
CELL_SHARE = 0.0015
"""Side of the cells in which sensed places are gathered, as a share of the area's longer side."""
PIECE_SHARE = 0.001
"""Length of a piece of the trail, which has one colour, as a share of the area's longer side."""
MARKER_STEP_ROWS, THIN_STEP_ROWS = 5, 20
"""Every this many rows of the track one is drawn: of the marker in the plan view, and of a thin recording."""
THIN_CHORD_ERROR_SHARE = 1e-2
"""A plan in a thin recording is off the true one by up to this share of the turn radius: less than a pixel."""
FOUND_LATER_S = 1e-6
"""What is found after the flight has a time of its own beside events of the same moment: a table keeps one each."""


class RerunLog:
    """Writes one recording. A process that is killed leaves it readable up to the last block.

    It goes into a file, or, where `into` is text, to the viewer that runs at this address and then follows the flight.
    The same run gives the same `recording_id`. `moving` returns the obstacles known to move. A `thin` recording, which
    campaigns keep thousands of, has only track, plans, obstacles and few rows of three time series. An OSError says
    that the file cannot be written.
    """

    def __init__(
        self,
        into: Path | str,
        scene: look.Scene,
        recording_id: str,
        moving: Callable[[], Sequence[MovingEdges]] = tuple,
        thin: bool = False,
    ) -> None:
        if isinstance(into, Path) and not into.parent.is_dir():
            raise FileNotFoundError(f"no folder {into.parent} for the recording")
        self._scene, self._thin = scene, thin
        self._rec = recording_stream(recording_id)
        self._sink = self._open_sink(into)
        self._rec.send_recording_name(recording_id if thin else scene.name)
        span_m = scene.frame.span_m
        self._chord_error_m = THIN_CHORD_ERROR_SHARE * scene.mission.turn_radius_m if thin else 1e-5 * span_m
        self._scan_period_s = max(SCAN_SHARE * span_m / scene.mission.speed_mps, LEAST_PERIOD_S)
        piece_rows = min(max(round(10 * PIECE_SHARE * span_m / scene.mission.speed_mps), 10), 100)
        self._scan: RangeScan | None = None
        self._scan_drawn_s = self._told_s = -math.inf
        self._scans: list[RangeScan] = []
        self._plans: list[AcceptedPlan] = []
        self._events: list[tuple[float, str, look.Colour]] = []
        self._shield: list[states.Change] = []  # states of the shield, with their times
        self._shield_states: dict[str, look.Colour] = {}
        self._sensed = Sensed(CELL_SHARE * span_m)
        self._states = states.States(math.degrees(scene.limits.bank_limit_rad))
        self._trails = [Trail(entity, piece_rows) for entity in (look.FLOWN, look.BELIEVED)]
        self._whole: list[FloatArray] = []
        self._last: Track | None = None
        self._known_to_move, self._tracked, self._changing = moving, Tracked(), Changing(scene)
        self._nearness = states.NearMisses(scene.limits.clearance_m)
        log_scene(self._rec, scene, thin)
        self.flush()

    def _open_sink(self, into: Path | str) -> RecordingFile | RunningViewer:
        runs, without = ((), WHOLE_ONLY_SERIES) if self._thin else (("",), self._scene.empty_series)
        layout = partial(blueprint, self._scene.frame, runs, without, lanes=0 if self._thin else None)
        if isinstance(into, str):
            return RunningViewer(self._rec, into, layout(plays="following"))
        return RecordingFile(self._rec, into, layout())

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """Takes a scan; keeps it when one is due to be drawn."""
        if self._thin:
            return
        self._scan = scan
        self._tracked.take(scan.time_s, self._known_to_move())
        if scan.time_s - self._scan_drawn_s >= self._scan_period_s:
            self._draw(scan)

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        """Takes a plan as it takes effect; keeps the scan before it."""
        if self._scan is not None and self._scan.time_s > self._scan_drawn_s:
            self._draw(self._scan)
        self._plans.append(accepted)
        if self._thin:
            return
        self._states.on_plan(accepted)
        self._events.append((accepted.time_s, states.plan_text(accepted), look.TOLD_PLAN))

    def on_event(self, time_s: float, text: str) -> None:
        """Adds a line to the log of events."""
        self._events.append((time_s, text, look.TOLD))
        if isinstance(text, ShieldState) and not self._thin:
            before = [] if self._shield or NOMINAL in self._shield_states else [(0.0, NOMINAL)]
            self._shield += [*before, (time_s, states.mode_of(text))]

    def on_block(self, block: Track) -> None:
        """Draws consecutive rows of the track, and the scans, plans and events meanwhile."""
        self._events += [(*event, look.TOLD) for event in self._nearness.events(block)]
        self._last = block
        position = np.column_stack((block.east_m, block.north_m, block.up_m))
        send_levels(self._rec, self._scene, block.time_s)
        self._changing.send(self._rec, block.time_s)
        if self._thin:
            self._send_thin(block, position)
            return
        self._send_pending()
        self._send_aircraft(block, position, np.arange(len(block)), MARKER_STEP_ROWS)
        off = np.nan_to_num(np.abs(block.cross_track_m)) / self._scene.limits.cross_track_threshold_m
        self._whole.append(self._trails[0].send(self._rec, block.time_s, position, off))
        for lane, changes in self._states.changes(block).items():
            states.send_changes(self._rec, lane, changes)
        states.log_colours(self._rec, look.PLANNER_LANE, self._states.mode_colours())
        if self._shield:
            states.send_changes(self._rec, look.SHIELD_LANE, self._shield)
            self._shield_states |= {each: look.HOLD for _, each in self._shield} | {NOMINAL: look.CALM}
            states.log_colours(self._rec, look.SHIELD_LANE, self._shield_states)
            self._shield = []
        drawn = curves(block, self._scene.held_m(block.arc_length_m))
        for empty in self._scene.empty_series:
            drawn.pop(f"{empty}/flown", None)
        send_curves(self._rec, drawn, block.time_s)
        if block.has_beliefs:
            self._trails[1].send(self._rec, block.time_s, block.believed_m)
            errors = {f"{look.NAVIGATION}/flown": block.navigation_error_m}
            send_curves(self._rec, errors | {look.BELIEVED_OFF: block.believed_cross_track_m}, block.time_s)

    def _send_thin(self, block: Track, position_m: FloatArray) -> None:
        """Draws few rows of the track, and the plans meanwhile; events are sent at the end."""
        send_plans(self._rec, self._scene, self._plans, self._chord_error_m, thin=True)
        self._plans = []
        rows = np.unique(np.append(np.arange(0, len(block), THIN_STEP_ROWS), len(block) - 1))
        self._whole.append(position_m[rows])
        self._send_aircraft(block, position_m, rows, 1)
        for name, curve in thin_curves(block).items():
            shown = thin_rows(name, curve, THIN_STEP_ROWS)
            send_curves(self._rec, {name: curve[shown]}, block.time_s[shown])

    def flush(self) -> None:
        """Writes out all that has been logged; an OSError says that it cannot be written."""
        self._sink.flush()

    def end(self) -> None:
        """Ends the file as it is, without summary; after `close` it does nothing."""
        self._sink.end()

    def close(
        self,
        metrics: Mapping[str, Any] | None = None,
        run: Mapping[str, Value] | None = None,
        varied: Mapping[str, Value] | None = None,
    ) -> None:
        """Draws the whole track, writes summary and verdicts where there are metrics, and ends the file."""
        self._send_pending()
        if self._whole:
            whole, colour = np.concatenate(self._whole), look.TRACK if self._thin else look.WHOLE_TRACK
            self._rec.log(f"{look.PLAN}/{look.WHOLE}", lines_2d([whole], colour, 1.5, 15), static=True)
            flown = rr.LineStrips3D(strips_3d([whole]), colors=[colour], radii=rr.Radius.ui_points(0.75))
            self._rec.log(f"{look.WORLD}/{look.WHOLE}", flown, static=True)
        if metrics is not None:
            shown = replace(self._scene, scenario_yaml="") if self._thin else self._scene
            log_summary(self._rec, shown, metrics)
            self._log_found(metrics)
            log_fences(self._rec, shown, metrics.get("check", {}).get("fences", ()))
            if not self._thin:
                self._log_verdicts(metrics)
        send_properties(self._rec, RUN, run or {})
        send_properties(self._rec, VARIED, varied or {})
        self._sink.flush()
        self._sink.end()

    def _log_found(self, metrics: Mapping[str, Any]) -> None:
        """Tells what was found after the flight, and marks the places of contacts and breaches, or where it ended."""
        breaches = [*(metrics.get("contacts") or ()), *(metrics.get("breaches") or ())]
        places = [(each["east_m"], each["north_m"], each["up_m"]) for each in breaches]
        labels = [each["name"] for each in breaches]
        shown = ("reached", "unreachable", *(("collision", "out_of_bounds") if places else ()))
        if self._last is not None and metrics["outcome"] not in shown:
            places += [(self._last.east_m[-1], self._last.north_m[-1], self._last.up_m[-1])]
            labels += [metrics["outcome"].replace("_", " ")]
        if places:
            log_wrong(self._rec, np.array(places), labels)
        found = [(each["time_s"], f"{each['kind']}: {each['text']}") for each in metrics.get("findings", ())]
        for each in breaches:
            found += [(each["start_s"], f"{each['kind']}: {metres(each['depth_m'])} into {each['name']}")]
        cautions = [(at_s + FOUND_LATER_S, Caution(text), look.WARNED) for at_s, text in found]
        states.send_events(self._rec, cautions)

    def _log_verdicts(self, metrics: Mapping[str, Any]) -> None:
        legs: list[Any] = metrics["trackability"]
        alike = groupby(legs, lambda leg: states.TRACKABLE if leg["trackable"] else str(leg["cause"]))
        changes = [(float(next(own)["start_s"]), state) for state, own in alike]
        states.send_changes(self._rec, look.TRACKING_LANE, changes)
        causes = dict.fromkeys((state for _, state in changes), look.HIT) | {NAVIGATION_ERROR: look.WARNED}
        others = {states.TRACKABLE: look.TRACKED_COLOUR, states.OVER: look.CALM}
        states.log_colours(self._rec, look.TRACKING_LANE, causes | others)
        if metrics.get("shield") and not self._shield_states:  # it never flew its backup
            states.send_changes(self._rec, look.SHIELD_LANE, [(0.0, NOMINAL)])
            states.log_colours(self._rec, look.SHIELD_LANE, {NOMINAL: look.CALM})
        self._rec.send_property("metrics", rr.AnyValues(json=json.dumps(metrics)))

    def _draw(self, scan: RangeScan) -> None:
        self._scan_drawn_s = scan.time_s
        self._scans.append(scan)

    def _send_pending(self) -> None:
        scans, plans = self._scans, self._plans
        self._scans, self._plans = [], []
        self._tracked.send(self._rec)
        send_plans(self._rec, self._scene, plans, self._chord_error_m, self._thin)
        if scans:
            self._send_scans(scans)
        events, self._events = self._events, []
        self._told_s = states.send_events(self._rec, events, self._told_s)

    def _send_scans(self, scans: Sequence[RangeScan]) -> None:
        """Shows the returns of scans, and the new ones among them: dots, and posts in the 3-D view."""
        times = [look.time_column(np.array([scan.time_s for scan in scans]))]
        returned = [scan.returned()[1].view(np.float64).reshape(-1, 2) for scan in scans]
        new = [self._sensed.new(points) for points in returned]
        for entity, rows in (("scan", returned), (look.SENSED, new)):
            dots = rr.Points2D.columns(positions=np.concatenate(rows)).partition([len(each) for each in rows])
            self._rec.send_columns(f"{look.PLAN}/{entity}", times, dots)
        points_m = np.concatenate(new)
        posts = np.full((len(points_m), 2, 3), self._scene.base_m)
        posts[:, :, :2], posts[:, 1, 2] = points_m[:, None], self._scene.obstacle_top_m
        strips = rr.LineStrips3D.columns(strips=strips_3d(list(posts))).partition([len(each) for each in new])
        self._rec.send_columns(f"{look.WORLD}/{look.SENSED}", times, strips)

    def _send_aircraft(self, block: Track, position_m: FloatArray, rows: IntArray, step: int) -> None:
        """Moves the aircraft in the 3-D view at the given rows, in the plan view at each `step`-th and the last."""
        few = np.union1d(rows[::step], rows[-1:])
        for top, at, solid in ((look.WORLD, rows, 1.0), (look.PLAN, few, 0.0)):
            tilts = np.where(solid, (block.pitch_deg[at], block.roll_deg[at]), 0.0)
            turn = quaternions(block.heading_deg[at], *tilts)
            pose = rr.Transform3D.columns(translation=position_m[at] * (1.0, 1.0, solid), quaternion=turn)
            self._rec.send_columns(f"{top}/aircraft", [look.time_column(block.time_s[at])], pose)
