"""ED-269 geozones (EUROCAE ED-269, 2020): features with horizontal projections between two limits."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from harness.files.wording import counted
from harness.world_files.bounded import json_of
from harness.world_files.parts import NO_BOTTOM, NO_TOP, WGS84, Contents, Limit, Part, Reading, WorldFileError
from harness.world_files.readers import limits, rings
from harness.world_files.readers.geo_json import (
    FREE,
    footprint_of,
    limit_unit_m,
    places_of,
    radius_of,
    zone_limit,
)

LISTS: Final = ("features", "UASZoneList")
"""What the list of zones is called, where the file is not the list itself."""


def read(path: Path, reading: Reading) -> Contents:
    """Reads all zones, whatever the time: applicability is not looked at.

    Raises:
        WorldFileError: it is not ED-269, or has no zone.
    """
    content = json_of(path)
    if isinstance(content, list):
        content = {"features": content}
    zones = None
    if isinstance(content, dict):
        zones = next((content[key] for key in LISTS if isinstance(content.get(key), list)), None)
    if zones is None:
        raise WorldFileError("has neither features nor UASZoneList; must be ED-269")
    notes: list[str] = []
    parts: list[Part] = []
    free = timed = empty = 0
    for zone in zones:
        if not isinstance(zone, dict) or not isinstance(zone.get("geometry"), list):
            raise WorldFileError("has a zone without a list `geometry`; must be ED-269")
        if zone.get("restriction") in FREE:
            free += 1
            continue
        if not zone["geometry"]:
            empty += 1
            continue
        times = zone.get("applicability") or ()
        timed += any(
            isinstance(each, dict) and (each.get("permanent") == "NO" or "schedule" in each)
            for each in ((times,) if isinstance(times, dict) else times)
        )
        name = str(zone.get("identifier") or zone.get("name") or "")[:40]
        parts += [_part(each, name, notes) for each in zone["geometry"]]
    if not parts:
        raise WorldFileError("has no zone with a geometry; must have some")
    if empty:
        notes.append(f"{counted(empty, 'zone')} without a geometry passed over")
    if free:
        notes.append(f"{counted(free, 'zone')} without restriction passed over")
    if timed:
        notes.append(f"{counted(timed, 'zone')} that apply at times only taken as always there")
    return Contents("ed269", WGS84, tuple(parts), notes=tuple(notes))


def _part(volume: Any, name: str, notes: list[str]) -> Part:
    projection = volume.get("horizontalProjection") if isinstance(volume, dict) else None
    if not isinstance(projection, dict):
        raise WorldFileError(f"has zone {name!r} without a horizontalProjection")
    if projection.get("type") == "Circle":
        footprint = rings.circle(
            places_of([projection.get("center")])[0], radius_of(projection.get("radius"))
        )
    else:
        footprint = footprint_of(projection)
    if footprint is None:
        raise WorldFileError(
            f"has zone {name!r} whose projection is neither a circle nor a polygon with an area"
        )
    unit_m = limit_unit_m(volume.get("uomDimensions"))
    if unit_m != 1.0 and projection.get("type") == "Circle":
        notes.append(f"{name or 'a zone'}: its radius is taken as metres, its limits as feet")
    found: list[Limit | None] = []
    for word, none in (("lower", NO_BOTTOM), ("upper", NO_TOP)):
        value = volume.get(f"{word}Limit")
        reference = str(volume.get(f"{word}VerticalReference") or "")
        found.append(none if value is None else zone_limit(value, reference, unit_m, notes, name))
    return Part(footprint, *limits.band_of(found[0], found[1], notes, name), name=name)
