"""What the rest of the world may know of an aircraft: state, command, route, flight model.

Frame: local ENU plane, x = east, y = north, z = up, metres. Course and heading are radians clockwise
from north; roll is positive right wing down; route curvature is positive for a left (counter-clockwise) turn.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
GRAVITY_MPS2 = 9.80665  # standard acceleration of free fall (ISO 80000-3)
FOOT_M = 0.3048
STEP_RATE_HZ = 60
"""Steps of a flight model a second, where nothing else is said. Flown on the 14-turn courses of
`harness.bench.tracking`, the track of the Aerosonde lies within 0.03 m of that with 480 steps."""


class AircraftState(NamedTuple):
    """One instant of flight. SI units; velocities are over the ground, in the local ENU plane.

    Surfaces are commanded deflections with their trim, from -1 to 1, where the surface is at its stop.
    """

    time_s: float
    east_m: float
    north_m: float
    up_m: float  # altitude above mean sea level
    velocity_east_mps: float
    velocity_north_mps: float
    velocity_up_mps: float
    heading_rad: float
    roll_rad: float
    pitch_rad: float
    airspeed_mps: float  # true
    load_factor: float  # normal, 1 in level flight
    throttle: float = math.nan  # command, 0 to 1; NaN for a model without an engine
    actuator_limited_s: float = 0.0  # time since the start with a servo at its rate limit, each counted
    vertical_actuator_limited_s: float = 0.0  # that of the servos of elevator and throttle alone
    elevator: float = math.nan
    aileron: float = math.nan
    rudder: float = math.nan
    angle_of_attack_rad: float = math.nan  # of the air to the body's x axis in its plane of symmetry

    @property
    def groundspeed_mps(self) -> float:
        """Horizontal speed over the ground."""
        return math.hypot(self.velocity_east_mps, self.velocity_north_mps)

    @property
    def course_rad(self) -> float:
        """Direction of the ground velocity, clockwise from north, in [0, 2 pi)."""
        return math.atan2(self.velocity_east_mps, self.velocity_north_mps) % math.tau


FIELDS: Final = AircraftState._fields  # names of a state's fields, in order
UNDELAYED: Final = FIELDS.index("load_factor") + 1
"""Fields of a state from this index on are never delayed; those before it are, except the time."""
EAST_AT, NORTH_AT, HEADING_AT = (FIELDS.index(name) - 1 for name in ("east_m", "north_m", "heading_rad"))
"""Indices among the fields after the time."""


def delayed_state(past: deque[AircraftState], state: AircraftState, latency_s: float) -> AircraftState:
    """Returns the state of `latency_s` ago with the time of now; before the first, at that one's constant velocity.

    `past` holds the states of earlier calls, oldest first: this one is added, and those too old are removed.
    """
    if latency_s == 0.0:
        return state
    if not past or state.time_s > past[-1].time_s:
        past.append(state)
    then_s = state.time_s - latency_s
    while len(past) > 1 and past[1].time_s <= then_s:
        past.popleft()
    old = past[0]
    new = past[1] if len(past) > 1 else old
    share = (then_s - old.time_s) / (new.time_s - old.time_s) if then_s > old.time_s else 0.0
    lead_s = min(then_s - old.time_s, 0.0)
    values = [(1.0 - share) * a + share * b for a, b in zip(old[1:UNDELAYED], new[1:UNDELAYED], strict=True)]
    values[HEADING_AT] = old.heading_rad + share * math.remainder(new.heading_rad - old.heading_rad, math.tau)
    values[EAST_AT] += lead_s * old.velocity_east_mps
    values[NORTH_AT] += lead_s * old.velocity_north_mps
    return tuple.__new__(AircraftState, (state.time_s, *values, *state[UNDELAYED:]))  # faster than by name


@dataclass(frozen=True, eq=False)
class Route:
    """A path to be flown: joined segments of constant curvature (lines and arcs)."""

    segments: FloatArray
    """(n, 6) float64, read-only, one row a segment: start east, start north, unit tangent east, unit tangent north at
    the start, curvature (1/m, positive = left turn), length (m)."""
    loiter: bool = False  # the last segment is a full circle that is flown again and again

    def __post_init__(self) -> None:
        rows = np.array(self.segments, dtype=np.float64, order="C")
        if rows.ndim != 2 or rows.shape[1] != 6 or not len(rows):
            raise ValueError(f"route segments must have shape (n, 6), n > 0; got {rows.shape}")
        if not np.isfinite(rows).all() or (rows[:, 5] <= 0).any():
            raise ValueError("route segments must be finite and longer than zero")
        with np.errstate(over="ignore"):
            if not np.isfinite(np.append(rows[:, 4] * rows[:, 5], rows[:, 5].sum())).all():
                raise ValueError("route segments must be of finite length together, and turn by a finite angle each")
        rows.setflags(write=False)
        object.__setattr__(self, "segments", rows)


@dataclass(frozen=True)
class Performance:
    """What planning must know of an aircraft at one true airspeed.

    A full turn that is held needs bank in reserve for gusts alone, so its radius is the least. The radius of turns with
    a straight between them to roll on lies between the two, and equals `turn_radius_m` in calm air.
    """

    airspeed_mps: float
    turn_radius_m: float  # smallest that a plan may ask for, margins for wind and turbulence included
    roll_in_s: float  # from wings level to 90 % of 30 degrees, or of the bank limit if less, at cruise
    tracking_error_m: float  # cross-track error that the guidance stays within on such a plan
    hold_radius_m: float  # smallest of a full circle that is held
    spaced_radius_m: float  # smallest of turns that a straight to roll on comes before and after


class FlightModel(Protocol):
    """An aircraft in the air, its inner loops closed. It is made at its start state, for one flight."""

    @property
    def step_rate_hz(self) -> int:
        """Integration steps per simulated second."""

    def state(self) -> AircraftState:
        """The state now."""

    def command(self, roll_rad: float, altitude_m: float, airspeed_mps: float) -> None:
        """Sets what the inner loops hold until the next call: altitude above mean sea level, true airspeed."""

    def advance(self, steps: int) -> None:
        """Integrates `steps` steps of 1 / step_rate_hz."""

    def fault(self) -> str | None:
        """A sentence if control is lost (not finite, at the ground, stalled), else None."""
