"""The closed loop: sense, map, plan, guide, step. One call a block, every value between them named."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from aircraft.guidance.altitude import Vertical
from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLaw, GuidanceOutput
from aircraft.guidance.progress import measures_itself
from aircraft.interface import FlightModel
from harness.files.errors import printing_aside, sentence, trace
from harness.flight.navigation import StateEstimator
from harness.flight.observer import PROGRESS_EVERY_S, Caution, Observer, Progress, RowObserver
from harness.flight.plans import Plans
from harness.flight.position_errors import CrossTrack, FixEvents
from harness.flight.record import Flight, Outcome
from harness.flight.sensing import Sensing
from harness.flight.signals import held_back
from harness.flight.termination import Ending, Termination
from harness.flight.timetable import intervals
from harness.flight.track_log import TrackLog
from harness.mapping.sensed_map import SensedMap
from harness.world.range_sensor import RangeSensor
from harness.world.world import World
from planner.interface import Mission, Planner

NOT_STEERED = GuidanceOutput(0.0, math.nan, math.nan, bank_saturated=False, past_end=False)
"""Wings level and no route, which is commanded before the first plan."""


@dataclass(frozen=True)
class Loop:
    """All parts of one flight, made and joined by `harness.run.scenario_flight`.

    Attributes:
        world: the truth; only sensor, termination and record see it.
        sensor: None: nothing is sensed, and the planner is asked at the start alone.
        seen: obstacle map, all that the planner sees.
        model: aircraft with its inner loops.
        vertical: says at which altitude and airspeed the aircraft flies.
        scan_rate_hz: scans a second; divides the model's step rate.
    """

    world: World
    sensor: RangeSensor | None
    seen: SensedMap
    planner: Planner
    model: FlightModel
    guidance: GuidanceLaw
    termination: Termination
    mission: Mission
    vertical: Vertical
    scan_rate_hz: float
    navigator: StateEstimator = field(default_factory=StateEstimator)


def fly(loop: Loop, observers: Sequence[Observer] = (), progress: Progress | None = None) -> Flight:
    """Flies a mission to its end. Ctrl-C is taken between two guidance intervals.

    The loop is used up by it. `progress` is called every `PROGRESS_EVERY_S` of simulated time. What planner and law
    print goes to standard error.

    Raises KeyboardInterrupt after Ctrl-C, when the observers have all rows up to it, and what `ClosedLoop` does.
    """
    next_report_s = 0.0
    with held_back() as interrupt, printing_aside():
        flying = ClosedLoop(loop, observers)
        try:
            while flying.ending is None:
                interrupt()
                if progress is not None and flying.true.time_s >= next_report_s:
                    progress(flying.true.time_s, flying.to_go_m, flying.status_label)
                    next_report_s = flying.true.time_s + PROGRESS_EVERY_S
                flying.step()
        except KeyboardInterrupt:
            flying.flush_rows()
            raise
        if progress is not None:
            progress(flying.true.time_s, flying.to_go_m, flying.status_label)
        return flying.flight()


class ClosedLoop:
    """One flight, stepped from guidance update to guidance update.

    Guidance and log have one rate, scans have the sensor's. The planner is asked after a scan, and twice a guidance
    interval while it wants more time. A scan or a plan that is late counts from the first of these instants after its
    delay. Time is a count of steps of the flight model. The loop is used up by the flight.

    Raises ValueError if the scan rate does not divide the simulation's, RuntimeError if the loop was flown before.
    """

    def __init__(self, loop: Loop, observers: Sequence[Observer] = ()) -> None:
        self.ending: Ending | None = None  # how the flight ended; None while it goes on
        self.steering = NOT_STEERED  # the latest output of the guidance law
        self.plans = Plans(loop.planner, loop.mission, loop.seen, observers)
        """The plan in effect, the one that is computed, and all before."""
        self.plans.wants_more_time = loop.sensor is None
        self.true = loop.model.state()  # the true state at the end of the last step
        self.believed = loop.navigator.believed(self.true)  # the same state as navigation estimates it
        if self.true.time_s > 0.0:
            raise RuntimeError(
                f"this loop has been flown for {self.true.time_s:g} s already; every flight needs a loop of its own"
            )
        self._loop, self._observers, self._begun_s = loop, observers, time.perf_counter()
        self._model, self._navigator, self._guidance = loop.model, loop.navigator, loop.guidance
        self._sensing = Sensing(loop.sensor, loop.seen, observers)
        self._fixes = FixEvents(loop.navigator, observers)
        self._true_error, self._believed_error = CrossTrack(self.plans), CrossTrack(self.plans)
        self._law_measures = measures_itself(loop.guidance)
        self._hold_airspeed = getattr(loop.guidance, "hold_airspeed", lambda airspeed_mps: None)
        self._log = TrackLog(
            loop.world.clearance,
            [each.on_block for each in observers],
            ground=loop.world.ground_heights,
            row_sinks=[each.on_row for each in observers if isinstance(each, RowObserver)],
        )
        self._roll_override_rad: float | None = None
        self._law_error: str | None = None
        timetable = intervals(loop.model.step_rate_hz, loop.scan_rate_hz if loop.sensor else 0.0)
        self._intervals, self._first_steps = itertools.cycle(timetable), timetable[0][0].steps
        self._check_navigation()
        self._verdict = loop.termination.verdict
        if (ending := self._verdict(self.true, self._model.fault())) is not None:
            self._finish(ending)

    def step(self, roll_command_rad: float | None = None) -> None:
        """Flies one guidance interval, or up to the end of the flight; a roll command is held in place of the law's."""
        self._roll_override_rad = roll_command_rad
        for guidance, scan, steps, half in next(self._intervals):
            if scan:
                self._sensing.scan(self.true, self.believed)
            if (entered := self._sensing.enter(self.true.time_s)) is not None:
                self.plans.scan_s = entered.time_s
            ending, scanned = None, entered is not None
            if scanned or ((guidance or half == 0) and self.plans.wants_more_time):
                ending = self.plans.ask(self.believed, self._arc_length_m(), scanned)
            if guidance and ending is None:
                ending = self._guide()
            if ending is None:
                ending = self._advance(steps, half)
            if ending is not None:
                self._finish(ending)
                return

    def _arc_length_m(self) -> float:
        """Returns the distance along the plan as of the last steering; where plans come later than the next, of now."""
        plans = self.plans
        if plans.index < 0 or self._loop.mission.compute_latency_s <= 1.0 / UPDATE_RATE_HZ:
            return self.steering.arc_length_m
        return self._believed_error.place(self.believed, plans.entered_m, plans.index).arc_length_m

    def _read_state(self) -> None:
        self.true = self._model.state()
        self.believed = self._navigator.believed(self.true)
        if self.believed is not self.true:
            self._check_navigation()

    def _check_navigation(self) -> None:
        """Forgets the map if the believed position has jumped, since the map was entered from elsewhere.

        The planner is asked with the next scan, and checks its plan against what that shows.
        """
        if self._fixes.jumped(self.true.time_s):
            self._sensing.start_over(self.true.time_s)

    def _guide(self) -> Ending | None:
        """Takes up a plan that is due, steers along the one in effect, logs a row; returns an ending if a law fails."""
        believed = self.believed
        ending = self.plans.take_effect(believed, self._guidance) if self.plans.coming else None
        if (ending := ending or self._steer()) is not None:
            return ending
        steering = self.steering
        altitude_m, airspeed_mps = self._loop.vertical(believed, steering.arc_length_m)
        try:
            self._hold_airspeed(airspeed_mps)
        except (Exception, SystemExit) as error:
            return self._law_raised(error)
        too_high_m, too_fast_mps = self._navigator.held_errors
        self._model.command(
            steering.roll_command_rad,
            # The model's loops measure without error: it is taken off the command.
            altitude_m - too_high_m,
            steering.airspeed_or(airspeed_mps) - too_fast_mps,
        )
        if math.isclose(steering.airspeed_mps, airspeed_mps):  # a path may want another than is held
            self.steering = steering._replace(airspeed_mps=math.nan)
        self._log_row()
        return None

    def _steer(self) -> Ending | None:
        """Updates the guidance law, if there is a plan; an exception or a number that is not finite ends the flight."""
        if self.plans.index >= 0:
            try:
                steering = self._guidance.update(self.believed)
                if not isinstance(steering, GuidanceOutput):
                    raise TypeError(f"update(state) gave {steering!r:.80}; must give a GuidanceOutput")
                numbers = steering.roll_command_rad + steering.cross_track_m + steering.arc_length_m
                finite = math.isfinite(numbers) and not math.isinf(steering.airspeed_mps)
            except (Exception, SystemExit) as error:
                return self._law_raised(error)
            if not finite:
                return Ending(
                    Outcome.LOST_CONTROL,
                    f"the guidance law asked for a roll of {steering.roll_command_rad} rad and an airspeed of "
                    f"{steering.airspeed_mps} m/s, {steering.cross_track_m} m beside its route after "
                    f"{steering.arc_length_m} m; all must be finite, the airspeed finite or NaN",
                )
            believed, plans, measured = self.believed, self.plans, self._believed_error
            if not self._law_measures:  # a law that comes from elsewhere is not asked how well it flies
                place = measured.place(believed, plans.entered_m, plans.index)
                steering = steering._replace(cross_track_m=place.off_m, arc_length_m=place.arc_length_m)
            if steering.arc_length_m == 0.0:  # at its start or before
                off_m = measured.off_m(believed, plans.index, 0.0, steering.cross_track_m)
                steering = steering._replace(cross_track_m=off_m)
            self.steering = steering
        if self._roll_override_rad is not None:
            self.steering = self.steering._replace(roll_command_rad=self._roll_override_rad)
        return None

    def _law_raised(self, error: BaseException) -> Ending:
        self._law_error = trace(error)
        return Ending(Outcome.LOST_CONTROL, f"the guidance law raised {sentence(error)}")

    def _advance(self, steps: int, half: int) -> Ending | None:
        """Advances and judges the flight, after `half` asking a planner that wants more time; either may end it."""
        if self.plans.wants_more_time and 0 < half < steps:
            self._model.advance(half)
            steps -= half
            self._read_state()
            ending = self.plans.ask(self.believed, self._arc_length_m(), scanned=False)
            if ending is not None:
                return ending
        self._model.advance(steps)
        self._read_state()
        return self._verdict(self.true, self._model.fault())

    def _log_row(self) -> None:
        true, steering = self.true, self.steering
        steered = not math.isnan(steering.cross_track_m)
        index = self.plans.index if steered else -1  # a law may fail in its first update
        if self.believed is true:
            self._log.add(true, steering, index)
        else:
            self._log.add(true, steering, index, self.believed, self._true_error.of(true, index))

    def _finish(self, ending: Ending) -> None:
        """Logs the last row, sets the ending and tells the observers."""
        if self.true.time_s == 0.0:  # a track has at least two rows
            self._log_row()
            self._model.advance(self._first_steps)
            self._read_state()
        if ending.outcome is not Outcome.LOST_CONTROL:
            self._steer()  # so that the last row has the steering at the end
        self._log_row()
        self.ending = Ending(ending.outcome, ending.reason + self.plans.failure_suffix(ending.outcome))
        text = f"{self.ending.outcome.value}: {self.ending.reason}"
        for observer in self._observers:
            observer.on_event(self.true.time_s, text if ending.outcome is Outcome.REACHED else Caution(text))

    def flush_rows(self) -> None:
        """Hands the rows since the last block on to the observers."""
        self._log.flush_rows()

    @property
    def to_go_m(self) -> float:
        """Distance that is left to the goal."""
        return self._loop.termination.to_go_m(self.true)

    @property
    def status_label(self) -> str:
        """The state of the flight in one word: waiting, following, holding, or its outcome."""
        return self.plans.status_label if self.ending is None else self.ending.outcome.value

    def flight(self) -> Flight:
        """The flight, once it is over; before that, `RuntimeError`."""
        if self.ending is None:
            raise RuntimeError(f"the flight is not over; it has come to {self.true.time_s:g} s")
        return Flight(
            self._log.close(),
            tuple(self.plans.accepted),
            *self.ending,
            tuple(self.plans.compute_ms),
            sim_s=self.true.time_s,
            wall_s=time.perf_counter() - self._begun_s,
            error=self.plans.error or self._law_error,
            contact_m=self._loop.termination.contact_m,
            compute_wall_ms=tuple(self.plans.compute_wall_ms),
            shield=self.plans.shield(self.true.time_s),
        )
