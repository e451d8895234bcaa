"""Progress along a route, for any law: nearest point, cross-track error, curvature there."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from aircraft.interface import FloatArray, Route
from aircraft.route import arc_point


class PathPoint(NamedTuple):
    """The point of a route that is nearest to the aircraft."""

    east_m: float
    north_m: float
    tangent_east: float  # unit tangent in the direction of flight
    tangent_north: float
    curvature_1pm: float  # positive for a left turn
    cross_track_m: float  # distance of the aircraft from the route's tangent there, positive to its right
    arc_length_m: float  # along the route; grows on in a loiter
    past_end: bool  # the route is flown out: the point lies on its last tangent, beyond the end
    off_m: float  # distance of the aircraft from the route: more than `cross_track_m` where the point is a corner


class RouteProgress:
    """Keeps the place on one route. It only moves on, so a route may cross itself."""

    def __init__(self, route: Route, arc_length_m: float = 0.0) -> None:
        from aircraft import kernels  # half a second

        self.rows = route_rows(route)
        self._nearest = kernels.for_types_of(kernels.nearest_on_route, self.rows, 0, *[math.nan] * 3)
        self._row, self._along_m = place_on_rows(self.rows, arc_length_m)
        self._segments: list[tuple[float, ...]] = [tuple(row) for row in self.rows.tolist()]

    def restart(self, arc_length_m: float) -> None:
        """Looks for the next nearest point from an arc length on, as on a new route."""
        self._row, self._along_m = place_on_rows(self.rows, arc_length_m)

    @property
    def segment(self) -> tuple[float, ...]:
        """The row of `rows` that the last nearest point is on."""
        return self._segments[self._row]

    def ahead(self, along_m: float) -> tuple[float, float]:
        """East and north (m) of the point of the route `along_m` beyond the last nearest one."""
        row, along_m = self._row, self._along_m + along_m
        while along_m > self._segments[row][5] and row < len(self._segments) - 1:
            along_m, row = along_m - self._segments[row][5], row + 1
        return arc_point(self._segments[row][:6], along_m)[:2]  # type: ignore[arg-type]

    def nearest(self, east_m: float, north_m: float) -> PathPoint:
        """The point nearest to an aircraft, from the last one onwards."""
        row, along_m, cross_m, tangent_east, tangent_north, off_m = self._nearest(
            self.rows, self._row, self._along_m, east_m, north_m
        )
        self._row, self._along_m = row, along_m
        _, _, _, _, curvature_1pm, length_m, start_m, _, _ = self._segments[row]
        point = east_m - cross_m * tangent_north, north_m + cross_m * tangent_east
        past_end = length_m == math.inf and along_m > 0.0
        there = (*point, tangent_east, tangent_north, curvature_1pm, cross_m, start_m + along_m, past_end)
        return tuple.__new__(PathPoint, (*there, off_m))  # faster than by name


def measures_itself(law: object) -> bool:
    """Tells whether a law is known to measure its cross-track error by `RouteProgress`, as this package's laws do."""
    return type(law).__module__.startswith("aircraft.guidance.")


def route_rows(route: Route) -> FloatArray:
    """The (n, 9) rows of a route for the kernels; without a loiter an endless straight is added.

    Columns are those of `Route.segments`, then the arc lengths at which the segment begins and ends (m; the last is
    infinite) and by how much the route has turned before it (rad, positive to the left).
    """
    segments = route.segments
    if not route.loiter:
        end = arc_point(tuple(segments[-1].tolist()), float(segments[-1, 5]))
        segments = np.vstack((segments, (*end, 0.0, math.inf)))
    arc_lengths = np.append(0.0, np.cumsum(segments[:, 5]))
    arc_lengths[-1] = math.inf
    turned = np.append(0.0, np.cumsum(segments[:-1, 4] * segments[:-1, 5]))
    rows = np.column_stack((segments, arc_lengths[:-1], arc_lengths[1:], turned))
    rows.setflags(write=False)
    return rows


def place_on_rows(rows: FloatArray, arc_length_m: float) -> tuple[int, float]:
    """Row of a route, and distance along it (m), at an arc length."""
    starts = rows[:, 6]
    row = max(int(np.searchsorted(starts, arc_length_m, side="right")) - 1, 0)
    return row, arc_length_m - float(starts[row])
