"""The plan in effect as a MAVLink mission: its waypoints as items, and which of them the aircraft flies to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aircraft.frames import LocalPlane
from harness.flight.polylines import polylines
from harness.flight.record import AcceptedPlan, FloatArray

CHORD_ERROR_M = 1.0


@dataclass(frozen=True, eq=False)
class PlanAsMission:
    """A plan's waypoints, in order.

    Attributes:
        degrees: (n, 2) latitude and longitude.
        along_m: (n,) where each lies along the plan's path; never less than the one before.
    """

    degrees: FloatArray
    along_m: FloatArray

    @classmethod
    def of(cls, accepted: AcceptedPlan, plane: LocalPlane) -> PlanAsMission:
        """The mission of a plan.

        Args:
            accepted: the plan.
            plane: the local plane.
        """
        path, waypoints = accepted.plan.path, accepted.plan.waypoints_m
        assert path is not None
        (points,) = polylines([path.segments], CHORD_ERROR_M)
        if not len(waypoints):
            waypoints = points[[0, -1]]
        steps = np.hypot(*np.diff(points, axis=0).T)
        along = np.concatenate(([0.0], np.cumsum(steps)))
        places, first = [], 0
        for waypoint in waypoints:
            first += int(np.argmin(np.hypot(*(points[first:] - waypoint).T)))
            places.append(along[first])
        degrees = [plane.geodetic(east, north) for east, north in waypoints.tolist()]
        return cls(np.array(degrees), np.array(places))

    def __len__(self) -> int:
        return len(self.along_m)

    def current(self, along_m: float) -> int:
        """The waypoint that is flown to, from a distance along the path."""
        return min(int(np.searchsorted(self.along_m, along_m, side="right")), len(self) - 1)
