"""Base class of the shield and `rolling_window`: flies certified plans, and escapes where there is none."""

from __future__ import annotations

import math

from planner.geometry.joining import lead_of
from planner.interface import FloatArray, Mission, PlanRequest
from planner.memory import ObstacleMemory
from planner.shield.committed_plan import CommittedPlan, PlanMonitor, Start, start_of
from planner.shield.encounters import met_at
from planner.shield.escape import Escape, Escapes, PlanInEffect, Room
from planner.shield.evasion import Threats
from planner.shield.intervention_log import InterventionLog, ShieldReport
from planner.world_stability import WorldStability


class CertifiedPlanner:
    """Watches the certified plan in effect and the threats to it, and escapes where no plan is certified."""

    def __init__(self, mission: Mission, memory: ObstacleMemory, room: Room, monitor: PlanMonitor) -> None:
        self._mission, self._memory, self._room, self._monitor = mission, memory, room, monitor
        self._lead_m = lead_of(mission)
        self._escapes = Escapes(mission, memory, room)
        self._threats: Threats | None = None  # while something moves or has just appeared
        self._stability = WorldStability()
        self._log = InterventionLog()

    @property
    def report(self) -> ShieldReport | None:
        """The figures of the shield so far; None without it."""
        return self._log.report

    @property
    def backup(self) -> str:
        """Why the aircraft is on the backup; empty while it flies the planner's path."""
        return self._log.backup

    def _sense(self, request: PlanRequest) -> FloatArray:
        """Takes in what was seen since the last request; returns the (k, 2) new edge points."""
        how = request.position_m, request.time_s, self._mission.speed_mps, 0.5 * self._mission.clearance_m
        fresh_m = self._memory.take_in(request.seen, [met_at(each, *how) for each in request.seen.moving])
        self._threats = self._escapes.threats(request)
        return fresh_m

    def _takes_effect(self, request: PlanRequest, removed: int = 0) -> bool:
        """Whether the plan proposed last has come into effect; `removed` edge points were gone when it was found."""
        monitor = self._monitor
        took = monitor.take_effect(request.flown, self._memory.standing_m, self._memory.cleared - removed)
        if monitor.plan is not None and monitor.plan.is_over(request.arc_length_m):
            monitor.plan = None
        return took

    def _start(self, request: PlanRequest, here_m: float, to_m: float = math.inf) -> Start:
        """Where a new plan begins: a little ahead, on the one in effect or straight on from the aircraft."""
        return start_of(self._monitor.plan, request, here_m, self._lead_m, self._mission, to_m)

    def _find_escape(
        self, request: PlanRequest, here_m: float, to_m: float = math.inf, nearer: CommittedPlan | None = None
    ) -> Escape:
        """The escape where nothing is certified: a turn that keeps clear, or the way that keeps clear longest.

        Of the plan in effect no more than to the arc length `to_m` is flown in any case. See `Escapes.from_plan`.
        """
        monitor, effective = self._monitor, self._monitor.plan
        if effective is None:
            escape = self._escapes.at_start(request, self._threats, self._lead_m)
        else:
            until_m = min(monitor.cut_m, effective.loiter_entry_m)
            left = PlanInEffect(effective, here_m, until_m, self._start(request, here_m, to_m).prefix)
            certain = not (self._memory.ever_cleared or self._stability.ever_changed)
            escape = self._escapes.from_plan(request, self._threats, left, certain=certain, nearer=nearer)
        monitor.broken = escape.broken
        monitor.proposed = escape.committed or monitor.proposed
        return escape
