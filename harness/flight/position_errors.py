"""Errors of the believed position: fixes lost and found again, and the true distance from the plan."""

from __future__ import annotations

import math
from collections.abc import Sequence

from aircraft.guidance.progress import PathPoint, RouteProgress
from aircraft.interface import AircraftState, Route
from harness.flight.navigation import StateEstimator
from harness.flight.observer import Caution, Observer
from harness.flight.plans import Plans


class FixEvents:
    """Notices when satellite navigation loses its fix, and when the fix is back, and tells the observers."""

    def __init__(self, navigator: StateEstimator, observers: Sequence[Observer]) -> None:
        self._navigator, self._observers = navigator, observers
        self._jumps, self._had_fix = 0, True

    def jumped(self, time_s: float) -> bool:
        """Tells whether the believed position has jumped to a new fix since the last call, and reports fixes lost."""
        navigator = self._navigator
        jumped = navigator.jumps != self._jumps
        if jumped:
            self._jumps, self._had_fix = navigator.jumps, True
            self._report(time_s, Caution("a fix again: the believed position jumps, the map is forgotten"))
        if self._had_fix and not navigator.has_fix:
            self._had_fix = False
            how, kind = ("at the start", str) if time_s == 0.0 else ("any more", Caution)
            self._report(time_s, kind(f"no fix {how}: the believed position drifts"))
        return jumped

    def _report(self, time_s: float, text: str) -> None:
        for observer in self._observers:
            observer.on_event(time_s, text)


class CrossTrack:
    """Measures the distance from the plan being flown, where no law of `aircraft.guidance` has, and before its start.

    There a plan is carried on straight, as beyond its end, up to where it was taken up by an aircraft that comes to it.
    """

    def __init__(self, plans: Plans) -> None:
        self._plans, self._index, self._begun = plans, -1, -1
        self._progress: RouteProgress | None = None
        self._taken_up_m = 0.0  # along the plan `_begun`: where it was taken up before its start, at most 0

    def of(self, state: AircraftState, index: int) -> float:
        """Returns a state's distance (m) to the right of a plan, searched from its start on; NaN without a plan."""
        if index < 0:
            return math.nan
        place = self.place(state, 0.0, index)
        return self.off_m(state, index, place.arc_length_m, place.off_m)

    def off_m(self, state: AircraftState, index: int, arc_length_m: float, off_m: float) -> float:
        """Returns what is measured at an arc length of a plan, or before its start the distance from it there."""
        plan = self._plans.accepted[index]
        east, north, ahead_east, ahead_north = plan.segments[0, :4].tolist()
        from_start = complex(state.east_m - east, state.north_m - north) * complex(ahead_east, -ahead_north)
        if index != self._begun:
            towards = state.velocity_east_mps * ahead_east + state.velocity_north_mps * ahead_north > 0.0
            self._begun, self._taken_up_m = index, min(from_start.real, 0.0) if towards else 0.0
        # Before its start a plan is carried on straight also where it begins with an arc.
        if not (arc_length_m == 0.0 > from_start.real and (len(plan.segments) > 1 or not plan.loiter)):
            return off_m
        back_m = min(from_start.real - self._taken_up_m, 0.0)
        return math.copysign(math.hypot(back_m, from_start.imag), -from_start.imag)

    def place(self, state: AircraftState, arc_length_m: float, index: int) -> PathPoint:
        """Returns the point of a plan that is nearest to a state, searched from an arc length on."""
        if self._progress is None or index != self._index:
            plan, self._index = self._plans.accepted[index], index
            self._progress = RouteProgress(Route(plan.segments, plan.loiter), arc_length_m)
        return self._progress.nearest(state.east_m, state.north_m)
