"""What has been planned in a flight: the plan in effect, the one on its way, and all before."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from aircraft.guidance.interface import GuidanceLaw
from aircraft.interface import AircraftState, Route
from aircraft.route import route_length
from harness.files.errors import in_a_line, sentence, trace
from harness.flight.guarded_planner import GuardedPlanner, PlannerFailedError
from harness.flight.observer import NOMINAL, Caution, Observer, ShieldState
from harness.flight.record import AcceptedPlan, Outcome
from harness.flight.termination import Ending
from harness.mapping.read_only_map import ReadOnlyMap
from planner.interface import MapView, Mission, Plan, Planner, PlanRequest, PlanStatus
from planner.shield.intervention_log import ShieldReport

NO_REASON = "the planner gives no reason"  # in place of an empty one, where nothing is found
LATE_S = 1e-9  # a plan or a scan counts as due this much early, because times are sums of floats


class ComingPlan(NamedTuple):
    """A plan that was found and is not in effect yet."""

    due_s: float  # when it takes effect
    compute_ms: float  # time of its search
    scan_s: float  # when the latest scan that it used was taken
    plan: Plan  # checked
    own: Plan  # as the planner gave it


class Plans:
    """Asks the planner, which sees only the map, and hands its plans to the guidance when they take effect."""

    def __init__(self, planner: Planner, mission: Mission, seen: MapView, observers: Sequence[Observer]) -> None:
        self._planner, self._map = GuardedPlanner(planner, mission), ReadOnlyMap(seen)
        self._latency_s, self._observers = mission.compute_latency_s, observers
        self.coming: ComingPlan | None = None
        self._own: Plan | None = None  # the plan in effect, as the planner gave it
        self.scan_s = math.nan  # when the latest scan that the map has was taken
        self.entered_m = 0.0  # arc length of the plan in effect at which it took effect
        self.index = -1  # index of the plan in effect, -1 before the first
        self.wants_more_time = False  # the planner is to be asked again before the next scan
        self.accepted: list[AcceptedPlan] = []
        self.compute_ms: list[float] = []
        self.compute_wall_ms: list[float] = []
        self.error: str | None = None
        """The traceback of what the planner raised, or the guidance law when it was given a plan."""
        self._last_reason, self._scanned = "", False
        self._failures: set[str] = set()  # reasons why nothing was found since the last plan
        self._last_failure = ""  # the last of these reasons
        self._arc_length_m, self._loiters_from_m = 0.0, math.inf
        self._backup, self._asked_s = False, 0.0  # whether the shield flies its backup, and when it said so

    def shield(self, time_s: float) -> ShieldReport | None:
        """Record of what the planner's shield did up to a time; None without one."""
        if (report := self._planner.shield) is None or not self._backup:
            return report
        return replace(report, time_on_backup_s=round(report.time_on_backup_s + time_s - self._asked_s, 3))

    @property
    def status_label(self) -> str:
        """The state of the flight in one word: waiting, following or holding."""
        if not self.accepted:
            return "waiting"
        return "holding" if self._arc_length_m > self._loiters_from_m else "following"

    def ask(self, state: AircraftState, arc_length_m: float, scanned: bool) -> Ending | None:
        """Asks the planner, unless a plan of its is still on its way.

        Args:
            state: what the aircraft believes.
            arc_length_m: distance along the plan in effect; NaN without one.
            scanned: the map has taken in a scan since the planner was last asked.

        Returns:
            How the flight ends, if that is the planner's answer.
        """
        self._scanned |= scanned
        if self.coming is not None:
            return None
        self._arc_length_m = arc_length_m
        request = self._request(state, arc_length_m)
        self._scanned = False
        try:
            plan, own = self._planner.plan(request)
        except PlannerFailedError as error:
            self.error = error.trace
            return Ending(Outcome.PLANNER_FAILED, str(error))
        if self._planner.shielded:
            self._asked_s = state.time_s
            self._note_backup(state.time_s)
        self._last_reason, self.wants_more_time = plan.reason, plan.wants_more_time
        if plan.status is PlanStatus.KEPT:
            return None
        self.compute_ms.append(self._planner.compute_ms)
        self.compute_wall_ms.append(self._planner.wall_ms)
        if plan.status is PlanStatus.UNREACHABLE and state.time_s > 0.0:  # a track begins before it ends
            return Ending(Outcome.UNREACHABLE, in_a_line(plan.reason) or NO_REASON)
        if plan.status is PlanStatus.NO_PATH:
            self._note_failure(state.time_s, plan.reason if plan.reason.strip() else NO_REASON)
        if plan.status is PlanStatus.FOUND:
            self._last_failure, self._failures = "", set()
            due_s = state.time_s + self._latency_s - LATE_S
            self.coming = ComingPlan(due_s, self._planner.compute_ms, self.scan_s, plan, own)
        return None

    def take_effect(self, state: AircraftState, guidance: GuidanceLaw) -> Ending | None:
        """Hands the plan on its way to the guidance, if it is due at the believed state.

        Returns:
            How the flight ends, if the guidance law raised an exception; the plan is then not in effect.
        """
        if (found := self.coming) is None or state.time_s < found.due_s:
            return None
        self.coming = None
        accepted = AcceptedPlan(len(self.accepted), state.time_s, found.compute_ms, found.plan, found.scan_s)
        route = Route(accepted.segments, accepted.loiter)
        try:
            self.entered_m = (state.time_s - (found.due_s - self._latency_s)) * state.groundspeed_mps
            guidance.follow(route, arc_length_m=self.entered_m)
        except (Exception, SystemExit) as error:  # a law of somebody else's may raise anything
            self.error = trace(error)
            said = sentence(error)
            return Ending(Outcome.LOST_CONTROL, f"the guidance law raised {said} when it was given a plan")
        self._own = found.own
        self.accepted.append(accepted)
        self.index = accepted.plan_index
        turn_m = float(route.segments[-1, 5]) if route.loiter else -math.inf
        self._arc_length_m, self._loiters_from_m = 0.0, route_length(route) - turn_m
        for observer in self._observers:
            observer.on_plan(accepted, state)
        return None

    def failure_suffix(self, outcome: Outcome) -> str:
        """Returns the planner's reason for having found no plan, to be added to the reason of an ending; else empty."""
        if outcome in (Outcome.PLANNER_FAILED, Outcome.UNREACHABLE):
            return ""
        if not (self.accepted or self.coming) and self._last_reason:
            return f"; no plan was ever found: {in_a_line(self._last_reason)}"
        if outcome is Outcome.TIMEOUT and self._last_failure:
            return f"; the planner's last reason: {in_a_line(self._last_failure)}"
        return ""

    def _request(self, state: AircraftState, arc_length_m: float) -> PlanRequest:
        speed_mps = max(state.groundspeed_mps, 1e-9)
        return PlanRequest(
            state.time_s,
            (state.east_m, state.north_m),
            (state.velocity_east_mps / speed_mps, state.velocity_north_mps / speed_mps),
            self._map,
            self._own,
            arc_length_m if self._own else 0.0,
            self._scanned,
        )

    def _note_backup(self, time_s: float) -> None:
        """Tells observers when the shield goes over to its backup, and why, and when it is back."""
        if bool(why := self._planner.backup) != self._backup:
            self._backup = bool(why)
            for observer in self._observers:
                observer.on_event(time_s, ShieldState(f"backup: {in_a_line(why)}" if why else NOMINAL))

    def _note_failure(self, time_s: float, reason: str) -> None:
        """Tells observers once of each reason why nothing is found."""
        self._last_failure = reason
        if reason not in self._failures:
            self._failures.add(reason)
            for observer in self._observers:
                observer.on_event(time_s, Caution(reason))
