"""Flights that are stepped from outside: `reset`, then `step` until done. What learning and live views are built on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from aircraft.interface import AircraftState
from harness.flight.closed_loop import ClosedLoop, Loop
from harness.flight.observer import Observer
from harness.flight.record import Flight, Outcome


class Status(NamedTuple):
    """How a flight stands after a step."""

    time_s: float
    """Simulated time."""
    state: AircraftState
    """The true state."""
    believed: AircraftState
    """The state as the aircraft believes it to be."""
    to_go_m: float
    """Distance that is left to the goal."""
    plan_index: int
    """The plan in effect, -1 before the first."""
    arc_length_m: float
    """Distance along that plan at the last update of guidance; NaN without one."""
    cross_track_m: float
    """Distance from that plan, as guidance saw it, positive to its right; NaN without one."""
    outcome: Outcome | None
    """How the flight ended; None while it goes on."""
    reason: str
    """The outcome as a sentence; empty while the flight goes on."""

    @property
    def done(self) -> bool:
        """Whether the flight is over."""
        return self.outcome is not None


class SteppedLoop:
    """The closed loop of one scenario, one guidance interval a step; each reset makes it anew."""

    def __init__(self, make: Callable[[], Loop], observers: Sequence[Observer] = ()) -> None:
        self._make, self._observers = make, observers
        self._flying: ClosedLoop | None = None

    def reset(self) -> Status:
        """Begins a new flight, whatever has become of the one before, and returns its status at the start."""
        self._flying = ClosedLoop(self._make(), self._observers)
        return self.status

    def step(self, roll_command_rad: float | None = None) -> Status:
        """Flies one guidance interval, or up to the end of the flight if that comes first.

        A roll command is held for this interval in place of what the guidance law decides, positive right wing down;
        nothing limits it but what the aircraft can do.

        Raises RuntimeError where no flight has begun or it is over, ValueError where the command is not finite. After
        an exception of an observer or Ctrl-C the flight cannot be gone on with: `reset` begins anew.
        """
        if (flying := self._current_flight()).ending is not None:
            raise RuntimeError(
                f"step() after the end: the flight is over after {flying.true.time_s:g} s "
                f"({flying.ending.outcome.value}: {flying.ending.reason}); reset() begins the next"
            )
        if roll_command_rad is not None and not math.isfinite(roll_command_rad):
            raise ValueError(f"roll_command_rad is {roll_command_rad}; must be finite")
        try:
            flying.step(roll_command_rad)
        except BaseException:  # of an observer, or Ctrl-C: a part of a step cannot be gone on from
            self._flying = None
            raise
        return self.status

    @property
    def status(self) -> Status:
        """How the flight stands; `RuntimeError` where none has begun."""
        flying = self._current_flight()
        outcome, reason = (None, "") if flying.ending is None else flying.ending
        steering = flying.steering
        whereabouts = flying.true.time_s, flying.true, flying.believed, flying.to_go_m
        return Status(*whereabouts, flying.plans.index, steering.arc_length_m, steering.cross_track_m, outcome, reason)

    @property
    def done(self) -> bool:
        """Whether the flight that was begun last is over."""
        return self._current_flight().ending is not None

    def flight(self) -> Flight:
        """The flight, once it is over; before that, `RuntimeError`."""
        return self._current_flight().flight()

    def _current_flight(self) -> ClosedLoop:
        if self._flying is None:
            raise RuntimeError("reset() before step(): no flight has begun, or its last step was broken off")
        return self._flying
