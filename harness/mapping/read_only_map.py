"""The map as a planner is handed it, which can be read and not changed."""

from __future__ import annotations

from operator import attrgetter
from typing import NoReturn

from planner.interface import BoolArray, FloatArray, MapView


class ReadOnlyMap:
    """A map through which nothing can be changed (`planner.interface.MapView`).

    It guards against mistakes. Code in the same process that means to reach what is behind it can always do so.
    """

    __slots__ = ("_map",)

    _map: MapView

    def __init__(self, seen: MapView) -> None:
        object.__setattr__(self, "_map", seen)

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"{name[:100]} of the map cannot be set: a planner may only read what was seen")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"{name[:100]} of the map cannot be deleted: a planner may only read what was seen")

    spacing_m = property(attrgetter("_map.spacing_m"))
    revision = property(attrgetter("_map.revision"))
    last_removal_revision = property(attrgetter("_map.last_removal_revision"))
    moving = property(attrgetter("_map.moving"))
    last_contradiction_s = property(attrgetter("_map.last_contradiction_s"))

    def edges_since(self, revision: int) -> FloatArray:
        """(k, 2) read-only edge points that came in after `revision`, oldest first; all of them after -1."""
        points = self._map.edges_since(revision).view()
        points.flags.writeable = False
        return points

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        """(k,) whether each of (k, 2) points lies in space seen to be free."""
        return self._map.seen_free(points_m)

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """(k,) distance of each of (k, 2) points to the nearest edge point, moving ones as last seen; +inf: none."""
        return self._map.distance_m(points_m)
