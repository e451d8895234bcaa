"""The rolling-window planner of the paper, made safe and convergent.

In every rolling step: take the planning window about the track point where the new plan begins; search N steps deep
among the free sectors for the n best tracks (`multi_step_search`); shorten each under the minimum turn radius
(`route_optimisation`); the shortest of the n is the course (`local_planning`). Of the course that part is put into
effect (`commitment`) which ends in a turn seen to be free, or in the goal circle (`certificate`), and flown until the
window rolls on. A search that takes long goes on while the plan in effect is flown (`deliberation`). Where something
moves or has just appeared, no plan is flown that would meet it, and one that would is left (`escape`, `evasion`).

Why it converges. The search goes through all that is remembered, unseen space taken as free: as long as there is a
way, the course is a shortest one through what is known. Each course is flown until something seen contradicts it.
Edge points lie on a finite grid, so that this can happen only finitely often, and a course that nothing
contradicts ends at the goal. A place that the aircraft turned before twice is left out of further searches
(`dead_ends`, `ObstacleMemory.refuse`), with what lies beside it: each covers a disc of the clearance or more, so
that these are finitely many as well; they are tried again only where no other way is left, and then the widest are
looked for first. A search in vain is repeated with twice the effort; where nothing is left open at all, the
distances to go (`cost_to_go`) tell it at once. Where no way is left at the clearance, a closed chain of edges
proves it; where none is left but those given up, one with room to turn everywhere must remain, or such a chain
proves that there is none for this aircraft (`barrier`). Assumed: a world that stands still, a sensor that sees
every gap narrower than twice the clearance as one wall, and a way to the goal along which a disc of the turn
radius can be moved at the clearance, within the area.
"""

from __future__ import annotations

import math

from planner.geometry.course import Course
from planner.geometry.curves import Pose, Segment, along, on_loiter
from planner.interface import FloatArray, MapView, Mission, Plan, PlanRequest, PlanStatus
from planner.memory import ObstacleMemory
from planner.rolling_window.anytime_search import AnytimeSearch
from planner.rolling_window.barrier import Proof
from planner.rolling_window.commitment import Commitment
from planner.rolling_window.committed_plan import CommittedPlan, PlanMonitor
from planner.rolling_window.config import LEAD_S, RollingWindowConfig
from planner.rolling_window.dead_ends import DeadEnds
from planner.rolling_window.encounters import encounters
from planner.rolling_window.escape import Escapes, left_of, room_m
from planner.rolling_window.evasion import Threats
from planner.rolling_window.explanations import no_way_through
from planner.rolling_window.local_planning import LocalPlanning, Start

BETTER = 0.005
"""A course that still serves is dropped only for one that is shorter by this share of what is left to fly."""

BROKEN_SHARE = 0.99
"""Share of the clearance: something seen nearer than that to a certified turn breaks the certificate."""

SERVED, CUT, PRESSED = (3000.0, 1000.0), (5000.0, 2000.0), (12_000.0, 12_000.0)
"""Work of a search (`planner.rolling_window.window.Tally`) when it begins, and each further time that the planner is
asked: while the plan in effect serves; where it does not; and where no safe one is flown, or something moves. Most are
done at once."""

MOST_EFFORT = 4
"""Searches in vain are repeated with twice the effort each, so many times; then once a turn."""

AGAIN = 3
"""So often all is tried again before a goal is called unreachable for want of room to turn: a way that is narrower may
be seen to be safe from elsewhere on the turn, or at another look."""

KEPT = Plan(PlanStatus.KEPT, "the plan in effect serves")


class RollingWindow:
    """The planner for one flight."""

    def __init__(self, config: RollingWindowConfig, mission: Mission) -> None:
        config = config.resolved(mission)
        assert config.planning_window_m is not None
        assert config.margin_m is not None
        assert config.rolling_step_m is not None
        self._mission = mission
        self._memory = ObstacleMemory(mission.clearance_m)
        self._local = LocalPlanning(
            mission,
            self._memory,
            window_m=config.planning_window_m,
            margin_m=config.margin_m,
            steps=config.steps,
            candidates=config.candidates,
        )
        self._lead_m = mission.ground_speed_mps * (LEAD_S + mission.compute_latency_s)
        self._least_m = self._lead_m + 2.0 * mission.turn_radius_m
        self._commitment = Commitment(mission, self._memory, self._local, self._least_m)
        self._urgent_m = self._least_m + 6.0 * mission.turn_radius_m + 3.0 * mission.ground_speed_mps
        self._proof = Proof(mission, self._memory, self._local.least_keeps_m)
        self._turns_keep_m = mission.clearance_m + mission.turn_radius_m
        self._proof_for_turns = Proof(mission, self._memory, self._turns_keep_m, mission.turn_radius_m)
        self._given_up = Proof(mission, self._memory, self._local.least_keeps_m, with_refused=True)
        self._thinking: AnytimeSearch | None = None
        self._dead_ends = DeadEnds(mission, self._memory)
        self._escapes = Escapes(mission, self._memory, self._local)
        self._turning: CommittedPlan | None = None  # the last plan that was flown into its turn
        self._proposed: CommittedPlan | None = None
        self._effect: CommittedPlan | None = None
        self._searched_at_m = 0.0  # station and number of edge points at the last search
        self._searched_with = 0
        self._gone = 0  # how many points had been let go of when the last search began
        self._threats: Threats | None = None  # while something moves or has just appeared
        self._nearer: CommittedPlan | None = None  # certified, but would come too near to that
        self._least_room_m = BROKEN_SHARE * mission.clearance_m
        self._effort = 0  # grows with every search that was in vain
        self._forgiven = False  # what was given up is, or was, tried again
        self._again = 0  # how often that was where there is no room to turn
        self._refused_at_m = 0.0
        self._watch = PlanMonitor(
            mission,
            keep_m=0.5 * (mission.clearance_m + self._local.path_keeps_m),
            turn_keeps_m=BROKEN_SHARE * mission.clearance_m,
            urgent_m=self._urgent_m,
            lead_m=self._lead_m,
            step_m=config.rolling_step_m,
        )

    def plan(self, request: PlanRequest) -> Plan:
        """Keeps the plan in effect while it serves; rolls the window and searches where it does not."""
        met: list[FloatArray] = []
        if request.seen.moving:
            met = encounters(request, self._mission)
        self._dead_ends.note_change(request.time_s, request.seen)
        fresh = self._memory.take_in(request.seen, met)
        self._local.trail.add(request.position_m)
        self._threats = self._escapes.threats(request)
        if self._proposed is not None:
            self._take_effect(request, self._proposed)
        if self._effect is not None and self._effect.over(request.arc_length_m):
            self._effect = None
        effect = self._effect
        if effect is None:
            self._proof_for_turns.closed(request.position_m)
            return self._roll(request, None, 0.0)
        here = request.arc_length_m
        if effect.holds(here):
            here = on_loiter(effect.path, here)
            self._note_turn(effect, request.seen)
        newly_cut = self._watch.look(effect, here, request.position_m, fresh)
        met_in_time = self._threats is not None and self._met_in_time(effect, here)
        self._watch.broken |= met_in_time
        since_m = request.arc_length_m - self._searched_at_m
        if self._effort == MOST_EFFORT and self._searched_with == self._memory.known:
            due = since_m >= math.tau * self._mission.turn_radius_m
        else:
            due = self._watch.due(effect, here, since_m, newly_cut) or met_in_time
        if self._thinking is None and not due:
            return KEPT
        self._searched_at_m = request.arc_length_m
        return self._roll(request, effect, here)

    def _met_in_time(self, effect: CommittedPlan, here: float) -> bool:
        """Whether the plan in effect would come too near to what moves or has just appeared."""
        left = left_of(effect, here, self._mission)
        return room_m(left, self._threats, self._least_room_m) < self._least_room_m

    def _take_effect(self, request: PlanRequest, proposed: CommittedPlan) -> None:
        """Begins to watch what was proposed last, if it is flown now."""
        if request.flown is proposed.plan:
            self._effect, self._proposed = proposed, None
            self._watch.begin(proposed, self._memory.standing_m, self._memory.gone - self._gone)
            self._searched_at_m = self._refused_at_m = 0.0

    def _roll(self, request: PlanRequest, effect: CommittedPlan | None, here: float) -> Plan:
        """One rolling step: search, certify, compare with the plan in effect."""
        start, self._nearer = self._start(request, effect, here), None
        ahead = None if effect is None or effect.holds(here) else effect.course.ahead(here)
        serves = ahead is not None and math.isinf(self._watch.cut_m) and not self._watch.broken
        known = self._memory.known
        whole = ahead is not None and ahead.to_goal and ahead.nodes[-1] == self._mission.goal_m
        worth_m = ahead.path.length_m * (1.0 - BETTER) if ahead is not None and whole else math.inf
        if ahead is not None and serves and (ahead.shortest or known == self._searched_with):
            self._thinking = None
        else:
            thinking, begins = self._thinking, self._thinking is None
            if thinking is None:
                self._gone = self._memory.gone
                thinking = self._thinking = AnytimeSearch(
                    self._local,
                    known,
                    self._effort,
                    lambda: self._proof.closed(request.position_m),
                    roomy=self._forgiven,
                )
            hurried = self._pressed(effect, here) or len(request.seen.moving) > 0
            work = PRESSED if hurried else SERVED if serves else CUT
            nearer_m = -math.inf
            for course in thinking.courses(start, ahead, work[0 if begins else 1]):
                if tuple(course.path.segments[0, :2]) != tuple(start.prefix[0][:2]):
                    raise RuntimeError(f"a course begins elsewhere than at {start.prefix[0][:2]}")
                if serves and course.path.length_m > worth_m:
                    thinking.done = True
                    break
                found = self._commitment.effect(request, start, course, thinking.tracks, self._cut_m(course))
                if found is not None and self._commitment.leads_on(found):
                    keeps_m = room_m(found.path, self._threats)
                    if keeps_m >= self._mission.clearance_m:
                        self._thinking, self._searched_with, self._effort = None, thinking.known, 0
                        before_m = -math.inf if ahead is None else ahead.path.length_m
                        self._watch.lengthened_m = course.path.length_m - before_m
                        self._proposed = found
                        return found.plan
                    if keeps_m > nearer_m:  # what moves may come to what is free now
                        nearer_m, self._nearer = keeps_m, found
                thinking.stuck = thinking.stuck or course
            if thinking.done:
                self._thinking, self._searched_with = None, thinking.known
            if not serves:
                return self._no_way(request, effect, here, thinking)
        assert ahead is not None
        assert effect is not None
        wants_more_time = self._thinking is not None
        longer = None
        if request.scanned:
            longer = self._commitment.effect(request, start, ahead, [], self._cut_m(ahead), wants_more_time)
        if (
            longer is not None
            and longer.loiter_entry_m > effect.loiter_entry_m - here + 0.5 * self._lead_m
            and room_m(longer.path, self._threats) >= self._mission.clearance_m
        ):
            self._proposed = longer
            return longer.plan
        return Plan(
            PlanStatus.NO_BETTER,
            "the plan in effect serves as well as any other",
            wants_more_time=wants_more_time,
        )

    def _pressed(self, effect: CommittedPlan | None, here: float) -> bool:
        """Whether there is no safe plan in effect to think on."""
        near_m = 0.0 if effect is None else min(self._watch.cut_m, effect.loiter_entry_m) - here
        return effect is None or (self._watch.broken and near_m < self._urgent_m)

    def _cut_m(self, course: Course) -> float:
        """Station at which a course comes too near to an edge that it was not found with."""
        return self._watch.cut_at(course, self._memory.standing_m, self._memory.gone - self._gone)

    def _start(self, request: PlanRequest, effect: CommittedPlan | None, here: float) -> Start:
        """Where a new plan begins: a little ahead, on the one in effect or straight on from the aircraft."""
        prefix: list[Segment] = [(*request.position_m, *request.direction, 0.0, self._lead_m)]
        if effect is not None:
            uncut_m = math.inf if effect.holds(here) else max(0.0, self._watch.cut_m - here)
            near_m = self._mission.off_path_m
            pose = Pose(*request.position_m, *request.direction)
            prefix = effect.onward_from(pose, here, min(self._lead_m, uncut_m), near_m) or prefix
        last = prefix[-1]
        return Start(request.position_m, along(last, last[5]), last[4], prefix)

    def _no_way(
        self, request: PlanRequest, effect: CommittedPlan | None, here: float, thinking: AnytimeSearch | None
    ) -> Plan:
        """No new plan yet: think on, prove that there is none, or let the plan in effect end in its turn."""
        waits = thinking is not None and not thinking.done and not self._pressed(effect, here)
        if self._watch.broken and effect is not None and not waits:
            return self._turn_away(request, effect, here)
        away = None if effect is not None else self._turn_away(request, None, here)
        if away is not None and away.status is PlanStatus.FOUND:
            return away  # what is closed is told from a safe turn
        # Where edges come and go meanwhile, what was given up may yet be entered.
        in_vain = 1 if self._memory.gone == self._gone else MOST_EFFORT
        only_given_up = len(self._memory.refused_m) > 0 and self._given_up.closed(request.position_m)
        tried = self._effort >= in_vain or (only_given_up and self._forgiven)
        no_room = tried and self._proof_for_turns.closed(request.position_m)
        if thinking is not None and not thinking.done and effect is not None:
            return Plan(PlanStatus.NO_PATH, "thinking on; the plan in effect goes on", wants_more_time=True)
        stuck = None if thinking is None else thinking.stuck
        settled = self._dead_ends.unrest.settled(request.time_s)
        if stuck is None and settled and self._proof.closed(request.position_m):
            gap = 2.0 * self._local.least_keeps_m
            return Plan(PlanStatus.UNREACHABLE, no_way_through(f"no gap in it is wider than {gap:.0f} m"))
        if effect is None:
            assert away is not None
            return away
        since_m = request.arc_length_m - max(effect.loiter_entry_m, self._refused_at_m)
        turned = since_m > math.tau * self._mission.turn_radius_m
        if stuck is not None and turned:
            # The whole turn has shown nothing more: what lies ahead there cannot be entered.
            self._refused_at_m = request.arc_length_m
            self._dead_ends.give_up(self._commitment.unseen(stuck, request.seen))
        if stuck is None and thinking is not None:
            # What moved may have closed it; where edges were only taken back, to try it again once tells.
            doubtful = self._dead_ends.unrest.ever or (self._memory.taken_back and not self._forgiven)
            narrow = no_room and settled and not (doubtful and len(self._memory.refused_m))
            if narrow and self._again == AGAIN:
                told = (
                    f"no gap in it has room to turn ({2.0 * self._turns_keep_m:.0f} m) or is seen to lead on"
                )
                return Plan(PlanStatus.UNREACHABLE, no_way_through(told))
            self._again += narrow
            # No way is left but those given up, or one that takes more looking for. Or none that can be flown
            # from here: elsewhere on the turn there may be one.
            at_end = only_given_up or self._effort == MOST_EFFORT
            if narrow or (at_end and (turned or not thinking.tracks)):
                self._refused_at_m = request.arc_length_m
                self._memory.forgive()
                self._forgiven = True
            self._effort = 0 if narrow else min(self._effort + 1, MOST_EFFORT)
        return Plan(PlanStatus.NO_PATH, "no way on can be seen to be safe; the plan in effect goes on")

    def _certain(self) -> bool:
        """Whether all that was seen still stands, and nothing has come to what was free."""
        return not (self._memory.taken_back or self._dead_ends.unrest.ever)

    def _note_turn(self, effect: CommittedPlan, seen: MapView) -> None:
        """Gives up the place that a course could not be seen to enter, if it is the same again."""
        if effect is self._turning or not effect.course.to_goal:
            return
        self._turning = effect
        place = self._commitment.unseen(effect.course, seen)
        if self._dead_ends.turned_before(place[:2]):
            self._dead_ends.give_up(place)

    def _turn_away(self, request: PlanRequest, effect: CommittedPlan | None, here: float) -> Plan:
        """An answer where nothing is certified."""
        if effect is None:
            escape = self._escapes.at_start(request, self._threats, self._lead_m)
        else:
            escape = self._escapes.from_plan(
                request,
                self._threats,
                effect,
                here,
                until_m=min(self._watch.cut_m, effect.loiter_entry_m),
                prefix=self._start(request, effect, here).prefix,
                certain=self._certain(),
                nearer=self._nearer,
            )
        self._watch.broken = escape.broken
        self._proposed = escape.effect or self._proposed
        return escape.plan
