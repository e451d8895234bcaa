"""The legs of a mission: straight to its waypoints, and round its loiters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from aircraft.interface import Route
from aircraft.route import arc_point

HEADING_FOR_CENTRES: Final = ("l1", "npfg")
"""Laws whose autopilots head for the centre of a loiter; all others join its circle along a tangent."""


@dataclass(frozen=True, eq=False)
class MissionLeg:
    """One leg: to a waypoint, along a way, or round a circle."""

    route: Route  # what the law follows
    stations_m: tuple[float, float]  # arc lengths at its ends on the route that the mission was made into
    end_m: tuple[float, float] | None = None  # the waypoint that it leads to; None: it is flown to its end
    acceptance_m: float | None = (
        0.0  # the waypoint is reached from here; None: by the law's rule; 0: when passed
    )
    captured_radius_m: float = (
        0.0  # of the circle about the waypoint that is joined from far; 0: there is none
    )
    centre_m: tuple[float, float] | None = None  # of a circle that the leg goes round
    swept_rad: float = 0.0  # how far round, from where the route begins

    @property
    def direction(self) -> tuple[float, float]:
        """Unit vector at its end."""
        row = self.route.segments[-1]
        return arc_point(tuple(row.tolist()), float(row[5]))[2:]


def straight(
    ends: tuple[complex, complex],
    stations_m: tuple[float, float],
    acceptance_m: float | None,
    centre: complex | None = None,
) -> MissionLeg:
    """A leg from one place to another, east + i north."""
    start, end = ends
    goal = end if centre is None else centre
    length_m = abs(goal - start)
    ahead = (goal - start) / length_m
    row = (start.real, start.imag, ahead.real, ahead.imag, 0.0, length_m)
    return MissionLeg(
        Route(np.array([row])), stations_m, (goal.real, goal.imag), acceptance_m, abs(goal - end)
    )
