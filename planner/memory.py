"""A planner's memory of a flight: the edge points seen so far, gathered into obstacles."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from planner.interface import FloatArray, IntArray, MapView
from planner.kernels.buckets import cells_of, joined

FIRST_MOVING_LABEL = -1000  # label of the first moving obstacle; further ones have the numbers below it
MOVED_SHARE = 0.3  # a moving outline is brought up to date once it has moved by this share of a cell
NO_POINTS = np.zeros((0, 2))  # an empty array of edge points


class ObstacleMemory:
    """Every edge point seen so far and the obstacle that it belongs to.

    Points nearer to each other than twice the clearance leave no way between them: they are one obstacle. They are
    gathered on a grid whose neighbouring cells (diagonals too) are always that near.
    """

    def __init__(self, clearance_m: float) -> None:
        self.cell_m = clearance_m / math.sqrt(2.0)
        self.cleared = 0
        """Number of edge points cleared so far; no other has moved up by more places in their order."""
        self.ever_cleared = False
        """Whether an edge point that had been seen was cleared again: the sensor errs, or something has gone."""
        self._outlines: Sequence[FloatArray] = ()
        self._revision = -1
        self.standing_m = NO_POINTS  # (`known`, 2) points that stand still, refused places among them
        self._genuine = np.zeros(0, dtype=np.bool_)
        self._labels: IntArray | None = None
        self._with_moving: FloatArray | None = None

    @property
    def known(self) -> int:
        """Number of points that stand still: they come first, in the order in which they came in."""
        return len(self.standing_m)

    @property
    def points_m(self) -> FloatArray:
        """(m, 2) edge points, those of moving obstacles last; later calls do not change this array."""
        if self._with_moving is None:
            moving = self._outlines
            self._with_moving = np.concatenate((self.standing_m, *moving)) if moving else self.standing_m
        return self._with_moving

    @property
    def labels(self) -> IntArray:
        """(m,) label of the obstacle that each point belongs to; each moving obstacle has its own."""
        if self._labels is None:
            self._labels = obstacles_of(self.standing_m, self.cell_m)
        numbers = [np.full(len(outline), FIRST_MOVING_LABEL - i) for i, outline in enumerate(self._outlines)]
        return np.concatenate((self._labels, *numbers)) if numbers else self._labels

    @property
    def met_m(self) -> FloatArray:
        """(k, 2) points of moving obstacles, where they will be met."""
        return self.points_m[self.known :]

    @property
    def genuine_m(self) -> FloatArray:
        """(k, 2) points seen to stand still, without refused places."""
        return self.standing_m if self._genuine.all() else self.standing_m.compress(self._genuine, axis=0)

    @property
    def refused_m(self) -> FloatArray:
        """(k, 2) refused places."""
        return self.standing_m.compress(~self._genuine, axis=0)

    def refuse(self, place: tuple[float, float]) -> None:
        """Remembers a place as an edge point, so that no path leads there again."""
        self._add(np.array([place]), genuine=False)

    def forget_refused(self) -> None:
        """Forgets the refused places."""
        if not self._genuine.all():
            self._keep_only(self.genuine_m, NO_POINTS)

    def take_in(self, seen: MapView, met: Sequence[FloatArray] | None = None) -> FloatArray:
        """Takes in and returns the (k, 2) edge points new since the last call; forgets those that the map removed."""
        fresh = NO_POINTS if seen.revision == self._revision else self._take_in(seen)
        outlines = [each.points_m for each in seen.moving] if met is None else met
        if not (outlines or self._outlines) or self._are_unmoved(outlines):
            return fresh
        self._outlines, self._with_moving = tuple(outlines), None
        return np.concatenate((fresh, *outlines))

    def _are_unmoved(self, outlines: Sequence[FloatArray]) -> bool:
        """Tells whether moving outlines are still where they were, to `MOVED_SHARE` of a cell."""
        return len(outlines) == len(self._outlines) and all(
            np.abs(edge(new, axis=0) - edge(old, axis=0)).max() < MOVED_SHARE * self.cell_m
            for new, old in zip(outlines, self._outlines, strict=True)
            for edge in (np.min, np.max)
        )

    def _take_in(self, seen: MapView) -> FloatArray:
        """Takes in and returns the new edge points of the map that stand still; forgets those that it took away."""
        fresh = seen.edges_since(self._revision)
        if seen.last_removal_revision > self._revision >= 0:
            self.ever_cleared = True
            self.cleared += len(fresh)  # they are no places that were known before
            self._keep_only(seen.edges_since(-1), self.refused_m)
        elif len(fresh):
            self._add(fresh, genuine=True)
        self._revision = seen.revision
        return fresh

    def _keep_only(self, genuine_m: FloatArray, refused_m: FloatArray) -> None:
        """Begins anew with the points left; refused places come first, so that no other moves up in the order."""
        self.cleared += self.known - len(genuine_m) - len(refused_m)
        self.standing_m, self._genuine = NO_POINTS, self._genuine[:0]
        self._add(refused_m, genuine=False)
        self._add(genuine_m, genuine=True)

    def _add(self, fresh: FloatArray, genuine: bool) -> None:
        """Adds (k, 2) points that stand still: seen ones (`genuine`), or refused places."""
        self.standing_m = np.ascontiguousarray(np.concatenate((self.standing_m, fresh)))
        self._genuine = np.concatenate((self._genuine, np.full(len(fresh), genuine)))
        self._labels = self._with_moving = None


def obstacles_of(points_m: FloatArray, cell_m: float) -> IntArray:
    """(m,) the obstacle that each of (m, 2) points belongs to: one for all that are joined by cells that touch."""
    labels = np.zeros(len(points_m), dtype=np.intp)
    if len(points_m):
        members, (_, counts, one, other) = cells_of(points_m, np.arange(len(points_m)), cell_m)
        labels[members] = np.repeat(joined(len(counts), one, other), counts)
    return labels
