"""Route following: keeps the place on a route, and asks the law (`aircraft.guidance_law`) for the roll command."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from aircraft import guidance_law as law
from aircraft.guidance_law import ALONG, ROW, START
from aircraft.interface import AircraftState, FloatArray, Route
from aircraft.route import arc_point

UPDATE_RATE_HZ = 10
"""Roll commands a second. Flown on the 14-turn courses of `harness.bench.tracking`, 20 a second track no better:
the command
is held for half an update more, which the preview makes up for."""

TYPICAL_BANK_RAD = math.radians(30.0)
"""A step of curvature is blended over the time that rolling this far takes."""


@dataclass(frozen=True)
class GuidanceLimits:
    """What guidance may ask of an aircraft.

    Attributes:
        bank_limit_rad: largest roll command.
        roll_rate_radps: fastest change of the roll command.
        roll_lag_s: time constant of roll behind its command; the command leads by it.
        roll_delay_s: what further delay there is (actuators, the roll mode).
        bandwidth_radps: natural frequency omega of the cross-track correction, about a third of 1 / roll_lag_s.
    """

    bank_limit_rad: float
    roll_rate_radps: float
    roll_lag_s: float
    roll_delay_s: float
    bandwidth_radps: float


class GuidanceOutput(NamedTuple):
    """One decision of the path follower."""

    roll_command_rad: float
    cross_track_m: float
    """Distance from the path, positive to its right."""
    arc_length_m: float
    """Distance along the route of the nearest point; grows on in a loiter."""
    bank_saturated: bool
    """The bank limit cut the command."""
    past_end: bool
    """The route is flown out; straight on along its last tangent."""


class PathFollower:
    """Follows a route from one update to the next, `update_rate_hz` times a second.

    Progress is local: the nearest point is sought from the last one onwards, so a route may cross itself.
    """

    def __init__(self, limits: GuidanceLimits, update_rate_hz: float = UPDATE_RATE_HZ) -> None:
        """Makes a follower without a route.

        Args:
            limits: what may be asked of the aircraft.
            update_rate_hz: how often `update` will be called.
        """
        self.memory = np.array(
            (
                limits.roll_rate_radps / update_rate_hz,
                # The held command acts on average half an update late.
                limits.roll_delay_s + 0.5 / update_rate_hz,
                limits.roll_lag_s * update_rate_hz,
                max(TYPICAL_BANK_RAD / limits.roll_rate_radps, 1.0 / update_rate_hz),
                limits.bank_limit_rad,
                limits.bandwidth_radps,
                *(0.0, 0.0, 0.0),
            )
        )
        """What it knows and remembers, see `aircraft.guidance_law.MEMORY`."""
        self.route: FloatArray | None = None
        """The route, as the law has it; None without one."""

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes a new route; the roll command goes on from where it is.

        Args:
            route: what to fly.
            arc_length_m: where on it to begin looking for the nearest point, m from its start.
        """
        self.route = _rows(route)
        starts = self.route[:, START]
        row = max(int(np.searchsorted(starts, arc_length_m, side="right")) - 1, 0)
        self.memory[ROW], self.memory[ALONG] = row, arc_length_m - float(starts[row])

    def update(self, state: AircraftState) -> GuidanceOutput:
        """Decides the roll command for the next update interval.

        Args:
            state: the aircraft now.

        Returns:
            Roll command, and where the aircraft is relative to the route.

        Raises:
            RuntimeError: if there is no route yet.
        """
        if self.route is None:
            raise RuntimeError("follow() a route before update()")
        _, east, north, _, velocity_east, velocity_north, _, heading, _, _, airspeed, _, _ = state
        output = law.decide(
            self.route, self.memory, east, north, velocity_east, velocity_north, heading, airspeed
        )
        # At once: the constructor of a NamedTuple takes twice as long.
        return tuple.__new__(GuidanceOutput, output)


def _rows(route: Route) -> FloatArray:
    """(n, 9) the segments of a route, with stations and turns; one without a loiter goes on straight for ever."""
    segments = route.segments
    if not route.loiter:
        end = arc_point(tuple(segments[-1].tolist()), float(segments[-1, 5]))
        segments = np.vstack((segments, (*end, 0.0, math.inf)))
    stations = np.append(0.0, np.cumsum(segments[:, 5]))
    stations[-1] = math.inf
    turned = np.append(0.0, np.cumsum(segments[:-1, 4] * segments[:-1, 5]))
    rows = np.column_stack((segments, stations[:-1], stations[1:], turned))
    rows.setflags(write=False)
    return rows
