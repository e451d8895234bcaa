"""The map as a planner under the shield sees it: places that were refused while it was stuck are edge points too.

A planner that does not read `PlanRequest.refused` learns from its map where not to go on.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from planner.geometry.curves import Point
from planner.interface import FloatArray, MapView
from planner.nearest_edge import distance_to_edges


def with_places(seen: MapView, places: Sequence[tuple[int, Point]]) -> MapView:
    """A map with more edge points than its own: `places` are the map's revision before each, and where it is."""
    return cast(MapView, _MapWithPlaces(seen, places)) if places else seen


class _MapWithPlaces:
    """A map view with places added; each counts as one more revision."""

    def __init__(self, seen: MapView, places: Sequence[tuple[int, Point]]) -> None:
        self._map, self._places = seen, tuple(places)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._map, name)

    @property
    def revision(self) -> int:
        """The revision of the map and one more for each place."""
        return self._map.revision + len(self._places)

    @property
    def last_removal_revision(self) -> int:
        """The map's own, counted with all places; 0 where no edge point was ever removed."""
        last = self._map.last_removal_revision
        return last + len(self._places) if last else 0

    def edges_since(self, revision: int) -> FloatArray:
        """(k, 2) places added and edge points seen after a revision."""
        known = sum(at + i < revision for i, (at, _) in enumerate(self._places))
        fresh = np.array([place for _, place in self._places[known:]]).reshape(-1, 2)
        return np.concatenate((fresh, self._map.edges_since(revision - known)))

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        return distance_to_edges(cast(MapView, self), points_m)
