"""The boundary of the known obstacles grown by the distance to be kept: what a BUG follows.

Every edge point is the centre of a disc that must not be entered. The discs that overlap are one grown
obstacle, and its boundary is made of their arcs. It is traced from arc to arc by exact intersections of
circles, in the sense of travel, so that following it needs no steps, closes where it began, and changes only
where a new disc covers a part of it. The area to be flown in is a wall that is known from the start.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from planner.baselines.boundary_path import ANGLE_OFF_RAD, Contact, path_along
from planner.geometry.clearance import first_entry
from planner.geometry.curves import Point, Segment
from planner.interface import BoolArray, FloatArray, IntArray, MapView, Mission
from planner.memory import ObstacleMemory

GRAZED_M = 1e-3
"""A line that goes less deep into a disc passes it."""

TOUCH_SHARE = 0.05
"""A place this share of the kept distance off a disc still touches it: a path cuts across the dents between."""

HALF_TURN = 3.0
"""Longer arcs are cut in two (rad)."""

SEAT_DISCS = 24
"""So many discs at most are looked at to find the boundary near a place."""

FENCE = -1
"""Label of the discs that keep a path inside the area."""


class GrownObstacles:
    """The discs about all edge points seen so far.

    Args:
        mission: the area, the goal and the clearance.
        margin_m: distance kept beyond the clearance, and from the bounds of the area.
    """

    def __init__(self, mission: Mission, margin_m: float) -> None:
        self.keep_m = mission.clearance_m + margin_m
        self._mission = mission
        self._memory = ObstacleMemory(mission.clearance_m)
        self._fence = _fence(mission.bounds_m, self.keep_m, margin_m)
        self._rebuild()

    def _rebuild(self) -> None:
        self.points_m = np.zeros((0, 2))
        self.radii_m = np.zeros(0)
        self._cells: dict[tuple[int, int], list[int]] = {}
        self._meets: dict[int, tuple[int, IntArray, FloatArray, FloatArray]] = {}
        self._add(self._fence)

    def take_in(self, seen: MapView) -> tuple[FloatArray, bool]:
        """Remembers what has come in.

        Returns:
            The (k, 2) new edge points, and whether some were taken back: then everything may be different.
        """
        self._memory.take_in(seen)
        # What moves comes last there: where it has moved, or new edges have come before it, all is laid anew.
        points, known = self._memory.points_m, len(self.points_m) - len(self._fence)
        taken_back = not np.array_equal(points[:known], self.points_m[len(self._fence) :])
        if taken_back:
            self._rebuild()
        fresh = points if taken_back else points[known:]
        if len(fresh):
            self._add(fresh)
        return fresh, taken_back

    @property
    def taken_back(self) -> bool:
        """Whether any edge that was seen has been taken back so far."""
        return self._memory.ever_cleared

    @property
    def labels(self) -> IntArray:
        """(m,) the obstacle that each disc belongs to."""
        return np.concatenate((np.full(len(self._fence), FENCE, dtype=np.intp), self._memory.labels))

    @property
    def cell_m(self) -> float:
        """Points within a square of this side are looked at as one piece of wall."""
        return self._memory.cell_m

    def _add(self, fresh: FloatArray) -> None:
        begin = len(self.points_m)
        east, north = self._mission.goal_m
        # The goal itself may lie nearer to an edge than what is kept elsewhere, but not than the clearance.
        room = np.hypot(fresh[:, 0] - east, fresh[:, 1] - north) - 1e-3
        radii = np.clip(room, min(self._mission.clearance_m, self.keep_m), self.keep_m)
        self.points_m = np.concatenate((self.points_m, fresh))
        self.radii_m = np.concatenate((self.radii_m, radii))
        cells = np.floor(fresh / (2.0 * self.keep_m)).astype(np.int64).tolist()
        for i, (x, y) in enumerate(cells):
            self._cells.setdefault((x, y), []).append(begin + i)

    def first_hit(self, a: Point, b: Point) -> tuple[float, int]:
        """Where the line from a to b first enters a disc: distance (m) and disc; infinite and -1 for never."""
        return first_entry(a, b, self.points_m, self.radii_m)

    def turned_back(self, place: Point, target: Point) -> bool:
        """Whether an obstacle that a place on the boundary touches lies ahead on the way to a target."""
        return len(self._passed_m(place, target)) > 0

    def leads_inside(self, place: Point, target: Point) -> bool:
        """Whether the line from a place on the boundary to a target begins inside the obstacle."""
        return bool((self._passed_m(place, target) < -GRAZED_M).any())

    def _passed_m(self, place: Point, target: Point) -> FloatArray:
        """(k,) how far the line from a place to a target passes from the rims of the discs ahead that it touches."""
        near = self._near(place)
        dx, dy = self.points_m[near, 0] - place[0], self.points_m[near, 1] - place[1]
        whole = max(math.dist(place, target), 1e-9)
        ux, uy = (target[0] - place[0]) / whole, (target[1] - place[1]) / whole
        touches = np.hypot(dx, dy) < self.radii_m[near] + TOUCH_SHARE * self.keep_m
        passed = np.abs(dx * uy - dy * ux) - self.radii_m[near]
        ahead: FloatArray = passed[touches & (dx * ux + dy * uy > 0.0)]
        return ahead

    def seat(self, place: Point) -> tuple[int, Point]:
        """The boundary place nearest to a place on or in an obstacle, and a disc it lies on."""
        near = self._near(place)
        if not len(near):
            square = (self.points_m[:, 0] - place[0]) ** 2 + (self.points_m[:, 1] - place[1]) ** 2
            near = np.array([int(square.argmin())])
        dx, dy = place[0] - self.points_m[near, 0], place[1] - self.points_m[near, 1]
        distance = np.maximum(np.hypot(dx, dy), 1e-9)
        off = distance - self.radii_m[near]
        order = np.argsort(off, kind="stable")[: SEAT_DISCS if off.min() < 0.0 else 1]
        chosen, scale = near[order], self.radii_m[near[order]] / distance[order]
        feet = self.points_m[chosen] + np.column_stack((dx[order] * scale, dy[order] * scale))
        if len(chosen) == 1:  # outside of all discs the nearest one has the nearest boundary
            return int(chosen[0]), (float(feet[0, 0]), float(feet[0, 1]))
        corners, owners = self._corners(chosen)
        places, discs = np.concatenate((feet, corners)), np.concatenate((chosen, owners))
        free = np.flatnonzero(~self._covered(places, near))
        if not len(free):
            return int(chosen[0]), (float(feet[0, 0]), float(feet[0, 1]))
        off = np.hypot(places[free, 0] - place[0], places[free, 1] - place[1])
        best = free[int(off.argmin())]
        return int(discs[best]), (float(places[best, 0]), float(places[best, 1]))

    def _corners(self, discs: IntArray) -> tuple[FloatArray, IntArray]:
        """(k, 2) where the circles of some discs cross, and (k,) one of the two."""
        i, j = np.triu_indices(len(discs), 1)
        i, j = discs[i], discs[j]
        step = self.points_m[j] - self.points_m[i]
        distance = np.hypot(step[:, 0], step[:, 1])
        ri, rj = self.radii_m[i], self.radii_m[j]
        meet = (distance > 1e-6) & (distance < ri + rj) & (distance > np.abs(ri - rj))
        i, step, distance, ri, rj = i[meet], step[meet], distance[meet], ri[meet], rj[meet]
        along = (distance**2 + ri**2 - rj**2) / (2.0 * distance)
        across = np.sqrt(np.maximum(ri**2 - along**2, 0.0))
        unit = step / distance[:, None]
        foot = self.points_m[i] + along[:, None] * unit
        off = across[:, None] * np.column_stack((-unit[:, 1], unit[:, 0]))
        return np.concatenate((foot + off, foot - off)), np.concatenate((i, i))

    def _covered(self, places: FloatArray, discs: IntArray) -> BoolArray:
        dx = places[:, :1] - self.points_m[discs, 0]
        dy = places[:, 1:] - self.points_m[discs, 1]
        inside: BoolArray = (np.hypot(dx, dy) < self.radii_m[discs] - ANGLE_OFF_RAD * self.keep_m).any(axis=1)
        return inside

    def _around(self, place: Sequence[float]) -> list[list[int]]:
        """The discs of the grid cells about a place: all whose centre is within two kept distances, and more."""
        side = 2.0 * self.keep_m
        x, y = math.floor(place[0] / side), math.floor(place[1] / side)
        return [
            self._cells[key] for i in (-1, 0, 1) for j in (-1, 0, 1) if (key := (x + i, y + j)) in self._cells
        ]

    def _near(self, place: Sequence[float]) -> IntArray:
        return np.array([disc for cell in self._around(place) for disc in cell], dtype=np.intp)

    def _met_by(self, disc: int) -> tuple[IntArray, FloatArray, FloatArray]:
        """The discs that meet one: their indices, the bearings of their middles, and half their widths."""
        center = self.points_m[disc].tolist()
        count = sum(map(len, self._around(center)))
        known = self._meets.get(disc)
        if known is not None and known[0] == count:
            return known[1:]
        near = self._near(center)
        dx, dy = self.points_m[near, 0] - center[0], self.points_m[near, 1] - center[1]
        distance = np.hypot(dx, dy)
        mine, other = self.radii_m[disc], self.radii_m[near]
        meet = (distance > 1e-6) & (distance < mine + other) & (distance > np.abs(mine - other))
        distance, other = distance[meet], other[meet]
        half = np.arccos(np.clip((distance**2 + mine**2 - other**2) / (2.0 * distance * mine), -1.0, 1.0))
        found = near[meet], np.arctan2(dy[meet], dx[meet]), half
        self._meets[disc] = (count, *found)
        return found

    def contacts(self, disc: int, place: Point, side: float) -> Iterator[Contact]:
        """The arcs of the boundary one after the other, without end.

        Args:
            disc: a disc that the first place lies on.
            place: where to begin, on the boundary.
            side: 1 for the obstacle on the left, -1 for on the right.
        """
        bearing = self._bearing(disc, place, side)
        came_from = -1
        while True:
            others, middle, half = self._met_by(disc)
            if not len(others):
                yield Contact(disc, bearing, bearing + HALF_TURN)
                bearing += HALF_TURN
                continue
            entry = side * middle - half
            turn = (entry - bearing) % math.tau
            inside = (bearing - entry) % math.tau < 2.0 * half - ANGLE_OFF_RAD
            now = (inside | (turn > math.tau - ANGLE_OFF_RAD)) & (others != came_from)
            turn[now] = 0.0
            first = int(turn.argmin())
            end = bearing + float(turn[first])
            while end - bearing > HALF_TURN:
                yield Contact(disc, bearing, bearing + HALF_TURN)
                bearing += HALF_TURN
            if end - bearing > ANGLE_OFF_RAD:
                yield Contact(disc, bearing, end)
            place = self._on(disc, end, side)
            came_from, disc = disc, int(others[first])
            bearing = self._bearing(disc, place, side)

    def _bearing(self, disc: int, place: Point, side: float) -> float:
        x, y = self.points_m[disc].tolist()
        return math.atan2(side * (place[1] - y), place[0] - x)

    def _on(self, disc: int, bearing: float, side: float) -> Point:
        (x, y), radius = self.points_m[disc].tolist(), float(self.radii_m[disc])
        return x + radius * math.cos(bearing), y + side * radius * math.sin(bearing)

    def path_along(self, begin: Point, contacts: Sequence[Contact], side: float) -> list[Segment]:
        """Lines and arcs along a stretch of the boundary (`planner.baselines.boundary_path.path_along`)."""
        discs = [contact.disc for contact in contacts]
        return path_along(begin, contacts, self.points_m[discs], self.radii_m[discs], side)


def _fence(bounds_m: tuple[float, float, float, float], keep_m: float, margin_m: float) -> FloatArray:
    """(k, 2) centres outside the area whose discs leave all of it free but a margin."""
    xmin, ymin, xmax, ymax = bounds_m
    off = keep_m - margin_m
    xs = np.linspace(xmin - off, xmax + off, max(2, math.ceil((xmax - xmin + 2 * off) / (0.5 * keep_m))))
    ys = np.linspace(ymin - off, ymax + off, max(2, math.ceil((ymax - ymin + 2 * off) / (0.5 * keep_m))))[
        1:-1
    ]
    rows = [np.column_stack((xs, np.full(len(xs), y))) for y in (ymin - off, ymax + off)]
    columns = [np.column_stack((np.full(len(ys), x), ys)) for x in (xmin - off, xmax + off)]
    return np.concatenate((*rows, *columns))
