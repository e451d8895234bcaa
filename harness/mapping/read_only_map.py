"""The map as a planner is handed it: to be read, not to be changed."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

import numpy as np

from planner.interface import BoolArray, FloatArray, MapView, MovingEdges

if TYPE_CHECKING:
    import shapely


class ReadOnlyMap:
    """A map through which nothing can be changed (`planner.interface.MapView`).

    It guards against mistakes. Code in the same process that means to reach what is behind it can always do so.

    Args:
        seen: the map itself.
    """

    __slots__ = ("_nearest", "_seen")

    _seen: MapView
    _nearest: NearestEdge

    def __init__(self, seen: MapView) -> None:
        object.__setattr__(self, "_seen", seen)
        object.__setattr__(self, "_nearest", NearestEdge(seen))

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"{name[:100]} of the map cannot be set: a planner may only read what was seen")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(
            f"{name[:100]} of the map cannot be deleted: a planner may only read what was seen"
        )

    @property
    def spacing_m(self) -> float:
        """Edge points of one wall are about this far apart."""
        return self._seen.spacing_m

    @property
    def revision(self) -> int:
        """Grows by one with every change of the set of edge points."""
        return self._seen.revision

    @property
    def last_removal_revision(self) -> int:
        """The last revision at which edge points were taken away again; 0 where none ever was."""
        return self._seen.last_removal_revision

    @property
    def moving(self) -> tuple[MovingEdges, ...]:
        """What is known to move; its edges are not among the others."""
        return self._seen.moving

    @property
    def last_contradiction_s(self) -> float:
        """When something last stood, or seemed to stand, in space that had been seen to be free; -inf: never."""
        return self._seen.last_contradiction_s

    def edges_since(self, revision: int) -> FloatArray:
        """(k, 2) read-only edge points that came in after `revision`, oldest first; all of them after -1."""
        points = self._seen.edges_since(revision).view()
        points.flags.writeable = False
        return points

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        """(k,) whether each of (k, 2) points lies in space seen to be free."""
        return self._seen.seen_free(points_m)

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """(k,) distance of each of (k, 2) points to the nearest edge point, moving ones as last seen; +inf: none."""
        return self._nearest.distance_m(points_m)


class NearestEdge:
    """Distances to the edge points of a map; its search tree is built anew when the map has changed.

    Args:
        seen: the map.
    """

    def __init__(self, seen: MapView) -> None:
        self._seen = seen
        self._tree: shapely.STRtree | None = None
        self._built_for: tuple[int, tuple[MovingEdges, ...]] = -1, ()

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """(k,) distance of each of (k, 2) points to the nearest edge point; +inf where there is none."""
        import shapely

        now = self._seen.revision, self._seen.moving
        if self._tree is None or now != self._built_for:
            edges = [self._seen.edges_since(-1), *(each.points_m for each in self._seen.moving)]
            self._tree, self._built_for = shapely.STRtree(shapely.points(np.concatenate(edges))), now
        points = shapely.points(np.asarray(points_m, dtype=np.float64).reshape(-1, 2))
        found_m = np.full(len(points), np.inf)
        if len(self._tree):
            (rows, _), distances_m = self._tree.query_nearest(points, all_matches=False, return_distance=True)
            found_m[rows] = distances_m
        return found_m
