"""The rolling-window planner of the paper, made safe and convergent: a state machine over a committed plan.

A course is searched N steps deep among the free sectors (`multi_step_search`, `local_planning`). The part of it that
ends in a turn seen to be free, or in the goal circle, is put into effect (`commitment`) and flown until the window
rolls on. What is done about the plan in effect is one of five states (`PlanningState`), each entered by one method.

Why it converges. The search takes unseen space as free, so the course is a shortest one through what is known. Where
the aircraft is nearer to the goal by a sensing range than each place where it turned in a hold, it may be one with room
for holds, longer by about half a turn; in wind also one past another side of an obstacle whose edge receded. It is
flown until something seen contradicts it. Edge points lie on a finite grid, so that happens finitely often, and a
course that nothing contradicts ends at the goal. A place that the aircraft turned before twice is left out of further
searches (`dead_ends`), with a disc of the clearance or more about it: these are finitely many as well. They are tried
again only where no other way is left, the widest first. A search in vain is repeated with twice the effort. Where no
way is left, a closed chain of edges proves it (`barrier`). From afar a gap may look narrower than it is: what only
looks closed is looked at again from nearer by. Where none is left but those given up, one with room to turn everywhere
must remain, or such a chain shows that there is none, and the flight ends. Assumed: a world that stands still, a sensor
that sees every gap narrower than twice the clearance as one wall, and a way to the goal along which a disc of the turn
radius can be moved at the clearance, within the area.
"""

from __future__ import annotations

import math

from planner.geometry.course import Course
from planner.geometry.curves import Pose, on_loiter, place_on
from planner.geometry.joining import lead_of
from planner.interface import FloatArray, MapView, Mission, Plan, PlanRequest, PlanStatus
from planner.memory import NO_POINTS, ObstacleMemory
from planner.plan_checks import start_tolerance_m
from planner.rolling_window.anytime_search import AnytimeSearch
from planner.rolling_window.barrier import Proofs
from planner.rolling_window.commitment import Commitment
from planner.rolling_window.config import RollingWindowConfig
from planner.rolling_window.dead_ends import MOST_EFFORT, MOST_LOOKS, MOST_RETRIES, GivingUp
from planner.rolling_window.local_planning import LocalPlanning
from planner.rolling_window.rolling_search import RollingSearch, Work
from planner.rolling_window.situation import NoRoomToTurn, NoWayFound, PlanningState, Situation
from planner.shield.certified_planner import CertifiedPlanner
from planner.shield.committed_plan import CommittedPlan, PlanMonitor, Start
from planner.shield.escape import meets, room_m
from planner.shield.intervention_log import ShieldReport

KEPT_PLAN = Plan(PlanStatus.KEPT, "the plan in effect serves")  # answer when nothing needs a search
NO_BETTER = "the plan in effect serves as well as any other"
NO_WAY_ON = "no way on can be seen to be safe; the plan in effect goes on"


class RollingWindow(CertifiedPlanner):
    """The planner for one flight.

    Shielded, it commits only to what is certified. Else it flies whole courses, and nothing where it has none.
    """

    def __init__(self, config: RollingWindowConfig, mission: Mission, shielded: bool = True) -> None:
        config, widest_m, mission = config.resolved(mission), mission.turn_radius_m, mission.spaced
        assert config.rolling_step_m is not None
        self._shielded, self._rolling_step_m = shielded, config.rolling_step_m
        memory, lead_m = ObstacleMemory(mission.clearance_m), lead_of(mission)
        self._local = LocalPlanning(
            mission, memory, margin_m=config.margin(mission), steps=config.steps, candidates=config.candidates
        )
        monitor = PlanMonitor(
            mission,
            keep_m=0.5 * (mission.clearance_m + self._local.room.path_keeps_m),
            urgent_m=lead_m + 8.0 * mission.turn_radius_m + 3.0 * mission.ground_speed_mps,
            lead_m=lead_m,
            step_m=config.rolling_step_m,
        )
        super().__init__(mission, memory, self._local.room, monitor)
        self._start_tolerance_m = start_tolerance_m(mission)
        self._commitment = Commitment(mission, self._local, lead_m + 2.0 * widest_m, shielded)
        self._proofs = Proofs(mission, memory, self._local.least_keeps_m)
        self._usual_margin_m = RollingWindowConfig().margin(mission)
        self._giving_up = GivingUp(mission, memory, self._stability)
        parts = (self._local, self._commitment, self._monitor, self._giving_up, self._proofs.none_to_find)
        self._search = RollingSearch(mission, *parts)
        self._loitered: CommittedPlan | None = None  # the plan whose turn was entered last
        self._served: tuple[object, ...] = ()  # request that the plan in effect served, while nothing is due
        self.state = PlanningState.ESCAPING

    @property
    def report(self) -> ShieldReport | None:
        """The figures of the shield so far; None without it."""
        return super().report if self._shielded else None

    def plan(self, request: PlanRequest) -> Plan:
        """Keeps the plan in effect while it serves; rolls the window and searches where it does not."""
        if self._still_serves(request):
            self._log.note(request.time_s, "")
            return KEPT_PLAN
        answer = self._update(request)
        on_course = self.state is PlanningState.FOLLOWING or (
            self._monitor.plan is None and answer.status is not PlanStatus.FOUND
        )
        # While there is no new reason, the last one holds.
        reason = answer.reason if answer.status is not PlanStatus.KEPT else self._log.backup
        self._log.note(request.time_s, "" if on_course else reason or NO_WAY_ON)
        self._log.refused_plans = self._search.refused
        return answer

    def _still_serves(self, request: PlanRequest) -> bool:
        """Tells whether the plan in effect served at the last request, and nothing new was seen or is due since."""
        seen, plan, here_m = request.seen, self._monitor.plan, request.arc_length_m
        if self._served != (request.flown, seen.revision, seen.last_contradiction_s) or seen.moving:
            return False
        assert plan is not None
        if plan.holds(here_m) or self._is_due(request, plan, here_m, newly_cut=False):
            return False
        self._local.trail.add(request.position_m)
        self._monitor.look(plan, here_m, request.position_m, NO_POINTS)  # counts the request
        return True

    def _update(self, request: PlanRequest) -> Plan:
        """Takes in what is new, and keeps the plan in effect or rolls the window."""
        self._served = ()
        fresh_m = self._take_in(request)
        if (plan := self._monitor.plan) is None:
            self._proofs.no_room_to_turn.closed(request.position_m)
            return self._roll(Situation(request, None))
        now = Situation(request, plan, request.arc_length_m)
        if in_turn := plan.holds(request.arc_length_m):
            now = Situation(request, plan, on_loiter(plan.path, request.arc_length_m))
            self._loiter(now, plan)
        # In the turn a search goes to its end: begun anew with every edge that goes, it might never come to it.
        far_on = request.arc_length_m - self._monitor.searched_at_m >= self._rolling_step_m
        if self._search.freed and far_on and not (in_turn and self._search.running):
            self._search.stop()  # it was begun with edges that have gone
            self._search.anew = True
        newly_cut = self._monitor.look(plan, now.here_m, request.position_m, fresh_m)
        if not self._is_due(request, plan, now.here_m, newly_cut) and self._search.running is None:
            if self._nothing_waits(request.seen):
                self._served = request.flown, request.seen.revision, request.seen.last_contradiction_s
            return KEPT_PLAN
        if self._search.running is None:
            self._monitor.searched_at_m = request.arc_length_m
        return self._roll(now)

    def _nothing_waits(self, seen: MapView) -> bool:
        """Whether only distance flown, and nothing that waits or threatens, can make the next search due."""
        feared = self._threats is not None or len(seen.moving) > 0
        waits = self._search.freed or self._monitor.waits or self._giving_up.waits
        return self.state is PlanningState.FOLLOWING and not (feared or waits)

    def _take_in(self, request: PlanRequest) -> FloatArray:
        """Takes in what was seen and flown since the last request; returns the (k, 2) new edge points."""
        self._giving_up.note_change(request.time_s, request.seen)
        fresh_m = self._sense(request)
        self._local.trail.add(request.position_m)
        if self._takes_effect(request, self._search.removed):
            self._giving_up.given_up_at_m = 0.0  # arc lengths are counted from the new plan's start
        return fresh_m

    def _is_due(self, request: PlanRequest, plan: CommittedPlan, here_m: float, newly_cut: bool) -> bool:
        """Whether the window is to roll on now: off the plan, as far on as is due, or something is in its way."""
        met = meets(plan, here_m, self._mission, self._threats)
        self._monitor.broken |= met
        if self._is_off_plan(request, plan, here_m):
            return True
        since_m = request.arc_length_m - self._monitor.searched_at_m
        if self._giving_up.out_of_effort and self._search.up_to_date:
            return since_m >= self._giving_up.whole_turn_m
        return self._monitor.due(plan, here_m, since_m, newly_cut) or met or self._search.anew

    def _is_off_plan(self, request: PlanRequest, plan: CommittedPlan | None, here_m: float) -> bool:
        """Whether the plan in effect is so far off that none can go on from it, as after a jump of the position."""
        return plan is not None and (
            math.dist(place_on(plan.path, here_m)[0][:2], request.position_m) > self._start_tolerance_m
        )

    def _roll(self, now: Situation) -> Plan:
        """One rolling step: search, certify, compare with the plan in effect."""
        left_behind = self._is_off_plan(now.request, now.plan, now.here_m)
        start = self._start(now.request, now.here_m, self._monitor.cut_m)
        late_m = self._mission.ground_speed_mps * self._mission.compute_latency_s
        # A plan that takes effect when the aircraft is in the turn cannot begin with the course that the turn leaves.
        turns = now.plan is not None and now.plan.holds(now.here_m + late_m)
        ahead = None if left_behind or turns else now.ahead
        serving = ahead if math.isinf(self._monitor.cut_m) and not self._monitor.broken else None
        self._search.nearer = None
        if serving is not None and (serving.shortest or self._search.up_to_date) and not self._search.anew:
            self._search.stop()
            return self._prolong(now, start, serving)
        work = self._work(now, serving is not None)
        found = self._search.go_on(now.request, start, ahead, serving is not None, work, self._threats)
        if found is not None:
            return self._follow(found)
        if serving is not None:
            return self._prolong(now, start, serving)
        return self._no_way_found(now)

    def _work(self, now: Situation, serves: bool) -> Work:
        """The portion of search work before this answer: by what moves, whether the plan is safe, and if it serves."""
        if now.request.seen.moving:
            return Work.WHILE_MOVING
        if self._unsafe(now):
            return Work.WHILE_UNSAFE
        return Work.WHILE_SERVING if serves else Work.WHILE_CUT

    def _unsafe(self, now: Situation) -> bool:
        """Whether no plan is in effect, or it is broken and what is wrong with it is near."""
        return now.plan is None or self._monitor.urgent(now.plan, now.here_m)

    def _follow(self, found: CommittedPlan) -> Plan:
        """Any state -> FOLLOWING: a new plan is committed to."""
        self.state = PlanningState.FOLLOWING
        self._monitor.proposed = found
        return found.plan

    def _prolong(self, now: Situation, start: Start, serving: Course) -> Plan:
        """FOLLOWING -> FOLLOWING: the course in effect serves; more of it is committed to where that is seen free."""
        self.state = PlanningState.FOLLOWING
        wants_more_time = self._search.running is not None
        longer = None
        if now.request.scanned:
            cut_m = self._search.cut_m(serving)
            longer = self._commitment.commit(now.request, start, serving, [], cut_m, wants_more_time)
        if (
            longer is not None
            and now.plan is not None
            and longer.loiter_entry_m > now.plan.loiter_entry_m - now.here_m + 0.5 * self._lead_m
            and room_m(longer.path, self._threats) >= self._mission.clearance_m
        ):
            return self._follow(longer)
        return Plan(PlanStatus.NO_BETTER, NO_BETTER, wants_more_time=wants_more_time)

    def _loiter(self, now: Situation, plan: CommittedPlan) -> None:
        """FOLLOWING -> LOITERING: the aircraft is in its turn. A place that was turned before twice is given up."""
        self.state = PlanningState.LOITERING
        turned_m = math.dist(now.request.position_m, self._mission.goal_m)
        self._search.turned_m = min(self._search.turned_m, turned_m)
        first, self._loitered = plan is not self._loitered, plan
        if not plan.course.to_goal or not first:
            return
        place = self._stopped_at(plan.course, now.request.seen)
        if self._giving_up.turned_twice(place[:2]):
            self._giving_up.refuse(place)

    def _stopped_at(self, course: Course, seen: MapView) -> Pose:
        """The first place of a course that has not been seen to be free, or where a doubtful one comes too near."""
        at_m = self._commitment.in_view_m(course, seen)
        if self._local.last_attempts and not course.known:
            at_m = min(at_m, self._search.cut_m(course))
        return place_on(course.path, at_m)[0]

    def _no_way_found(self, now: Situation) -> Plan:
        """After a search without a plan: goes on searching, escapes, proves that there is no way, or gives up."""
        search = self._search.last
        assert search is not None
        if now.plan is None:
            return self._without_plan(now, search)
        if self._monitor.broken and (search.exhausted or self._unsafe(now)):
            return self._escape(now)
        proved = self._check_proofs(now)
        if not search.exhausted:
            return Plan(PlanStatus.NO_PATH, "thinking on; the plan in effect goes on", wants_more_time=True)
        if search.stuck is None and self._proved_closed(now.request):
            return self._prove_no_way()
        return self._give_up(now, now.plan, search, *proved)

    def _without_plan(self, now: Situation, search: AnytimeSearch) -> Plan:
        """Escapes before the first plan, or after one flown to its end; a closed world is proved from a safe turn."""
        if (escape := self._escape(now)).status is PlanStatus.FOUND:
            return escape
        self._check_proofs(now)
        if search.stuck is None and self._proved_closed(now.request):
            return self._prove_no_way()
        return escape

    def _escape(self, now: Situation) -> Plan:
        """Any state -> ESCAPING: nothing is certified; a turn that keeps clear is flown, or what does so longest."""
        self.state = PlanningState.ESCAPING
        if not self._shielded:
            return Plan(PlanStatus.NO_PATH, "no way is found")
        return self._find_escape(now.request, now.here_m, self._monitor.cut_m, self._search.nearer).plan

    def _check_proofs(self, now: Situation) -> tuple[bool, bool]:
        """Whether no way has room to turn, asked once enough was tried; whether no way is left but given-up ones."""
        position, proofs = now.request.position_m, self._proofs
        only_given_up = len(self._memory.refused_m) > 0 and proofs.only_given_up.closed(position)
        needed = MOST_EFFORT if self._search.freed else 1  # all of it where edges have gone
        tried = self._giving_up.effort >= needed or (only_given_up and self._giving_up.tried_again)
        return tried and proofs.no_room_to_turn.closed(position), only_given_up

    def _proved_closed(self, now: PlanRequest) -> bool:
        """Whether the world stands still and the edge points seen surely leave no way at the clearance.

        Where they only leave none to be found, a smaller margin is made do with; then gaps are looked at from near by.
        """
        local, proofs = self._local, self._proofs
        if not (self._stability.settled(now.time_s) and proofs.none_to_find.closed(now.position_m)):
            return False
        if local.lower_margin(self._usual_margin_m):
            proofs.find_down_to(local.least_keeps_m)
            self._search.anew = True
            return False
        if proofs.exact and proofs.no_way.closed(now.position_m, self._memory.known):
            return True
        if not self._shielded:
            raise NoWayFound(proofs.closed_gap_m, self._mission.edge_error_m)
        if local.look_closer():
            self._giving_up.refusals, self._search.anew = 0, True
        return False

    def _give_up(
        self, now: Situation, plan: CommittedPlan, search: AnytimeSearch, no_room: bool, only_given_up: bool
    ) -> Plan:
        """LOITERING -> GIVING_UP: a search was in vain; the plan in effect goes on, into its turn and round that.

        A course that could not be taken is given up after a whole turn before it. Where no course was found, more
        effort is made, and what was given up is tried again, until nothing is left but to call the goal unreachable.
        """
        self.state = PlanningState.GIVING_UP
        giving_up, arc_length_m = self._giving_up, now.request.arc_length_m
        # More than a whole turn has been flown since the loiter was entered or a place was given up.
        turned = arc_length_m - max(plan.loiter_entry_m, giving_up.given_up_at_m) > giving_up.whole_turn_m
        looked = self._local.last_attempts and giving_up.refusals >= MOST_LOOKS
        if looked and self._proofs.none_to_find.closed(now.request.position_m, self._memory.known):
            return self._end_without_room_to_turn(now)
        if search.stuck is not None:
            if turned:
                giving_up.given_up_at_m = arc_length_m
                giving_up.refuse(self._stopped_at(search.stuck, now.request.seen))
            return Plan(PlanStatus.NO_PATH, NO_WAY_ON)
        if (narrow := giving_up.narrow(no_room, now.request.time_s)) and giving_up.retries == MOST_RETRIES:
            return self._end_without_room_to_turn(now)
        # No way is left but those given up, or one that takes more looking for. Or none that can be flown from here:
        # elsewhere on the turn there may be one.
        at_end = (only_given_up or giving_up.out_of_effort) and (turned or not search.candidates)
        giving_up.try_again(narrow, at_end, arc_length_m)
        return Plan(PlanStatus.NO_PATH, NO_WAY_ON)

    def _prove_no_way(self) -> Plan:
        """Any state -> PROVING: a closed chain of edges with no gap that any vehicle could pass."""
        self.state = PlanningState.PROVING
        chain = "a closed chain of obstacles lies between the aircraft and the goal"
        text = f"{chain}: no gap in it is wider than {self._proofs.no_way_gap_m:.0f} m"
        return Plan(PlanStatus.UNREACHABLE, text)

    def _end_without_room_to_turn(self, now: Situation) -> Plan:
        """GIVING_UP -> PROVING: a closed chain of edges with no gap that is seen to have room for a turn.

        Raises:
            NoRoomToTurn, NoWayFound: gaps are left that may be wide enough for a vehicle. That is no proof.
        """
        position, known, proofs = now.request.position_m, self._memory.known, self._proofs
        if proofs.exact and proofs.no_way.closed(position, known):
            return self._prove_no_way()
        self.state = PlanningState.PROVING
        if proofs.none_to_find.closed(position, known):
            raise NoWayFound(proofs.closed_gap_m, self._mission.edge_error_m)
        raise NoRoomToTurn(proofs.turning_gap_m)
