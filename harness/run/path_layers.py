"""Contacts with what files of obstacles hold at the altitudes that were flown: layer by layer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from harness.analysis.breaches import CONTACT, Breach, crossings, inside_m
from harness.flight.record import FloatArray, Track
from harness.scenario.scenario import Scenario

if TYPE_CHECKING:
    from harness.world_files.expansion import FileSpec

LAYER_M: Final = 10.0
"""Depth of a layer: what of a part reaches into it, and into the vertical clearance about it, is solid all through."""

MOST_LAYERS: Final = 40
"""A flight through more has deeper ones."""


def layer_contacts(
    track: Track, scenario: Scenario, files: Sequence[FileSpec]
) -> tuple[tuple[Breach, ...], float]:
    """Contacts with what is solid at the altitudes of a track, and the least distance from it.

    Terrain is left out: contact with it is told from its true height.

    Args:
        track: what was flown.
        scenario: gives the plane, the area and the ground.
        files: those that are cut.
    """
    import shapely

    from harness.world_files.expansion import expanded, loaded_file
    from harness.world_files.plane import Place

    specs = [each for each in files if loaded_file(each.path, each.kind, each.reading).terrain is None]
    if not specs or not len(track):
        return (), math.inf
    origin = scenario.area.origin
    place = Place(origin.latitude_deg, origin.longitude_deg)
    known = None if scenario.ground is None else scenario.ground.field()
    deep = max(LAYER_M, float(np.ptp(track.up_m)) / MOST_LAYERS)
    layer = np.floor(track.up_m / deep).astype(np.int64)
    margins = {spec.path.name: np.full(len(track), np.inf) for spec in specs}
    found: list[Breach] = []
    for number in np.unique(layer).tolist():
        rows = layer == number
        thick = [replace(spec, vertical_clearance_m=spec.vertical_clearance_m + 0.5 * deep) for spec in specs]
        sources = expanded(thick, place, scenario.area.bounds_m, (number + 0.5) * deep, ground=known).sources
        for source in sources:
            if source.polygons:
                solid = shapely.union_all(source.polygons)
                margin: FloatArray = np.where(rows, -inside_m(track, solid), np.inf)
                name = source.spec.path.name
                margins[name] = np.minimum(margins[name], margin)
                found += crossings(track, margin, CONTACT, name, outside_of=solid)
    least = min(float(margin.min()) for margin in margins.values())
    return tuple(found), least
