"""Escapes: the ways that are flown where no certified plan is left.

The plan in effect goes on to its end, or it is left for a turn, or for a way that evades what moves or has appeared.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from planner.geometry.clearance import behind
from planner.geometry.course import Course
from planner.geometry.curves import Limits, Point, Segment, onward, place_on, places_along, sample
from planner.geometry.joining import divert_to_loiter
from planner.geometry.terrain import Terrain, WorkCount
from planner.interface import MapView, Mission, NoWayToBegin, Path, Plan, PlanRequest, PlanStatus
from planner.memory import ObstacleMemory
from planner.plan_checks import start_tolerance_m
from planner.shield.certificate import CertificateBroken, Certifier
from planner.shield.committed_plan import BROKEN_SHARE, CommittedPlan
from planner.shield.evasion import AHEAD_S, DISCOUNT, Threats, clearest, rolled_out, step_along_m

LOITER_SHARES = (1.0, 0.5, 0.25)
"""Shares of the distance that paths keep from edge points; a turn is sought with one share after the other."""

CLEARER_SHARE = 0.2
"""An option is better than one before only if it keeps further from everything by this share of the kept distance."""

EVADING_S = 60.0
"""Certified plans are checked against threats for this long after something appeared: they assume a still world."""

TURNING_AWAY = "no way on can be seen to be safe; turning away"
GOES_ON = "the plan in effect goes on to its end, nearer to something than wanted"
IN_THE_WAY = "something is in the way; turning away"

UNSEEN_SHARE = 0.9
"""Share of the clearance that is flown straight on from the start before anything ahead has to be seen free: a sensor
that loses returns needs several scans, and the start is clear of obstacles by the clearance."""

NO_ROOM = "there is no room for a turn at the start"
NOT_SEEN = "nothing ahead of the aircraft has been seen to be free"


class Room:
    """The space of one flight: `limits` of turns, and of the full turns that plans end in, `holds`.

    Paths keep `path_keeps_m` from every edge point where there is room.
    """

    def __init__(self, mission: Mission, memory: ObstacleMemory, path_keeps_m: float, work_count: WorkCount) -> None:
        self._mission, self._memory, self._work_count = mission, memory, work_count
        self.path_keeps_m = path_keeps_m
        self.limits = Limits.of(mission)
        self.holds = self.limits._replace(radius_m=mission.hold_radius_m)

    def terrain(self, keep_m: float, standing: bool = False) -> Terrain:
        """Where a curve may lie that keeps one distance from all edge points, or from those that were seen to stand."""
        points = self._memory.genuine_m if standing else self._memory.points_m
        return Terrain(points, np.full(len(points), keep_m), self._mission.bounds_m, self._work_count)


class _Option(NamedTuple):
    """One option of an escape."""

    path: Path  # what would be flown
    standing: Path | None = None  # what of it must keep clear of what stands; None where that is known
    reason: str = ""  # why it is flown, a sentence
    committed: CommittedPlan | None = None  # the certified plan that it comes from


@dataclass(frozen=True, eq=False)
class Escape:
    """The answer where nothing is certified."""

    plan: Plan
    committed: CommittedPlan | None = None  # the new plan; None: the plan in effect goes on
    broken: bool = True  # the plan in effect comes too near to something


class Escapes:
    """Looks for escapes, for one flight."""

    def __init__(self, mission: Mission, memory: ObstacleMemory, room: Room) -> None:
        self._mission, self._memory, self._room = mission, memory, room
        self._certifier = Certifier(room.holds, mission.clearance_m, math.inf, step_along_m(mission))
        self._late_m = mission.ground_speed_mps * mission.compute_latency_s  # flown until it takes effect
        self._began_m: Point | None = None  # where the aircraft was when it had no plan for the first time
        self._began_unseen = False  # the first turn led where nothing was seen to be free: nothing is certain

    def threats(self, request: PlanRequest) -> Threats | None:
        """What stands near the aircraft and all that moves, while something moves or has just appeared; else None."""
        if not (request.time_s - request.seen.last_contradiction_s < EVADING_S or len(request.seen.moving)):
            return None
        return Threats.within_reach(request, self._memory.genuine_m, self._mission)

    def at_start(self, request: PlanRequest, threats: Threats | None, lead_m: float) -> Escape:
        """A turn before the first plan, where what is ahead was seen to be free at all; else NoWayToBegin."""
        self._began_m = self._began_m or request.position_m
        onward_m = self._mission.sensor_range_m
        ahead = Path(np.array([(*request.position_m, *request.direction, 0.0, onward_m)]))
        ways = list(rolled_out([(*request.position_m, *request.direction, 0.0, lead_m)], self._room.limits))
        least = self._standing(LOITER_SHARES[-1])
        turn = divert_to_loiter(ahead, 0.0, onward_m, self._room.holds, least, None, 0.0)
        if turn is None and not any(map(least.admits, ways)):
            raise NoWayToBegin(NO_ROOM)
        pieces = math.ceil(onward_m / (0.25 * self._room.holds.radius_m))
        if not request.seen.seen_free(places_along(ahead, onward_m, pieces)).any():
            if math.dist(self._began_m, request.position_m) > UNSEEN_SHARE * self._mission.clearance_m:
                raise NoWayToBegin(NOT_SEEN)
            return Escape(Plan(PlanStatus.NO_PATH, NOT_SEEN))
        first: Path | None = None
        for way in self._turns_at_start(ahead, lead_m, ways, threats):
            if not self._leads_behind(way, request):
                self._began_unseen = self._certifier.seen_free_to_m(way, request.seen) < way.length_m
                return self._turn_away(request, way, TURNING_AWAY)
            first = first or way
        if first is None:
            return Escape(Plan(PlanStatus.NO_PATH, NO_ROOM))
        self._began_unseen = True
        return self._turn_away(request, first, TURNING_AWAY)

    def _turns_at_start(
        self, ahead: Path, lead_m: float, ways: Sequence[Path], threats: Threats | None
    ) -> Iterator[Path]:
        """Turns that keep a share of what is wanted, those that keep more of it first."""
        for share in LOITER_SHARES:
            standing = self._standing(share)
            turn = divert_to_loiter(ahead, 0.0, lead_m, self._room.holds, standing, None, self._late_m)
            for way in [turn, *ways] if turn is not None else ways:
                if self._best_option([_Option(way, way)], standing, None, threats, share) is not None:
                    yield way

    def _leads_behind(self, path: Path, request: PlanRequest) -> bool:
        """Tells whether a path leads behind a seen face, where the rest of the obstacle may lie."""
        places = sample(path, 0.25 * self._mission.clearance_m)
        beside_m = request.seen.spacing_m + 0.5 * self._mission.clearance_m
        return bool(behind(places, request.position_m, self._memory.genuine_m, beside_m).any())

    def from_plan(
        self,
        request: PlanRequest,
        threats: Threats | None,
        effective: PlanInEffect,
        *,
        certain: bool,
        nearer: CommittedPlan | None = None,
    ) -> Escape:
        """A turn that only keeps away from what is known, or a way that evades what moves or has appeared.

        `certain`: nothing has changed so far, nor been taken back by the sensor. `nearer` is a certified plan that
        would come nearer than wanted to what moves or has appeared.

        Raises CertificateBroken where there is no room for a turn, though all is certain.
        """
        committed, here, _, prefix = effective
        left = left_of(committed, here, self._mission)
        ways: list[Path] = []  # made when they are first asked for: most plans in effect will do
        path, from_m, to_m = self._left_from(request, effective)

        def options(terrain: Terrain) -> Iterator[_Option]:
            if nearer is not None:
                yield _Option(nearer.path, None, "", nearer)
            yield _Option(left, committed.left(here), GOES_ON)
            turn = divert_to_loiter(path, from_m, to_m, self._room.holds, terrain, None, self._late_m)
            if turn is not None:
                yield _Option(turn, None, TURNING_AWAY)
            if threats is not None:
                ways.extend(() if ways else rolled_out(prefix, self._room.limits))
                yield from (_Option(way, way, IN_THE_WAY) for way in ways)

        # A turn that keeps a share of what is wanted of all that stands can be flown for ever. What hides behind
        # something that moves or has appeared is no better than that: space seen to be free first.
        terrains = [(share, self._standing(share)) for share in LOITER_SHARES]
        for seen, (share, terrain) in product((request.seen, None) if threats else (None,), terrains):
            best = self._best_option(options(terrain), terrain, seen, threats, share)
            if best is None:
                continue
            if best.path is left:
                return Escape(Plan(PlanStatus.NO_PATH, best.reason), broken=False)
            if best.committed is not None:
                return Escape(best.committed.plan, best.committed)
            return self._turn_away(request, best.path, best.reason)
        if certain and not self._began_unseen:
            raise CertificateBroken(request.time_s)
        ways = ways or list(rolled_out(prefix, self._room.limits))
        threats = threats or Threats.within_reach(request, self._memory.genuine_m, self._mission)
        return self._clearest(request, threats, left, ways)

    def _left_from(self, request: PlanRequest, effective: PlanInEffect) -> tuple[Path, float, float]:
        """The path to leave for a turn, between two arc lengths; `prefix` off the plan, or past all of it."""
        committed, here, until_m, prefix = effective
        off_m = math.dist(place_on(committed.path, here)[0][:2], request.position_m)
        # As after a jump of the believed position, or where it will be past that when a turn takes effect.
        if off_m > start_tolerance_m(self._mission) or self._late_m > max(0.0, until_m - here):
            return Path(np.array(prefix)), 0.0, sum(segment[5] for segment in prefix)
        return committed.path, here, until_m

    def _clearest(self, request: PlanRequest, threats: Threats, left: Path, ways: Sequence[Path]) -> Escape:
        """The way with the most room, where none has enough; the rest of the plan in effect if that has as much."""
        more_than_m = threats.room_m(left) + CLEARER_SHARE * self._room.path_keeps_m
        clear = clearest(ways, self._mission.bounds_m, threats, more_than_m)
        if clear is not None:
            return self._turn_away(request, clear, IN_THE_WAY)
        reason = "something is in the way; the plan in effect keeps as clear of it as any other"
        return Escape(Plan(PlanStatus.NO_PATH, reason))

    def _best_option(
        self,
        options: Iterable[_Option],
        terrain: Terrain,
        seen: MapView | None,
        threats: Threats | None,
        share: float,
    ) -> _Option | None:
        """The option that keeps furthest from what is near, of those that keep a share of what is wanted.

        More than what is wanted is no better. Each must be clearer than those before it, and lie in space that was
        `seen` to be free, if that is given. With less to be kept, being far ahead counts for less.
        """
        keeps_m = self._room.path_keeps_m
        best, least_m = None, share * keeps_m
        for each in options:
            room = room_m(each.path, threats, least_m, share * DISCOUNT)
            if room < least_m or not (each.standing is None or terrain.admits(each.standing)):
                continue
            if seen is None or self._certifier.seen_free_to_m(each.path, seen) >= each.path.length_m:
                best, least_m = each, room + CLEARER_SHARE * keeps_m
            if least_m > keeps_m:
                break
        return best

    def _standing(self, share: float) -> Terrain:
        """Terrain of a share of the distance kept from what stands; refused places do not count."""
        return self._room.terrain(share * self._room.path_keeps_m, standing=True)

    @staticmethod
    def _turn_away(request: PlanRequest, path: Path, reason: str) -> Escape:
        plan = Plan(PlanStatus.FOUND, reason, np.array([request.position_m, path.segments[-1, :2]]), path)
        course = Course(path, (request.position_m,), 0, shortest=False, to_goal=False)
        return Escape(plan, CommittedPlan(plan, path, course, path.length_m - float(path.segments[-1, 5])))


class PlanInEffect(NamedTuple):
    """A plan that can be flown from `here` to `until_m` (arc lengths); of it `prefix` is flown in any case."""

    committed: CommittedPlan
    here: float
    until_m: float
    prefix: Sequence[Segment]


def room_m(path: Path, threats: Threats | None, least_m: float = -math.inf, later: float = DISCOUNT) -> float:
    """Distance (m) that a path keeps from threats; infinite without any. See `Threats.room_m`."""
    return math.inf if threats is None else threats.room_m(path, least_m, later)


def meets(plan: CommittedPlan, here_m: float, mission: Mission, threats: Threats | None) -> bool:
    """Tells whether the plan in effect would come too near to something that moves or has just appeared."""
    least_m = BROKEN_SHARE * mission.clearance_m
    return threats is not None and room_m(left_of(plan, here_m, mission), threats, least_m) < least_m


def left_of(committed: CommittedPlan, here: float, mission: Mission) -> Path:
    """The part of a plan in effect that is flown within `AHEAD_S`."""
    return Path(np.array(onward(committed.path, here, AHEAD_S * mission.speed_mps)))
