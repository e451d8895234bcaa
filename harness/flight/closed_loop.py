"""The closed loop: sense, map, plan, guide, step. One call a block, every value between them named."""

from __future__ import annotations

import itertools
import math
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from aircraft.guidance.interface import GuidanceLaw, GuidanceOutput, VerticalLaw
from aircraft.guidance.progress import RouteProgress
from aircraft.interface import FlightModel, Route
from harness.files.crash import sentence, trace
from harness.flight.observer import PROGRESS_EVERY_S, Caution, Observer, Progress, RowObserver
from harness.flight.plans import LATE_S, Plans
from harness.flight.record import Flight, Outcome
from harness.flight.signals import held_back
from harness.flight.state_estimator import PerfectEstimator, StateEstimator
from harness.flight.termination import Ending, Termination
from harness.flight.timetable import intervals
from harness.flight.track_log import TrackLog
from harness.mapping.scan import RangeScan
from harness.mapping.sensed_map import SensedMap
from harness.world.range_sensor import RangeSensor
from harness.world.world import World
from planner.interface import Mission, Planner

NOT_STEERED = GuidanceOutput(0.0, math.nan, math.nan, bank_saturated=False, past_end=False)
"""Wings level, on no route: what is commanded before the first plan."""


@dataclass(frozen=True)
class Loop:
    """All parts of one flight, made and joined by `harness.run.scenario_flight`.

    Attributes:
        world: the truth; only sensor, termination and record see it.
        sensor: range sensor; None: nothing is sensed, and the planner is asked at the start alone.
        seen: obstacle map, all that the planner sees.
        planner: planner under test.
        model: aircraft with its inner loops.
        guidance: law that steers the aircraft along the route.
        termination: says when the flight is over.
        mission: goal and limits.
        vertical: says at which altitude and airspeed the aircraft flies.
        scan_rate_hz: scans a second; divides the model's step rate.
        navigator: tells what the aircraft believes of its state.
    """

    world: World
    sensor: RangeSensor | None
    seen: SensedMap
    planner: Planner
    model: FlightModel
    guidance: GuidanceLaw
    termination: Termination
    mission: Mission
    vertical: VerticalLaw
    scan_rate_hz: float
    navigator: StateEstimator = field(default_factory=PerfectEstimator)


def fly(loop: Loop, observers: Sequence[Observer] = (), progress: Progress | None = None) -> Flight:
    """Flies a mission to its end. Ctrl-C is taken between two guidance intervals.

    Args:
        loop: all parts of the flight; used up by it.
        observers: look on.
        progress: told of the flight every few simulated seconds.

    Raises:
        ValueError: the scan rate does not divide the simulation rate.
        RuntimeError: the loop has been flown before.
    """
    next_report_s = 0.0
    with held_back() as interrupt:
        flying = ClosedLoop(loop, observers)
        while flying.verdict is None:
            interrupt()
            if progress is not None and flying.true.time_s >= next_report_s:
                progress(flying.true.time_s, flying.to_go_m, flying.word)
                next_report_s = flying.true.time_s + PROGRESS_EVERY_S
            flying.step()
        if progress is not None:
            progress(flying.true.time_s, flying.to_go_m, flying.word)
        return flying.flight()


class ClosedLoop:
    """One flight, stepped from guidance update to guidance update.

    Guidance and log have one rate, scans have the sensor's. The planner is asked after a scan, and twice a guidance
    interval while it wants more time. A scan or a plan that is late counts from the first of these instants after its
    delay. Time is a count of steps of the flight model.

    Args:
        loop: all parts of the flight; used up by it.
        observers: look on.

    Raises:
        ValueError: the scan rate does not divide the simulation rate.
        RuntimeError: the loop has been flown before.
    """

    def __init__(self, loop: Loop, observers: Sequence[Observer] = ()) -> None:
        self.verdict: Ending | None = None
        """How the flight ended; None while it goes on."""
        self.steering = NOT_STEERED
        """What guidance decided last."""
        self.plans = Plans(loop.planner, loop.mission, loop.seen, observers)
        """What has been planned."""
        self.plans.wants_more_time = loop.sensor is None
        self._loop, self._observers, self._begun_s = loop, observers, time.perf_counter()
        self._log = TrackLog(
            loop.world.clearance,
            [observer.on_block for observer in observers],
            ground=loop.world.ground_heights,
        )
        self._row_observers = [each for each in observers if isinstance(each, RowObserver)]
        self._own_roll_rad: float | None = None
        # Where the true aircraft is on a plan, and on which; only where navigation is not perfect.
        self._measured: RouteProgress | None = None
        self._measured_index = -1
        self._law_error: str | None = None
        self._scans_on_their_way: deque[RangeScan] = deque()
        self._jumps, self._had_fix = 0, True
        scan_rate_hz = loop.scan_rate_hz if loop.sensor else 0.0
        timetable = intervals(loop.model.step_rate_hz, scan_rate_hz)
        self._intervals, self._first_steps = itertools.cycle(timetable), timetable[0][0].steps
        self._locate()
        if self.true.time_s > 0.0:
            raise RuntimeError(
                f"this loop has been flown for {self.true.time_s:g} s already; "
                "every flight needs a loop of its own"
            )
        self._over(loop.termination.verdict(self.true, loop.model.fault()))

    def step(self, roll_command_rad: float | None = None) -> None:
        """Flies one guidance interval, or up to the end of the flight if that comes first.

        Args:
            roll_command_rad: held in place of what the guidance law decides; None: the law steers.
        """
        loop, self._own_roll_rad = self._loop, roll_command_rad
        for instant in next(self._intervals):
            if instant.scan:
                self._sense()
            mapped = self._map()
            planning = mapped or (instant.guidance and self.plans.wants_more_time)
            if planning and self._over(self._plan(mapped)):
                return
            if instant.guidance and self._over(self._guide()):
                return
            if self._over(self._advance(instant.steps)):
                return
            self._locate()
            if self._over(loop.termination.verdict(self.true, loop.model.fault())):
                return

    def _log_row(self) -> None:
        """Logs where the aircraft is and what it was told last."""
        steered = not math.isnan(self.steering.cross_track_m)
        index = self.plans.index if steered else -1  # a law may fail in its first update
        if self.believed is self.true:
            self._log.add(self.true, self.steering, index)
        else:
            self._log.add(self.true, self.steering, index, self.believed, self._true_cross_track_m(index))
        for observer in self._row_observers:
            observer.on_row(self.true, self.steering, index)

    def _locate(self) -> None:
        """Reads the state, and what the aircraft believes of it."""
        self.true = self._loop.model.state()
        """The state at the end of the last step."""
        self.believed = self._loop.navigator.believed(self.true)
        """What the aircraft believes it to be."""
        if self._loop.navigator.jumps != self._jumps:
            self._jump()
        if self._had_fix and not self._loop.navigator.has_fix:
            self._lose_fix()

    def _lose_fix(self) -> None:
        """Tells observers; that a fix is back is told as the jump that comes with it."""
        self._had_fix = False
        at_start = self.true.time_s == 0.0
        told = f"no fix {'at the start' if at_start else 'any more'}: the believed position drifts"
        for observer in self._observers:
            observer.on_event(self.true.time_s, told if at_start else Caution(told))

    def _jump(self) -> None:
        """Forgets the map and scans on their way, all entered from elsewhere, after the believed position has jumped.

        The planner is asked with the next scan, and checks its plan against what that shows.
        """
        self._jumps, self._had_fix = self._loop.navigator.jumps, True
        self._scans_on_their_way.clear()
        self._loop.seen.start_over(self.true.time_s)
        for observer in self._observers:
            observer.on_event(
                self.true.time_s,
                Caution("a fix again: the believed position jumps, the map is forgotten"),
            )

    def _sense(self) -> None:
        """Takes a scan of the true world; the map will have it from where the aircraft believes to be."""
        true, believed, sensor = self.true, self.believed, self._loop.sensor
        assert sensor is not None
        scan = sensor.scan(true.east_m, true.north_m, true.heading_rad, true.time_s)
        for observer in self._observers:
            observer.on_scan(scan, true)
        if believed is not true:
            scan = scan.taken_from(believed.east_m, believed.north_m, believed.heading_rad)
        self._scans_on_their_way.append(scan)

    def _map(self) -> bool:
        """Enters the oldest scan into the map, if it has become available; returns whether one has."""
        scans = self._scans_on_their_way
        if not scans or scans[0].available_s > self.true.time_s + LATE_S:
            return False
        scan = scans.popleft()
        self._loop.seen.update(scan)
        self.plans.scan_s = scan.time_s
        return True

    def _plan(self, mapped: bool) -> Ending | None:
        """Asks the planner; returns how the flight ends, if that is its answer."""
        return self.plans.ask(self.believed, self.steering.arc_length_m, mapped)

    def _guide(self) -> Ending | None:
        """Steers along the plan in effect, and logs where the aircraft is and what it is told."""
        loop, plans, true, believed = self._loop, self.plans, self.true, self.believed
        verdict = plans.take_effect(believed, loop.guidance) or self._steer()
        if verdict is not None:
            return verdict
        altitude_m, airspeed_mps = loop.vertical.command(believed, self.steering.arc_length_m)
        loop.model.command(
            self.steering.roll_command_rad,
            # The model holds true values: what it is believed to be off is what it will be off.
            altitude_m + (true.up_m - believed.up_m),
            self.steering.airspeed_or(airspeed_mps) + (true.airspeed_mps - believed.airspeed_mps),
        )
        self._log_row()
        return None

    def _steer(self) -> Ending | None:
        """Asks the guidance law, if there is a plan; it may raise anything, which ends the flight."""
        if self.plans.index >= 0:
            try:
                steering = self._loop.guidance.update(self.believed)
                numbers = steering.roll_command_rad, steering.cross_track_m, steering.arc_length_m
                finite = all(map(math.isfinite, numbers)) and not math.isinf(steering.airspeed_mps)
            except Exception as error:
                self._law_error = trace(error)
                return Ending(Outcome.LOST_CONTROL, f"the guidance law raised {sentence(error)}")
            if not finite:
                return Ending(
                    Outcome.LOST_CONTROL,
                    f"the guidance law asked for a roll of {steering.roll_command_rad} rad and an airspeed of "
                    f"{steering.airspeed_mps} m/s, {steering.cross_track_m} m beside its route after "
                    f"{steering.arc_length_m} m; all must be finite, the airspeed finite or NaN",
                )
            self.steering = steering
        if self._own_roll_rad is not None:
            self.steering = self.steering._replace(roll_command_rad=self._own_roll_rad)
        return None

    def _true_cross_track_m(self, index: int) -> float:
        """Distance of the true position from the plan of an index; NaN before the first."""
        if index < 0:
            return math.nan
        if index != self._measured_index:
            plan, self._measured_index = self.plans.accepted[index], index
            self._measured = RouteProgress(Route(plan.segments, plan.loiter), self.steering.arc_length_m)
        if self._measured is None:
            return math.nan
        return self._measured.nearest(self.true.east_m, self.true.north_m).cross_track_m

    def _advance(self, steps: int) -> Ending | None:
        """Flies on; a planner that wants more time is asked again half way, and may end the flight there."""
        model = self._loop.model
        if self.plans.wants_more_time:
            model.advance(steps // 2)
            self._locate()
            verdict = self._plan(mapped=False)
            if verdict is not None:
                return verdict
            steps -= steps // 2
        model.advance(steps)
        return None

    def _over(self, verdict: Ending | None) -> bool:
        """Ends the flight if there is a verdict; returns whether it is over."""
        if verdict is None:
            return False
        if self.true.time_s == 0.0:  # a track begins before it ends
            self._log_row()
            self._loop.model.advance(self._first_steps)
            self._locate()
        if verdict.outcome is not Outcome.LOST_CONTROL:
            self._steer()  # the last row is of the end of the flight, not of the update before
        self._log_row()
        self.verdict = Ending(verdict.outcome, verdict.reason + self.plans.last_word(verdict.outcome))
        told = f"{self.verdict.outcome.value}: {self.verdict.reason}"
        for observer in self._observers:
            observer.on_event(self.true.time_s, told if verdict.outcome is Outcome.REACHED else Caution(told))
        return True

    @property
    def to_go_m(self) -> float:
        """Distance that is left to the goal."""
        return self._loop.termination.to_go_m(self.true)

    @property
    def word(self) -> str:
        """One word for people: how the flight goes, or how it ended."""
        return self.plans.state if self.verdict is None else self.verdict.outcome.value

    def flight(self) -> Flight:
        """The flight, once it is over.

        Raises:
            RuntimeError: it is not over.
        """
        if self.verdict is None:
            raise RuntimeError(f"the flight is not over; it has come to {self.true.time_s:g} s")
        return Flight(
            self._log.close(),
            tuple(self.plans.accepted),
            *self.verdict,
            tuple(self.plans.compute_ms),
            sim_s=self.true.time_s,
            wall_s=time.perf_counter() - self._begun_s,
            error=self.plans.error or self._law_error,
            contact_m=self._loop.termination.contact_m,
            lost_returns=self._loop.sensor.lost_returns() if self._loop.sensor else None,
        )
