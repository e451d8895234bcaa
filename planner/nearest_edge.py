"""Distance to the nearest edge point of a map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.interface import FloatArray, MapView, MovingEdges

if TYPE_CHECKING:
    import shapely


class NearestEdge:
    """Distances to the edge points of a map; its search tree is built anew when the map has changed."""

    def __init__(self, seen: MapView) -> None:
        self._map = seen
        self._tree: shapely.STRtree | None = None
        self._built_for: tuple[int, tuple[MovingEdges, ...]] = -1, ()

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """(k,) distance of each of (k, 2) points to the nearest edge point; +inf where there is none."""
        import shapely

        now = self._map.revision, self._map.moving
        if self._tree is None or now != self._built_for:
            edges = [self._map.edges_since(-1), *(each.points_m for each in self._map.moving)]
            self._tree, self._built_for = shapely.STRtree(shapely.points(np.concatenate(edges))), now
        points = shapely.points(np.asarray(points_m, dtype=np.float64).reshape(-1, 2))
        found_m = np.full(len(points), np.inf)
        if len(self._tree):
            (rows, _), distances_m = self._tree.query_nearest(points, all_matches=False, return_distance=True)
            found_m[rows] = distances_m
        return found_m


def distance_to_edges(seen: MapView, points_m: FloatArray) -> FloatArray:
    """(k,) distances to the nearest edge point, +inf where there is none; serves a map as its `distance_m`."""
    return NearestEdge(seen).distance_m(points_m)
