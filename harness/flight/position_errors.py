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
    """Measures the distance from the plan being flown where no law of `aircraft.guidance` has done so."""

    def __init__(self, plans: Plans) -> None:
        self._plans, self._index = plans, -1
        self._progress: RouteProgress | None = None

    def of(self, state: AircraftState, index: int) -> float:
        """Returns a state's distance (m) to the right of a plan, searched from its start on; NaN without a plan."""
        if index < 0:
            return math.nan
        place, plan = self.place(state, 0.0, index), self._plans.accepted[index]
        east, north, ahead_east, ahead_north = plan.segments[0, :4].tolist()
        from_start = complex(state.east_m - east, state.north_m - north) * complex(ahead_east, -ahead_north)
        # Before its start a plan is carried on straight, as beyond its end, also where it begins with an arc.
        before = place.arc_length_m == 0.0 > from_start.real and (len(plan.segments) > 1 or not plan.loiter)
        return -from_start.imag if before else place.off_m

    def place(self, state: AircraftState, arc_length_m: float, index: int) -> PathPoint:
        """Returns the point of a plan that is nearest to a state, searched from an arc length on."""
        if self._progress is None or index != self._index:
            plan, self._index = self._plans.accepted[index], index
            self._progress = RouteProgress(Route(plan.segments, plan.loiter), arc_length_m)
        return self._progress.nearest(state.east_m, state.north_m)
