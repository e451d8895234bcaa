"""The rolling window: what lies in it, the guide vector, and the fan-shaped sectors that obstacles cut.

Definition 1 of the paper is the sensing range U, Definition 2 the guide vector alpha; section 3.3 has the
planning window U_1 of radius r_1 <= r. Seen from a track point, an obstacle, grown by the distance to be kept from
it, fills a fan of bearings. M and N are where its fan ends on the left and on the right: directions tangent to
the obstacle. Between the fans lie the free sectors. Fans that overlap are merged, and an edge that something nearer
hides is none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from planner.curves import Point
from planner.interface import FloatArray
from planner.memory import IntArray

EDGE_OFF_RAD = 1e-7
"""Edges are turned this much into the free sector, clear of rounding errors."""

MOST_HIDING = 12
"""So many obstacles at most are looked at for the edges of one."""


def guide_vector(position: Point, goal: Point) -> tuple[float, float, float]:
    """Definition 2: unit vector from the position to the goal, and its length in metres."""
    dx, dy = goal[0] - position[0], goal[1] - position[1]
    length = math.hypot(dx, dy)
    return (dx / length, dy / length, length) if length else (1.0, 0.0, 0.0)


class SectorEdge(NamedTuple):
    """The edge of a free sector at a track point: M (the obstacle is on its right) or N (on its left).

    Attributes:
        ux, uy: unit vector along the edge, tangent to the obstacle.
        touch_m: distance at which it touches the obstacle.
        clear_m: distance up to which the direction is free; infinite where nothing is met.
    """

    ux: float
    uy: float
    touch_m: float
    clear_m: float


@dataclass(frozen=True, eq=False)
class Window:
    """The planning window U_1 and the obstacles that are known in it.

    Attributes:
        center_m: the present track point w_k.
        radius_m: r_1.
        points_m: (m, 2) sensed edge points.
        labels: (m,) the obstacle that each belongs to.
        spacing_m: grid on which the points lie, at most one a cell.
        keep_m: (m,) distance to be kept from each point.
    """

    center_m: Point
    radius_m: float
    points_m: FloatArray
    labels: IntArray
    spacing_m: float
    keep_m: FloatArray
    _members: dict[int, tuple[IntArray, IntArray]] = field(default_factory=dict, init=False, repr=False)

    def _obstacle(self, label: int) -> tuple[IntArray, IntArray]:
        """Indices (k,) of the points of an obstacle, and for each the (k, 8) places of those in the cells around it.

        Where a cell around a point is empty, the place is the point's own.
        """
        known = self._members.get(label)
        if known is not None:
            return known
        members = np.flatnonzero(self.labels == label)
        cells = np.floor(self.points_m[members] / self.spacing_m).astype(np.int64)
        cells -= cells.min(axis=0) - 1
        width = int(cells[:, 1].max()) + 2
        keys = cells[:, 0] * width + cells[:, 1]
        order = np.argsort(keys)
        ordered = keys[order]
        wanted = keys[:, None] + np.array(
            (-width - 1, -width, -width + 1, -1, 1, width - 1, width, width + 1)
        )
        place = np.minimum(np.searchsorted(ordered, wanted), len(keys) - 1)
        around = np.where(ordered[place] == wanted, order[place], np.arange(len(keys))[:, None])
        self._members[label] = (members, around)
        return members, around

    def sector_edges(self, origin: Point, label: int) -> list[SectorEdge]:
        """The edges M and N of the free sectors beside an obstacle, as seen from a track point.

        Where something hides an edge, the edges of what hides it are taken as well.
        """
        edges: list[SectorEdge] = []
        pending, looked_at = [label], {label}
        dx, dy = self.points_m[:, 0] - origin[0], self.points_m[:, 1] - origin[1]
        while pending:
            ux, uy, touch = self._tangents(dx, dy, pending.pop())
            if not len(ux):
                continue
            clear, met = self._clear_along(dx, dy, ux, uy)
            for row in zip(
                ux.tolist(), uy.tolist(), touch.tolist(), clear.tolist(), met.tolist(), strict=True
            ):
                if row[3] >= row[2]:
                    edges.append(SectorEdge(*row[:4]))
                elif (other := int(self.labels[row[4]])) not in looked_at and len(looked_at) < MOST_HIDING:
                    looked_at.add(other)
                    pending.append(other)
        return edges

    def _tangents(
        self, dx: FloatArray, dy: FloatArray, label: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Unit vectors tangent to the ends of an obstacle's fan, and the distances at which they touch it."""
        members, around = self._obstacle(label)
        x, y = dx[members], dy[members]
        square = x * x + y * y
        keep = self.keep_m[members]
        outside = square > keep * keep
        half = np.arcsin(np.minimum(keep / np.sqrt(np.maximum(square, 1e-12)), 1.0))
        middle = np.arctan2(y, x)
        angles, places = [], []
        for side in (1.0, -1.0):  # M, N
            edge = middle + side * half
            # The fan ends at a point whose tangent lies further out than those of the points around it.
            beyond = side * (edge[around] - edge[:, None])
            beyond -= math.tau * np.rint(beyond / math.tau)
            chosen = np.flatnonzero((beyond <= 0.0).all(axis=1) & outside)
            angles.append(edge[chosen] + side * EDGE_OFF_RAD)
            places.append(chosen)
        angle, place = np.concatenate(angles), np.concatenate(places)
        return np.cos(angle), np.sin(angle), np.sqrt(square[place] - keep[place] ** 2)

    def _clear_along(
        self, dx: FloatArray, dy: FloatArray, ux: FloatArray, uy: FloatArray
    ) -> tuple[FloatArray, IntArray]:
        """How far (k,) directions lead before they come too near to a point (infinite: they do not), and to which."""
        ahead = ux[:, None] * dx + uy[:, None] * dy
        beside = uy[:, None] * dx - ux[:, None] * dy
        room = self.keep_m * self.keep_m - beside * beside
        hit = (room > 0.0) & (ahead > 0.0)
        entry = np.full(room.shape, math.inf)
        entry[hit] = ahead[hit] - np.sqrt(room[hit])
        met = entry.argmin(axis=1)
        return np.maximum(entry[np.arange(len(met)), met], 0.0), met

    def free_sectors(self, origin: Point) -> FloatArray:
        """(k, 4) free sectors at a track point: unit vectors of the right and the left edge of each.

        Fans that overlap or hide each other are merged. With nothing in the window there is no row: all is free.
        """
        if not len(self.points_m):
            return np.zeros((0, 4))
        dx, dy = self.points_m[:, 0] - origin[0], self.points_m[:, 1] - origin[1]
        half = np.arcsin(np.minimum(self.keep_m / np.maximum(np.hypot(dx, dy), 1e-9), 1.0))
        low = np.arctan2(dy, dx) - half
        high = low + 2.0 * half
        start = low[0]
        begin = (low - start) % math.tau
        order = np.argsort(begin)
        begin, furthest = begin[order], np.maximum.accumulate((begin + high - low)[order])
        # What reaches beyond a full turn covers the beginning again.
        covered = np.maximum(np.append(0.0, furthest[:-1]), furthest[-1] - math.tau)
        gap = begin > covered
        right, left = start + covered[gap], start + begin[gap]
        if furthest[-1] < math.tau:
            right, left = np.append(right, start + furthest[-1]), np.append(left, start + math.tau)
        return np.column_stack((np.cos(right), np.sin(right), np.cos(left), np.sin(left)))
