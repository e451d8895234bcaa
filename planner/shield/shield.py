"""The shield: any planner's path is flown only as far as a turn from there has been seen to be free.

What the inner planner answers is made flyable (`tracking`), cut where it comes too near to something or leaves the
area, and certified (`certificate`): the longest part that ends in a full turn seen to be free is flown. Where no part
of it gets on, the certified plan in effect goes on, into its turn, and the planner is told why (`PlanRequest.refused`).
What it raises, and an answer that no aircraft could fly, are refused as well. Safe does not mean that it converges: a
planner that is caught in a trap stays in its turn there, and the reason says so.

The same idea: gatekeeper (D. R. Agrawal, R. Chen, D. Panagou, arXiv 2211.14361), model predictive shielding (O.
Bastani, arXiv 1905.10691), backup control barrier functions (T. Gurriet et al., "A scalable safety critical control
framework for nonlinear systems", IEEE Access 8, 2020).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from planner.geometry.clearance import first_breach, first_exit_m
from planner.geometry.course import Course
from planner.geometry.curves import Point, Pose, between, on_loiter, place_on, poses_at
from planner.geometry.joining import lead_of
from planner.geometry.terrain import WorkCount
from planner.interface import Mission, NoWayToBegin, Path, Plan, Planner, PlanRequest, PlanStatus, Refused
from planner.memory import ObstacleMemory
from planner.plan_checks import MOST_REASON_LETTERS, WrongAnswerError, checked_plan, text_of, type_name
from planner.shield.certificate import PROGRESS_SHARE, Certified, Certifier, hold_centre
from planner.shield.certified_planner import CertifiedPlanner
from planner.shield.committed_plan import BROKEN_SHARE, CommittedPlan, PlanMonitor, start_of
from planner.shield.escape import Room, meets, room_m
from planner.shield.refused_places import with_places
from planner.shield.tracking import MOST_TRACK_RADII, Tracked, can_be_flown, tracked

HOLD_WITHIN_RADII = 1.0
"""A path of a planner that begins its full turn within this many turn radii only asks to circle."""


@dataclass(frozen=True, eq=False)
class Adopted:
    """A path of the inner planner, and how far along it has been certified."""

    plan: Plan  # the planner's answer, checked
    own: Plan  # the same as the object that the planner gave; it gets this one back as `PlanRequest.flown`
    certified_m: float = 0.0  # arc length of its path beside the turn that the plan in effect ends with


class Shield(CertifiedPlanner):
    """A planner with a certified backup, for one flight."""

    def __init__(self, inner: Planner, mission: Mission) -> None:
        memory = ObstacleMemory(mission.clearance_m)
        monitor = PlanMonitor(
            mission,
            keep_m=BROKEN_SHARE * mission.clearance_m,
            urgent_m=math.inf,
            lead_m=lead_of(mission),
            step_m=mission.sensor_range_m,
        )
        super().__init__(mission, memory, Room(mission, memory, mission.clearance_m, WorkCount()), monitor)
        self._inner = inner
        self._adopted: Adopted | None = None  # the inner path that the plan in effect comes from
        self._proposed: Adopted | None = None
        self._own = Plan(PlanStatus.KEPT, "")  # the inner planner's last answer, as it gave it
        self._refused: Refused | None = None
        self._places: list[tuple[int, Point]] = []  # refused places, each with the map's revision before it
        self._shown_s = -math.inf  # when the last of them was put on the inner planner's map

    def plan(self, request: PlanRequest) -> Plan:
        """The longest part of the inner planner's path that is certified, or the backup."""
        fresh_m = self._sense(request)
        self._stability.note(request.time_s, request.seen)
        if self._takes_effect(request):
            self._adopted = self._proposed
        effective, here_m = self._monitor.plan, request.arc_length_m
        if effective is None:
            self._adopted = None
        else:
            here_m = on_loiter(effective.path, here_m)
            self._monitor.look(effective, here_m, request.position_m, fresh_m)
            self._monitor.broken |= meets(effective, here_m, self._mission, self._threats)
        before = self._refused
        answer = self._inner_answer(request, here_m)
        if (found := self._certify(request, here_m, answer)) is not None:
            self._log.note(request.time_s, "")
            self._monitor.proposed = found
            return found.plan
        return self._backup(request, here_m, answer, refused=self._refused is not before)

    def _inner_answer(self, request: PlanRequest, here_m: float) -> Plan:
        """The inner planner's answer, checked; a refusal where it raised, or where nobody could fly its answer."""
        flown, arc_length_m = None, 0.0
        effective, adopted = self._monitor.plan, self._adopted
        if adopted is not None and effective is not None and not effective.holds(here_m):
            flown = adopted.own
            assert adopted.plan.path is not None
            arc_length_m = _nearest_m(adopted.plan.path, request.position_m, adopted.certified_m)
        seen = with_places(request.seen, self._places)
        inner = request._replace(seen=seen, flown=flown, arc_length_m=arc_length_m, refused=self._refused)
        inner = inner._replace(committed=effective.left(here_m) if effective is not None else None)
        try:
            self._own = self._inner.plan(inner)
            return checked_plan(self._own, request.position_m, self._mission)
        except KeyboardInterrupt:
            raise
        except NoWayToBegin as error:
            return Plan(PlanStatus.NO_PATH, text_of(error))
        except WrongAnswerError as error:
            reason = text_of(error)
        except BaseException as error:  # whatever an inner planner raises, the certified plan can be flown
            reason = f"the inner planner raised {type_name(error)}: {text_of(error)}"[:300]
        self._refuse(request.position_m, reason)
        return Plan(PlanStatus.NO_PATH, reason)

    def _refuse(self, place: Point, reason: str) -> None:
        """Counts a refused plan and keeps place and reason for the planner."""
        self._log.refused_plans += 1
        self._refused = Refused(place, reason)

    def _certify(self, request: PlanRequest, here_m: float, answer: Plan) -> CommittedPlan | None:
        """A new committed plan along a new path, or further along the one that is flown; None without one."""
        if answer.status is PlanStatus.FOUND:
            return self._commit(request, here_m, Adopted(answer, self._own), new=True)
        effective, waits = self._monitor.plan, self._monitor.broken or not request.scanned
        if waits or self._adopted is None or effective is None or effective.course.to_goal:
            return None
        return self._commit(request, here_m, self._adopted, new=False)

    def _commit(self, request: PlanRequest, here_m: float, adopted: Adopted, *, new: bool) -> CommittedPlan | None:
        """The part of an inner path that is certified and makes progress; None, with a refusal, where there is none."""
        mission = self._mission
        if (track := self._flyable(request, here_m, adopted, new)) is None:
            return None
        way, points = track.path, self._memory.points_m
        keeps = np.minimum(mission.clearance_m, np.hypot(*(points - way.segments[0, :2]).T) - 1e-3)
        cut_m = min(first_breach(way, points, keeps), first_exit_m(way, mission.bounds_m))
        spacing_m = 1.5 * request.seen.spacing_m
        certifier = Certifier(self._room.holds, mission.clearance_m, mission.sensor_range_m, spacing_m)
        terrain = self._room.terrain(mission.clearance_m + mission.tracking_error_m)
        found = certifier.certify(way, request.seen, terrain, cut_m)
        if found is None or not self._makes_progress(found, track, adopted, new):
            certified, found = found, self._to_goal(certifier, request, way, cut_m)
            effective = self._monitor.plan
            if certified and not found and effective and not effective.holds(here_m):
                return None  # the plan in effect leads as far, before its turn
        if found is None or room_m(found.path, self._threats) < mission.clearance_m:
            if new and not self._both_hold(adopted, here_m):
                free_m = min(certifier.seen_free_to_m(way, request.seen), cut_m)
                self._refuse(place_on(way, free_m)[0][:2], refusal_reason(free_m, cut_m))
            return None
        self._refused = None if new else self._refused
        return self._propose(adopted, track, found)

    def _propose(self, adopted: Adopted, track: Tracked, found: Certified) -> CommittedPlan:
        """The plan along the certified part of an inner path; until it takes effect that path is the proposed one."""
        nodes = (place_on(track.path, found.loiter_entry_m)[0][:2],)
        course = Course(found.path, nodes, self._memory.known, True, not found.path.loiter)
        self._proposed = replace(adopted, certified_m=track.station_m(found.loiter_entry_m))
        return CommittedPlan(replace(adopted.plan, path=found.path), found.path, course, found.loiter_entry_m)

    def _both_hold(self, adopted: Adopted, here_m: float) -> bool:
        """Tells whether the planner only asks to circle here while the aircraft is in a certified turn anyway."""
        inner, effective = adopted.plan.path, self._monitor.plan
        if inner is None or not inner.loiter or effective is None or not effective.holds(here_m):
            return False
        return inner.length_m <= (math.tau + HOLD_WITHIN_RADII) * self._room.limits.radius_m

    def _flyable(self, request: PlanRequest, here_m: float, adopted: Adopted, new: bool) -> Tracked | None:
        """The inner path as it is, where it can be flown from the aircraft on; else a track of it, or a refusal."""
        inner = adopted.plan.path
        assert inner is not None
        here, limits = Pose(*request.position_m, *request.direction), self._room.limits
        # It takes effect where the plan in effect has led the aircraft by then.
        late_m = self._mission.ground_speed_mps * self._mission.compute_latency_s
        effective = self._monitor.plan
        then = start_of(effective, request, here_m, late_m, self._mission).pose
        bends = place_on(effective.path, here_m + late_m)[1] if effective else 0.0
        entry = Path(np.array([(*place_on(inner, late_m)[0], 0.0, 1.0)]))
        joins = can_be_flown(inner, here, bends, limits) and can_be_flown(entry, then, 0.0, limits)
        if new and not inner.loiter and joins:
            return Tracked(inner, np.concatenate(((0.0,), np.cumsum(inner.segments[:, 5]))))
        most_m = min(MOST_TRACK_RADII * limits.radius_m, self._mission.sensor_range_m)
        start = self._start(request, here_m)
        from_m = 0.0 if new else _nearest_m(inner, start.pose[:2], adopted.certified_m)
        track = tracked(start.pose, start.curvature, inner, from_m, limits, most_m)
        if track is None:
            if new:
                self._refuse(request.position_m, "the path ends behind the aircraft")
            return None
        stations = np.concatenate((np.full(len(start.prefix), track.stations_m[0]), track.stations_m))
        return Tracked(Path(np.array([*start.prefix, *track.path.segments.tolist()])), stations)

    def _makes_progress(self, found: Certified, track: Tracked, adopted: Adopted, new: bool) -> bool:
        """Whether a certified part gains along the planner's path, and ends in another turn than that in effect."""
        least_m = PROGRESS_SHARE * self._room.holds.radius_m
        effective = self._monitor.plan
        if effective is not None and effective.path.loiter:
            circle = hold_centre(effective.path.segments[-1])
            if math.dist(hold_centre(found.path.segments[-1]), circle) < least_m:
                return False
        before_m = track.stations_m[0] if new else adopted.certified_m
        return bool(track.station_m(found.loiter_entry_m) - before_m >= least_m)

    def _to_goal(self, certifier: Certifier, request: PlanRequest, way: Path, cut_m: float) -> Certified | None:
        """The way as certified into the goal circle, where all of it up to there is seen to be free; else None."""
        mission = self._mission
        inside_m = mission.goal_radius_m - mission.tracking_error_m
        at = np.arange(0.0, min(way.length_m, cut_m, mission.sensor_range_m), 0.1 * max(inside_m, 1.0))
        inside = np.hypot(*(poses_at(way, at)[:, :2] - mission.goal_m).T) <= inside_m
        if not inside.any():
            return None
        end_m = float(at[inside.argmax()])
        flown = Path(np.array(between(way, 0.0, end_m + mission.tracking_error_m) or way.segments))
        return certifier.certify_up_to(end_m, flown, request.seen, mission.bounds_m)

    def _backup(self, request: PlanRequest, here_m: float, answer: Plan, *, refused: bool) -> Plan:
        """The answer where nothing is certified, `refused` just now or not: the plan in effect, or an escape."""
        effective = self._monitor.plan
        if effective is None or self._monitor.broken:
            return self._escape_plan(request, here_m)
        if not effective.holds(here_m) or not effective.path.loiter:
            self._log.note(request.time_s, "")
            return Plan(PlanStatus.KEPT, "the certified plan in effect goes on")
        keeps = answer.status in (PlanStatus.KEPT, PlanStatus.NO_BETTER)  # the path that was refused before
        why = (self._refused if self._refused and (refused or keeps) else answer).reason or "no reason given"
        self._log.note(request.time_s, why)
        if answer.status is PlanStatus.UNREACHABLE:
            if self._refused is None and not self._places:
                return answer
            why += "; that proves nothing, since the planner was refused a path"
        self._show_refused(request)
        text = f"stuck in the turn since {self._log.since_s:.0f} s: {why}"
        return Plan(PlanStatus.NO_PATH, text[:MOST_REASON_LETTERS])

    def _escape_plan(self, request: PlanRequest, here_m: float) -> Plan:
        """An escape, or none, where no certified plan is in effect or what moves has broken it."""
        in_effect, escape = self._monitor.plan, self._find_escape(request, here_m)
        if escape.committed is not None:
            self._proposed = None
        if in_effect is not None:
            self._log.note(request.time_s, escape.plan.reason)
        return escape.plan

    def _show_refused(self, request: PlanRequest) -> None:
        """After a full holding turn, adds the place refused last to the edges the planner sees, if not near."""
        mission, here = self._mission, request.position_m
        turn_s = math.tau * self._room.holds.radius_m / mission.speed_mps
        if self._refused is None or request.time_s < max(self._log.since_s, self._shown_s) + turn_s:
            return
        place = self._refused.place_m
        beside_m = mission.clearance_m + mission.goal_radius_m
        if math.dist(place, here) > 2.0 * mission.clearance_m and math.dist(place, mission.goal_m) > beside_m:
            self._places.append((request.seen.revision, place))
            self._shown_s = request.time_s


def refusal_reason(free_m: float, cut_m: float) -> str:
    """Says why a path is refused that is seen free up to one arc length and cut at another."""
    if cut_m <= free_m:
        return "the path comes too near to something or leaves the area"
    return "no turn off the path that gets on has been seen to be free"


def _nearest_m(path: Path, place: Point, before_m: float) -> float:
    """Arc length of a path nearest to a place, at most `before_m`."""
    at = np.linspace(0.0, min(path.length_m, before_m), 201)
    return float(at[np.hypot(*(poses_at(path, at)[:, :2] - place).T).argmin()])
