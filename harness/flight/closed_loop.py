"""The closed loop: world, sensor, map, planner, route, guidance, flight model, record. One call a block."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLaw
from aircraft.interface import AircraftState, FlightModel, Route
from aircraft.route import route_length
from harness.files.crash import in_a_line, sentence, trace
from harness.flight.asked_planner import AskedPlanner, PlannerFailedError
from harness.flight.record import AcceptedPlan, Flight, Outcome, Track, TrackLog
from harness.flight.signals import held_back
from harness.flight.termination import Termination
from harness.mapping.scan import RangeScan
from harness.mapping.sensed_map import SensedMap
from harness.world.range_sensor import RangeSensor
from harness.world.world import World
from planner.interface import Mission, Plan, Planner, PlanRequest, PlanStatus

PROGRESS_EVERY_S = 5.0

Progress = Callable[[float, float, str], None]
"""Called with simulated time (s), distance to go (m) and a word on the state."""


class Observer(Protocol):
    """What may look on while the loop runs. Nothing that it does reaches the loop."""

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """A scan was taken."""
        ...

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        """A plan takes effect."""
        ...

    def on_block(self, block: Track) -> None:
        """Some hundred more rows of the track."""
        ...

    def on_event(self, time_s: float, text: str) -> None:
        """Something worth a line in the log."""
        ...


@dataclass(frozen=True)
class Loop:
    """All parts of one flight, made and joined by `harness.run.scenario_flight`.

    Attributes:
        world: the truth; only sensor, contact and record see it.
        sensor: range sensor.
        seen: obstacle map, all that the planner sees.
        planner: planner under test.
        model: aircraft with its inner loops.
        guidance: law that steers the aircraft along the route.
        mission: goal and limits.
        altitude_m: altitude held, above mean sea level.
        time_limit_s: simulated.
        scan_rate_hz: scans a second; divides the model's step rate.
    """

    world: World
    sensor: RangeSensor
    seen: SensedMap
    planner: Planner
    model: FlightModel
    guidance: GuidanceLaw
    mission: Mission
    altitude_m: float
    time_limit_s: float
    scan_rate_hz: float


def fly(loop: Loop, observers: Sequence[Observer] = (), progress: Progress | None = None) -> Flight:
    """Flies a mission to its end.

    Everything happens at whole steps of the flight model: guidance and log at one rate, a scan at the
    sensor's. The planner is asked after a scan, and twice a step of guidance while it goes on. A scan or a plan
    that is late takes effect at the first of these steps after its delay. Time is a count of steps. Ctrl-C is
    taken between two of these.

    Args:
        loop: all parts of the flight; used up by it.
        observers: look on.
        progress: told of the flight every few simulated seconds.

    Raises:
        ValueError: the scan rate does not divide the simulation rate.
    """
    with held_back() as interrupt:
        return _flown(loop, observers, progress, interrupt)


def _flown(
    loop: Loop, observers: Sequence[Observer], progress: Progress | None, interrupt: Callable[[], None]
) -> Flight:
    begun = time.perf_counter()
    model, guidance, seen, mission = loop.model, loop.guidance, loop.seen, loop.mission
    strides, at = _strides(model.step_rate_hz, loop.scan_rate_hz), 0
    log = TrackLog(
        loop.world.clearance, [observer.on_block for observer in observers], ground=loop.world.ground_heights
    )
    plans = _Plans(loop, observers)
    judge = Termination(loop.world, mission, loop.time_limit_s, model.fault)
    late: deque[RangeScan] = deque()
    station, next_report = math.nan, math.inf if progress is None else 0.0
    airspeed_mps = mission.speed_mps
    model.command(0.0, loop.altitude_m, airspeed_mps)
    while True:
        interrupt()
        scan_due, tick, steps = strides[at % len(strides)]
        state = model.state()
        verdict = judge.verdict(state)
        if verdict is not None:
            break
        if scan_due:
            scan = loop.sensor.scan(state.east_m, state.north_m, state.heading_rad, state.time_s)
            late.append(scan)
            for observer in observers:
                observer.on_scan(scan, state)
        scanned = bool(late) and late[0].available_s <= state.time_s + 1e-9
        if scanned:
            seen.update(late.popleft())
        if scanned or (tick and plans.go_on):
            verdict = plans.ask(state, station, scanned)
            if verdict is not None:
                break
        if tick:
            if plans.due_s <= state.time_s:
                plans.take_effect(state, station)
            if plans.index >= 0:
                try:
                    output = guidance.update(state)
                except Exception as error:  # a law of somebody else's may raise anything
                    plans.error = trace(error)
                    verdict = Outcome.LOST_CONTROL, f"the guidance law raised {sentence(error)}"
                    break
                log.commanded = output.roll_command_rad, output.cross_track_m, output.arc_length_m
                airspeed_mps = output.airspeed_or(mission.speed_mps)
            roll_command, cross_track, station = log.commanded
            model.command(roll_command, loop.altitude_m, airspeed_mps)
            log.add(state, roll_command, cross_track, station, plans.index)
            if progress is not None and state.time_s >= next_report:
                progress(state.time_s, judge.to_go_m(state), plans.state)
                next_report = state.time_s + PROGRESS_EVERY_S
        if plans.go_on:
            model.advance(steps // 2)
            state = model.state()
            verdict = plans.ask(state, station, scanned=False)
            if verdict is not None:
                break
            steps -= steps // 2
        model.advance(steps)
        at += 1
    if state.time_s == 0.0:  # a track begins before it ends
        log.add(state, *log.commanded, plans.index)
        model.advance(steps)
        state = model.state()
    log.add(state, *log.commanded, plans.index)
    outcome, reason = verdict
    reason += plans.last_word(outcome)
    if progress is not None:
        progress(state.time_s, judge.to_go_m(state), outcome.value)
    for observer in observers:
        observer.on_event(state.time_s, f"{outcome.value}: {reason}")
    return Flight(
        log.close(),
        tuple(plans.accepted),
        outcome,
        reason,
        tuple(plans.compute_ms),
        sim_s=state.time_s,
        wall_s=time.perf_counter() - begun,
        error=plans.error,
        contact_m=judge.contact_m,
    )


def _strides(step_rate_hz: int, scan_rate_hz: float) -> list[tuple[bool, bool, int]]:
    """What happens at a step (scan, tick of guidance and log), and how many steps of the model come after it.

    One tuple for every step at which something happens, until all of it begins again.
    """
    scan = _whole(step_rate_hz, scan_rate_hz, "scan")
    tick = _whole(step_rate_hz, UPDATE_RATE_HZ, "guidance")
    happens = sorted({step for stride in (scan, tick) for step in range(0, math.lcm(scan, tick) + 1, stride)})
    return [(step % scan == 0, step % tick == 0, after - step) for step, after in pairwise(happens)]


def _whole(step_rate_hz: int, rate_hz: float, name: str) -> int:
    steps = round(step_rate_hz / rate_hz)
    if steps < 1 or abs(steps * rate_hz - step_rate_hz) > 1e-9 * step_rate_hz:
        raise ValueError(
            f"the {name} rate {rate_hz:g} Hz does not divide the simulation rate {step_rate_hz} Hz"
        )
    return steps


class _Plans:
    """What has been planned: the plan in effect, the one on its way, and all before."""

    def __init__(self, loop: Loop, observers: Sequence[Observer]) -> None:
        self._loop, self._observers = loop, observers
        self._planner, self._seen = AskedPlanner(loop.planner, loop.mission, loop.seen), loop.seen
        self._coming: tuple[float, Plan, Route] | None = None
        self.due_s = math.inf
        """When the plan on its way takes effect."""
        self.index = -1
        """Index of the plan in effect, -1 before the first."""
        self.go_on = False
        """The planner is to be asked again before the next scan."""
        self._told, self._scanned = "", False
        self._in_vain: set[str] = set()  # all that was told of why nothing was found since the last plan
        self._stuck = ""  # the last of it
        self._station, self._turns_at = 0.0, math.inf
        self.accepted: list[AcceptedPlan] = []
        self.compute_ms: list[float] = []
        self.error: str | None = None
        """The traceback of what the planner raised."""

    @property
    def state(self) -> str:
        """One word for people."""
        return (
            "waiting" if not self.accepted else "holding" if self._station > self._turns_at else "following"
        )

    def last_word(self, outcome: Outcome) -> str:
        """What the planner has to say of an end that is not its own: why it never, or no longer, found anything."""
        if outcome in (Outcome.PLANNER_FAILED, Outcome.UNREACHABLE):
            return ""
        if not (self.accepted or self._coming) and self._told:
            return f"; no plan was ever found: {in_a_line(self._told)}"
        if outcome is Outcome.TIMEOUT and self._stuck:
            return f"; the planner's last word: {in_a_line(self._stuck)}"
        return ""

    def ask(self, state: AircraftState, arc_length_m: float, scanned: bool) -> tuple[Outcome, str] | None:
        """Asks the planner, unless it is still at work; returns how the flight ends if that is its answer."""
        self._scanned |= scanned
        if self._coming is not None:
            return None
        self._station = arc_length_m
        flown = self.accepted[-1].plan if self.accepted else None
        speed = max(state.groundspeed_mps, 1e-9)
        # At once: the constructor of a NamedTuple takes twice as long.
        request = tuple.__new__(
            PlanRequest,
            (
                state.time_s,
                (state.east_m, state.north_m),
                (state.velocity_east_mps / speed, state.velocity_north_mps / speed),
                self._seen,
                flown,
                arc_length_m if flown else 0.0,
                self._scanned,
            ),
        )
        self._scanned = False
        try:
            plan = self._planner.plan(request)
        except PlannerFailedError as error:
            self.error = error.trace
            return Outcome.PLANNER_FAILED, str(error)
        compute_ms = self._planner.compute_ms
        self._told = plan.reason
        self.go_on = plan.wants_more_time
        if plan.status is PlanStatus.KEPT:
            return None
        self.compute_ms.append(compute_ms)
        if plan.status is PlanStatus.UNREACHABLE and state.time_s > 0.0:  # a track begins before it ends
            return Outcome.UNREACHABLE, in_a_line(plan.reason)
        if plan.status is PlanStatus.NO_PATH:
            self._stuck = plan.reason
            if plan.reason not in self._in_vain:
                self._in_vain.add(plan.reason)
                for observer in self._observers:
                    observer.on_event(state.time_s, plan.reason)
        if plan.status is PlanStatus.FOUND:
            self._stuck, self._in_vain = "", set()
            assert plan.path is not None
            route = Route(plan.path.segments, plan.path.loiter)
            self._coming = (compute_ms, plan, route)
            self.due_s = state.time_s + self._loop.mission.compute_latency_s - 1e-9
        return None

    def take_effect(self, state: AircraftState, arc_length_m: float) -> None:
        """Hands the coming plan, now due, to the guidance."""
        assert self._coming is not None
        compute_ms, plan, route = self._coming
        late = state.time_s - (self.due_s - self._loop.mission.compute_latency_s)
        self._coming, self.due_s = None, math.inf
        self._loop.guidance.follow(route, arc_length_m=late * state.groundspeed_mps)
        accepted = AcceptedPlan(len(self.accepted), state.time_s, compute_ms, plan)
        self.accepted.append(accepted)
        self.index = accepted.plan_index
        turn = float(route.segments[-1, 5]) if route.loiter else -math.inf
        self._station, self._turns_at = 0.0, route_length(route) - turn
        for observer in self._observers:
            observer.on_plan(accepted, state)
