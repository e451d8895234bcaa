"""The believed state of the aircraft: the true one with seeded errors.

Guidance, the altitude and airspeed that are held, the pose with which a scan enters the map, and the position that the
planner is told are believed ones. World, sensor, contact, `reached` and metrics are of the true state.
"""

from __future__ import annotations

import functools
import math
from collections import deque
from collections.abc import Iterator
from typing import Final

import numpy as np

from aircraft.interface import AircraftState, delayed_state
from harness.scenario.navigation import Navigation
from harness.world.range_sensor import child_stream

VELOCITY_CORRELATION_S: Final = 1.0
"""Correlation time of the velocity errors. Chosen: a filter between the fixes of a receiver of some hertz."""

HEADING_CORRELATION_S: Final = 60.0
"""Correlation time of the heading error. Chosen: a compass error stays on one heading and differs on the next."""

AIRSPEED_CORRELATION_S: Final = 300.0
"""Correlation time of the airspeed error. Chosen: a pressure sensor drifts with its temperature, over minutes."""

NOISE_ROWS: Final = 64  # errors are drawn for this many updates at once

LOOKS_APART_S: Final = 5.0
"""Motion is measured between looks at an obstacle that are about this far apart in time."""


def pose_error_m(navigation: Navigation, range_m: float) -> float:
    """Standard deviation of how far a return at some range is shifted from one look at it to a later one, in m.

    That is what position and heading err differently at two times that are `LOOKS_APART_S` apart: of a first-order
    Gauss-Markov process with size sigma sqrt(2 (1 - exp(-dt / tau))) sigma. The sensing range is the worst case.
    """

    def change(sigma: float, correlation_s: float) -> float:
        return sigma * math.sqrt(-2.0 * math.expm1(-LOOKS_APART_S / correlation_s))

    turned_rad = change(math.radians(navigation.heading_sigma_deg), HEADING_CORRELATION_S)
    position_m = change(navigation.position_sigma_m, navigation.position_correlation_s)
    return math.hypot(position_m, range_m * turned_rad)


class StateEstimator:
    """Estimates the state for one flight; this one knows it exactly."""

    has_fix = True
    """Whether the position is that of a fix, as of the last call of `believed`; without one it drifts."""
    jumps = 0  # how often a fix has come back after an outage, and the believed position has jumped
    held_errors = 0.0, 0.0
    """Error of altitude (m) and airspeed (m/s) that the autopilot holds, without the age of the state."""

    def believed(self, state: AircraftState) -> AircraftState:
        """Returns the believed state for a true one; the very object given where it is known exactly.

        Time never goes back from one call to the next.
        """
        return state


class Navigator(StateEstimator):
    """Believed states of one flight.

    Position (east, north), velocity (three components), heading, airspeed and altitude have errors that are
    independent first-order Gauss-Markov processes, stationary from the first call on. Over an interval dt a process
    of size sigma and correlation time tau goes on exactly, x' = exp(-dt / tau) x + sigma sqrt(1 - exp(-2 dt / tau)) n
    with n standard normal (Gelb, Applied Optimal Estimation, 1974, section 3.8; Beard and McLain, Small Unmanned
    Aircraft, 2012, chapter 7, have the same for position), so that any interval between calls is right.

    In an outage the position error stays that of the last fix and drifts in one direction, drawn for that outage, by
    a share of the distance flown; the believed velocity has the error that this drift is the integral of. At the end
    of the outage the error is again that of a fix: the believed position jumps.

    All of it is as old as the latency, between two calls linear; roll, pitch and load factor are old but true, time and
    controls are those of now.

    Args:
        navigation: sizes and outages.
        seed_sequence: root of two streams, of the errors and of the directions of drift; it is not changed.
    """

    def __init__(self, navigation: Navigation, seed_sequence: np.random.SeedSequence) -> None:
        self._navigation = navigation
        errors, directions = (child_stream(seed_sequence, number) for number in range(2))
        self._noise = _noise(errors)
        turns = directions.uniform(0.0, math.tau, len(navigation.outages_s))
        self._directions = np.column_stack([np.sin(turns), np.cos(turns)]).tolist()
        position_s, position_m = navigation.position_correlation_s, navigation.position_sigma_m
        self._correlation_s = (
            *[position_s] * 2,
            *[VELOCITY_CORRELATION_S] * 3,
            HEADING_CORRELATION_S,
            AIRSPEED_CORRELATION_S,
            position_s,
        )
        self._sigmas = (
            *[position_m] * 2,
            *[navigation.velocity_sigma_mps] * 3,
            math.radians(navigation.heading_sigma_deg),
            navigation.airspeed_sigma_mps,
            navigation.altitude_sigma_m,
        )
        self._perfect = navigation.kind == "perfect"
        self._past: deque[AircraftState] = deque()
        self._unit = [0.0] * 8  # the processes, over their sigmas
        self._errors = [0.0] * 8
        self._time_s, self._place = math.nan, (0.0, 0.0)
        self._outage = -1
        self._fix_error, self._drift = (0.0, 0.0), (0.0, 0.0)

    def believed(self, state: AircraftState) -> AircraftState:
        """Returns the believed state for a true one; `ValueError` if time goes back."""
        if self._perfect:
            return state
        state = delayed_state(self._past, state, self._navigation.latency_s)
        time_s, east_m, north_m, up_m, east_mps, north_mps, up_mps, heading_rad, *others = state
        roll_rad, pitch_rad, true_airspeed_mps, *others = others
        if time_s < self._time_s:
            raise ValueError(f"time goes back from {self._time_s:g} s to {time_s:g} s")
        if time_s != self._time_s:
            self._advance(time_s, (east_m, north_m))
        (fix_east, fix_north), (drift_east, drift_north) = self._fix_error, self._drift
        _, _, v_east, v_north, v_up, heading, airspeed, altitude = self._errors
        if self._outage >= 0:
            drift_mps = self._navigation.drift_share * state.groundspeed_mps
            east, north = self._directions[self._outage]
            v_east, v_north = v_east + drift_mps * east, v_north + drift_mps * north
        airspeed_mps = max(0.0, true_airspeed_mps + airspeed)
        self.held_errors = altitude, airspeed_mps - true_airspeed_mps
        values = (
            time_s,
            east_m + fix_east + drift_east,
            north_m + fix_north + drift_north,
            up_m + altitude,
            east_mps + v_east,
            north_mps + v_north,
            up_mps + v_up,
            (heading_rad + heading) % math.tau,
            roll_rad,
            pitch_rad,
            airspeed_mps,
            *others,
        )
        return tuple.__new__(AircraftState, values)  # a fifth of the time of `_replace`

    def _advance(self, time_s: float, place: tuple[float, float]) -> None:
        """Advances the errors to this time; in an outage that of the position drifts on from what it was."""
        first, before_s = math.isnan(self._time_s), self._time_s
        noise = next(self._noise)
        if not first:
            left, fresh = _shares(time_s - before_s, self._correlation_s)
            noise = [a * old + b * new for a, old, b, new in zip(left, self._unit, fresh, noise, strict=True)]
        self._unit, self._errors = noise, [a * b for a, b in zip(noise, self._sigmas, strict=True)]
        spans = enumerate(self._navigation.outages_s)
        outage = next((index for index, (begin_s, end_s) in spans if begin_s <= time_s < end_s), -1)
        if outage < 0 or first or 0 <= self._outage != outage:  # there was a fix since
            bias_east, bias_north = self._navigation.position_bias_m
            self._fix_error = self._errors[0] + bias_east, self._errors[1] + bias_north
        if outage != self._outage:
            self.jumps += self._outage >= 0
            self._drift = 0.0, 0.0
        if outage >= 0 and not first:
            begin_s = self._navigation.outages_s[outage][0]
            flown_m = math.dist(place, self._place) * (time_s - max(begin_s, before_s)) / (time_s - before_s)
            drift_m, (east, north) = self._navigation.drift_share * flown_m, self._directions[outage]
            self._drift = self._drift[0] + drift_m * east, self._drift[1] + drift_m * north
        self._outage, self._time_s, self._place = outage, time_s, place
        self.has_fix = outage < 0


def _noise(stream: np.random.Generator) -> Iterator[list[float]]:
    """Yields, without end, a standard normal number for each of the eight processes, for one update after the other."""
    while True:
        yield from stream.standard_normal((NOISE_ROWS, 8)).tolist()


@functools.lru_cache(maxsize=64)
def _shares(seconds: float, correlation_s: tuple[float, ...]) -> tuple[list[float], list[float]]:
    """Returns the shares of unit processes that remain after a time, and the sizes of their new normal noise."""
    steps = seconds / np.array(correlation_s)
    return np.exp(-steps).tolist(), np.sqrt(-np.expm1(-2.0 * steps)).tolist()
