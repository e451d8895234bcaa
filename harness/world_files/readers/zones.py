"""Geozones for unmanned aircraft: EUROCAE ED-269 (2020), and ED-318, which is GeoJSON with layers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from harness.files.wording import counted
from harness.world_files.bounded import json_of
from harness.world_files.parts import NO_BOTTOM, NO_TOP, WGS84, Contents, Limit, Part, Reading
from harness.world_files.parts import WorldFileError as Fault
from harness.world_files.readers import limits
from harness.world_files.readers.footprints import circle
from harness.world_files.readers.geo_json import features_of, polygon_of, simple, whole

UNITS: Final = {"": "m", "m": "m", "ft": "ft", "feet": "ft", "fl": "fl"}
"""Units of limits by the names that files use."""
PASSED: Final = (
    ("empty", "zone", "without a geometry passed over"),
    ("flat", "geometry", "without an area passed over"),
    ("free", "zone", "without restriction passed over"),
    ("at times", "zone", "that apply at times only taken as always there"),
)
"""What is said of zones that are passed over or simplified."""


def read_ed269(path: Path, reading: Reading) -> Contents:
    """Reads all zones of ED-269 but those without restriction, whatever the time."""
    content = json_of(path)
    if isinstance(content, dict):
        content = content.get("features", content.get("UASZoneList"))
    if not isinstance(content, list):
        raise Fault("has neither features nor UASZoneList; must be ED-269")
    notes: list[str] = []
    parts: list[Part] = []
    told = Counter[str]()
    for zone in content:
        if not isinstance(zone, dict) or not isinstance(zone.get("geometry"), list):
            raise Fault("has a zone without a list `geometry`; must be ED-269")
        if _is_passed(zone.get("restriction"), zone["geometry"], told):
            continue
        told["at times"] += _is_at_times(zone.get("applicability") or ())
        name = str(zone.get("identifier") or zone.get("name") or "")[:40]
        parts += [_ed269_part(each, name, notes) for each in zone["geometry"]]
    return _contents("ed269", parts, told, notes)


def _is_at_times(applicability: Any) -> bool:
    """Whether a zone of ED-269 applies at times only."""
    times = (applicability,) if isinstance(applicability, dict) else applicability
    return any(
        isinstance(each, dict) and (each.get("permanent") == "NO" or "schedule" in each) for each in times
    )


def _ed269_part(volume: Any, name: str, notes: list[str]) -> Part:
    projection = volume.get("horizontalProjection") if isinstance(volume, dict) else None
    if not isinstance(projection, dict):
        raise Fault(f"has zone {name!r} without a horizontalProjection")
    round_ = projection.get("type") == "Circle"
    shape = _disc(projection.get("center"), projection.get("radius")) if round_ else polygon_of(projection)
    if shape is None:
        raise Fault(f"has zone {name!r} whose projection is neither a circle nor a polygon with an area")
    if round_ and _unit(volume.get("uomDimensions")) != "m":
        notes.append(f"{name or 'a zone'}: its radius is taken as metres, its limits as feet")
    band = _band(volume, volume.get("uomDimensions"), ("Limit", "VerticalReference"), notes, name)
    return Part(shape, *band, name=name)


def read_ed318(path: Path, reading: Reading) -> Contents:
    """Reads all zones of ED-318: each geometry has a layer, and a circle is a point with an extent."""
    notes: list[str] = []
    parts: list[Part] = []
    told = Counter[str]()
    for tags, geometry in features_of(whole(path)):
        if _is_passed(str(tags.get("type", "")).upper(), geometry, told):
            continue
        told["at times"] += bool(tags.get("limitedApplicability"))
        name = limits.name_of(tags)
        for one in simple(geometry):
            extent, layer = one.get("extent"), one.get("layer") or {}
            if isinstance(extent, dict) and one.get("type") == "Point":
                shape = _disc(one.get("coordinates"), extent.get("radius"))
            else:
                shape = polygon_of(one)
            if not isinstance(layer, dict):
                raise Fault(f"has zone {name!r} whose layer is no mapping; must be ED-318")
            if shape is None:
                told["flat"] += 1
            else:
                band = _band(layer, layer.get("uom"), ("", "Reference"), notes, name)
                parts.append(Part(shape, *band, name=name))
    return _contents("ed318", parts, told, notes)


def _is_passed(restriction: Any, geometry: Any, told: Counter[str]) -> bool:
    """Whether a zone is passed over, as it forbids nothing or has no geometry; it is counted."""
    why = "free" if restriction == "NO_RESTRICTION" else "" if geometry else "empty"
    told[why] += 1
    return bool(why)


def _contents(kind: str, parts: list[Part], told: Counter[str], notes: list[str]) -> Contents:
    if not parts:
        raise Fault("has no zone with an area that forbids something; must have some")
    notes += [f"{counted(told[why], what)} {sentence}" for why, what, sentence in PASSED if told[why]]
    return Contents(kind, WGS84, tuple(parts), notes=tuple(notes))


def _disc(center: Any, radius: Any) -> Any:
    metres = limits.metres_of(radius)
    if metres is None:
        raise Fault("has a circle without a radius")
    try:
        east, north = (float(each) for each in center[:2])
    except (TypeError, ValueError) as error:
        raise Fault("has a circle whose centre is not two numbers") from error
    return circle((east, north), metres)


def _band(
    says: Mapping[str, Any], unit: Any, ends: tuple[str, str], notes: list[str], name: str
) -> tuple[Limit, Limit]:
    """Bottom and top of a zone; `ends` are what follows `lower` and `upper` in the names of limit and reference."""
    found: list[Limit | None] = []
    for side, none in (("lower", NO_BOTTOM), ("upper", NO_TOP)):
        value, reference = says.get(f"{side}{ends[0]}"), str(says.get(f"{side}{ends[1]}") or "")
        told = limits.limit_told(value, f"{_unit(unit)} {reference}", notes, name)
        found.append(none if value is None else told)
    return limits.band_of(found[0], found[1], notes, name)


def _unit(name: Any) -> str:
    word = str(name or "").strip().lower()
    if word not in UNITS:
        raise Fault(f"has limits in {word[:20]!r}; must be in m, ft or FL")
    return UNITS[word]
