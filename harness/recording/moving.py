"""Moving obstacles in a recording: those the map knows to move, with arrows, and those that truly move."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import rerun as rr

from harness.flight.record import FloatArray
from harness.recording import blueprint as look
from harness.recording.scene import log_moving
from harness.recording.solids import strips_2d
from planner.interface import MovingEdges

DRAWN_EVERY_S = 1.0  # obstacles known to move are drawn no more often than this
ARROW_S = 30.0  # an arrow ends where its obstacle will be after this time
MOTION_STEP_ROWS = 10  # true obstacles are moved at every this many rows of the track, and at its last


class Tracked:
    """Gathers the obstacles that the map knows to move, and draws them."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, tuple[MovingEdges, ...]]] = []
        self._drawn_s, self._shown = -DRAWN_EVERY_S, False

    def take(self, time_s: float, moving: Sequence[MovingEdges]) -> None:
        """Takes the moving obstacles at a time; keeps them when they are due to be drawn, or gone."""
        if (moving and time_s - self._drawn_s >= DRAWN_EVERY_S) or (self._shown and not moving):
            self._rows.append((time_s, tuple(moving)))
            self._drawn_s, self._shown = time_s, bool(moving)

    def send(self, rec: rr.RecordingStream) -> None:
        """Sends what was gathered since the last time."""
        rows, self._rows = self._rows, []
        if not rows:
            return
        times = [look.time_column(np.array([time_s for time_s, _ in rows]))]
        counts = [len(moving) for _, moving in rows]
        every = [each for _, moving in rows for each in moving]
        lines = rr.LineStrips2D.columns(strips=strips_2d([each.points_m for each in every]))
        middles = np.array([each.points_m.mean(axis=0) for each in every]).reshape(-1, 2)
        vectors = ARROW_S * np.array([each.velocity_mps for each in every]).reshape(-1, 2)
        arrows = rr.Arrows2D.columns(origins=middles, vectors=vectors)
        for below, columns in (("", lines), ("/velocity", arrows)):
            rec.send_columns(f"{look.PLAN}/{look.TRACKED}{below}", times, columns.partition(counts))


class Changing:
    """Shows, moves and hides obstacles that move, come or go, as the flight goes on."""

    def __init__(self, scene: look.Scene) -> None:
        self._scene, self._shown_until_s = scene, -math.inf
        self._obstacles = [each for each in enumerate(scene.obstacles) if not each[1].stands_for_ever]

    def send(self, rec: rr.RecordingStream, time_s: FloatArray) -> None:
        """Sends where the obstacles are, and which appear or vanish, at the next times of the track."""
        until = float(time_s[-1])
        for index, obstacle in self._obstacles:
            start, stop = obstacle.interval_s
            if self._shown_until_s < start <= until or (start == -math.inf == self._shown_until_s):
                rec.set_time(look.TIMELINE, duration=look.nanoseconds(max(start, 0.0)))
                log_moving(rec, self._scene, index)
            if self._shown_until_s < stop <= until:
                rec.set_time(look.TIMELINE, duration=look.nanoseconds(stop))
                for entity in (look.PLAN, look.WORLD):
                    rec.log(f"{entity}/moving/{index}", rr.Clear(recursive=True))
            times = np.union1d(time_s[::MOTION_STEP_ROWS], time_s[-1:])
            times = times[(times >= start) & (times <= stop)]
            if obstacle.velocity_mps != (0.0, 0.0) and len(times):
                moved = np.outer(times - obstacle.epoch_s, (*obstacle.velocity_mps, 0.0))
                columns = [look.time_column(times)], rr.Transform3D.columns(translation=moved)
                for entity in (look.PLAN, look.WORLD):
                    rec.send_columns(f"{entity}/moving/{index}", *columns)
        self._shown_until_s = until
