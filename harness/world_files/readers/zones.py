"""Geozones for unmanned aircraft: EUROCAE ED-269 (2020), and ED-318, which is GeoJSON with layers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from harness.files.wording import counted
from harness.world_files.bounded import json_of
from harness.world_files.parts import FOOT_M, NO_BOTTOM, NO_TOP, WGS84, Contents, Datum, Limit, Part, Reading
from harness.world_files.parts import WorldFileError as Fault
from harness.world_files.readers import limits
from harness.world_files.readers.footprints import circle
from harness.world_files.readers.geo_json import features_of, polygon_of, simple, whole
from harness.world_files.readers.lengths import metres_of, names_unit

FLIGHT_LEVEL_M: Final = 100.0 * FOOT_M
UNITS_M: Final = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("ft", "f", "foot", "feet"), FOOT_M),
    "fl": FLIGHT_LEVEL_M,
}
"""Lengths in metres of the units of limits."""
FREE: Final = "NO_RESTRICTION"
"""Restriction of a zone that forbids nothing."""


def read_ed269(path: Path, reading: Reading) -> Contents:
    """Reads all zones of ED-269 but those without restriction, whatever the time.

    Raises:
        WorldFileError: it is not ED-269, or has no zone.
    """
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
        times = zone.get("applicability") or ()
        kind = _kind(zone.get("restriction"), zone["geometry"])
        told[kind] += 1
        if kind:
            continue
        told["at times"] += any(
            isinstance(each, dict) and (each.get("permanent") == "NO" or "schedule" in each)
            for each in ((times,) if isinstance(times, dict) else times)
        )
        name = str(zone.get("identifier") or zone.get("name") or "")[:40]
        parts += [_ed269_part(each, name, notes) for each in zone["geometry"]]
    return _contents("ed269", parts, told, notes)


def _ed269_part(volume: Any, name: str, notes: list[str]) -> Part:
    projection = volume.get("horizontalProjection") if isinstance(volume, dict) else None
    if not isinstance(projection, dict):
        raise Fault(f"has zone {name!r} without a horizontalProjection")
    round_ = projection.get("type") == "Circle"
    footprint = (
        _disc(projection.get("center"), projection.get("radius")) if round_ else polygon_of(projection)
    )
    if footprint is None:
        raise Fault(f"has zone {name!r} whose projection is neither a circle nor a polygon with an area")
    if round_ and _unit_m(volume.get("uomDimensions")) != 1.0:
        notes.append(f"{name or 'a zone'}: its radius is taken as metres, its limits as feet")
    band = _band(volume, volume.get("uomDimensions"), ("Limit", "VerticalReference"), notes, name)
    return Part(footprint, *band, name=name)


def read_ed318(path: Path, reading: Reading) -> Contents:
    """Reads all zones of ED-318: each geometry has a layer, and a circle is a point with an extent.

    Raises:
        WorldFileError: it is not ED-318, or has no zone.
    """
    notes: list[str] = []
    parts: list[Part] = []
    told = Counter[str]()
    for tags, geometry in features_of(whole(path)):
        kind = _kind(str(tags.get("type", "")).upper(), geometry)
        told[kind] += 1
        if kind:
            continue
        told["at times"] += bool(tags.get("limitedApplicability"))
        name = limits.name_of(tags)
        for one in simple(geometry):
            extent, layer = one.get("extent"), one.get("layer")
            disc = isinstance(extent, dict) and one.get("type") == "Point"
            footprint = _disc(one.get("coordinates"), extent.get("radius")) if disc else polygon_of(one)  # type: ignore[union-attr]
            if footprint is None:
                told["flat"] += 1
                continue
            layer = layer if isinstance(layer, dict) else {}
            parts.append(
                Part(footprint, *_band(layer, layer.get("uom"), ("", "Reference"), notes, name), name=name)
            )
    return _contents("ed318", parts, told, notes)


def _kind(restriction: Any, geometry: Any) -> str:
    """Why a zone is passed over; empty where it is not."""
    return "free" if restriction == FREE else "" if geometry else "empty"


def _contents(kind: str, parts: list[Part], told: Counter[str], notes: list[str]) -> Contents:
    if not parts:
        raise Fault("has no zone with an area that forbids something; must have some")
    for why, what, sentence in (
        ("empty", "zone", "without a geometry passed over"),
        ("flat", "geometry", "without an area passed over"),
        ("free", "zone", "without restriction passed over"),
        ("at times", "zone", "that apply at times only taken as always there"),
    ):
        if told[why]:
            notes.append(f"{counted(told[why], what)} {sentence}")
    return Contents(kind, WGS84, tuple(parts), notes=tuple(notes))


def _disc(center: Any, radius: Any) -> Any:
    metres = metres_of(radius)
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
    for word, none in (("lower", NO_BOTTOM), ("upper", NO_TOP)):
        value = says.get(f"{word}{ends[0]}")
        reference = str(says.get(f"{word}{ends[1]}") or "").upper()
        found.append(none if value is None else _limit(value, reference, _unit_m(unit), notes, name))
    return limits.band_of(found[0], found[1], notes, name)


def _unit_m(name: Any) -> float:
    word = str(name or "m").strip().lower()
    if word not in UNITS_M:
        raise Fault(f"has limits in {word[:20]!r}; must be in m, ft or FL")
    return UNITS_M[word]


def _limit(value: Any, reference: str, unit_m: float, notes: list[str], name: str) -> Limit | None:
    """A limit above ground (AGL) or above mean sea level (AMSL, flight levels; WGS84 is taken for it)."""
    number = metres_of(value)
    if number is None:
        return None
    level = unit_m == FLIGHT_LEVEL_M
    ground = reference in ("AGL", "SFC", "GND") and not level
    if ground and number == 0.0:
        return NO_BOTTOM
    if not ground and not level and reference not in ("AMSL", "MSL"):
        told = "are above the ellipsoid" if reference in ("WGS84", "W84", "HAE") else "name no reference"
        note = f"{name or 'a zone'}: its limits {told}; taken as above mean sea level"
        notes += [] if note in notes[-1:] else [note]
    return Limit(number if names_unit(value) else number * unit_m, Datum.GROUND if ground else Datum.SEA)
