"""A way into a turn where none is seen to be safe: the plan in effect goes on, or is left for a turn, or evades."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from planner.certificate import CertificateBroken, Certifier
from planner.course import Course
from planner.curves import Segment, onward
from planner.effect import Effect
from planner.evasion import AHEAD_S, LATER, Threats, clearest, rolled_out, step_along_m
from planner.hold import hold
from planner.interface import Mission, Path, Plan, PlanRequest, PlanStatus, SeenWorld
from planner.local_planning import LocalPlanning
from planner.memory import ObstacleMemory
from planner.route_optimisation import Terrain

HOLD_SHARES = (1.0, 0.5, 0.25)
"""Shares of what paths keep: a turn is sought with one after the other."""

CLEARER = 0.05
"""Another way evades what is in the way if it keeps further from it by this share of what paths keep."""

EVADING_S = 60.0
"""The certificate holds for a world that stands still: so long after something appeared it may be broken."""


@dataclass(frozen=True, eq=False)
class Escape:
    """What to do where nothing is certified.

    Attributes:
        plan: the answer.
        effect: what it would put into effect, where it is a new plan.
        broken: the plan in effect comes too near to something.
    """

    plan: Plan
    effect: Effect | None = None
    broken: bool = True


class Escapes:
    """Finds escapes.

    Args:
        mission: goal and limits.
        memory: what is remembered.
        local: limits of curves, and distances kept.
    """

    def __init__(self, mission: Mission, memory: ObstacleMemory, local: LocalPlanning) -> None:
        self._mission, self._memory, self._local = mission, memory, local
        self._certifier = Certifier(local.limits, mission.clearance_m, math.inf, step_along_m(mission))

    def threats(self, request: PlanRequest) -> Threats | None:
        """What is near, while something moves or has just appeared: then what was certified may be met all the same."""
        lately = len(request.seen.moving) > 0 or request.time_s - request.seen.surprised_s < EVADING_S
        return self._near(request) if lately else None

    def at_start(self, request: PlanRequest, threats: Threats | None, lead_m: float) -> Escape:
        """A turn before the first plan."""
        straight = Path(np.array([(*request.position_m, *request.direction, 0.0, lead_m)]))
        for share in HOLD_SHARES:
            turn = hold(straight, 0.0, lead_m, self._local.limits, self._standing(share))
            if turn is not None and self._fits(None, threats, share, turn):
                return self._away(request, turn, "no way on can be seen to be safe; turning away")
        return Escape(Plan(PlanStatus.NO_PATH, "there is no room for a turn at the start"))

    def from_plan(
        self,
        request: PlanRequest,
        threats: Threats | None,
        effect: Effect,
        here: float,
        *,
        until_m: float,
        prefix: Sequence[Segment],
        certain: bool,
    ) -> Escape:
        """A turn that only keeps away from what is known, or a way that evades what moves or has appeared.

        Args:
            request: what was asked.
            threats: what is near, if that is to be feared.
            effect: the plan in effect.
            here: station of the aircraft on it.
            until_m: station up to which it can be flown.
            prefix: what of it is flown in any case.
            certain: nothing has changed so far, nor been taken back by the sensor.

        Raises:
            CertificateBroken: there is no room for a turn, though all is certain.
        """
        left = left_of(effect, here, self._mission)
        ways: list[Path] = []  # made when they are first asked for: most plans in effect will do
        # What hides behind something that moves or has appeared is no better than that: space seen to be free first.
        for seen_free, share in itertools.product((True, False) if threats else (False,), HOLD_SHARES):
            # A turn that keeps so much of all that stands can be flown for ever.
            terrain = self._standing(share)
            fits = partial(self._fits, request.seen if seen_free else None, threats, share)
            if fits(left) and terrain.admits(effect.left(here)):
                reason = "the plan in effect goes on into its turn, nearer to something than wanted"
                return Escape(Plan(PlanStatus.NO_PATH, reason), broken=False)
            turn = hold(effect.path, here, until_m, self._local.limits, terrain)
            if turn is not None and fits(turn):
                return self._away(request, turn, "no way on can be seen to be safe; turning away")
            if threats is not None:
                ways = ways or list(rolled_out(prefix, self._local.limits))
                way = next((each for each in ways if fits(each) and terrain.admits(each)), None)
                if way is not None:
                    return self._away(request, way, "something is in the way; turning away")
        if certain:
            raise CertificateBroken(request.time_s)
        threats = threats or self._near(request)
        more_than_m = threats.room_m(left) + CLEARER * self._local.path_keeps_m
        ways = ways or list(rolled_out(prefix, self._local.limits))
        clear = clearest(ways, self._mission.bounds_m, threats, more_than_m)
        if clear is not None:
            return self._away(request, clear, "something is in the way; turning away")
        reason = "something is in the way; the plan in effect keeps as clear of it as any other"
        return Escape(Plan(PlanStatus.NO_PATH, reason))

    def _fits(self, seen: SeenWorld | None, threats: Threats | None, share: float, path: Path) -> bool:
        """Whether a path keeps a share of what is wanted from what is near, and lies in space seen to be free.

        To lie there is asked only where `seen` is given. What is met is met, be it far ahead: with less to be kept,
        being far ahead counts for less.
        """
        least_m = share * self._local.path_keeps_m
        if threats is not None and threats.room_m(path, least_m, share * LATER) < least_m:
            return False
        return seen is None or self._certifier.seen_free_to_m(path, seen) >= path.length_m

    def _standing(self, share: float) -> Terrain:
        """Where a curve keeps a share of what is wanted from what stands: what was only refused is in nobody's way."""
        return self._local.terrain(share * self._local.path_keeps_m, standing=True)

    def _near(self, request: PlanRequest) -> Threats:
        return Threats.about(request, self._memory.genuine_m, self._mission)

    @staticmethod
    def _away(request: PlanRequest, path: Path, reason: str) -> Escape:
        """A plan that leads nowhere but into its turn."""
        waypoints = np.array([request.position_m, path.segments[-1, :2]])
        plan = Plan(PlanStatus.FOUND, reason, waypoints, path)
        course = Course(path, (request.position_m,), 0, shortest=False, to_goal=False)
        return Escape(plan, Effect(plan, path, course, path.length_m - float(path.segments[-1, 5])))


def room_m(path: Path, threats: Threats | None, least_m: float = -math.inf) -> float:
    """How far a path keeps from what is near; infinite where nothing is to be feared. See `Threats.room_m`."""
    return math.inf if threats is None else threats.room_m(path, least_m)


def left_of(effect: Effect, here: float, mission: Mission) -> Path:
    """What of a plan in effect is flown within `AHEAD_S`."""
    return Path(np.array(onward(effect.path, here, AHEAD_S * mission.speed_mps)))
