"""Geozones for unmanned aircraft: EUROCAE ED-269 (2020), and ED-318, which is GeoJSON with layers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

from harness.files.input_file import InputError, numbers
from harness.files.wording import counted
from harness.world_files.bounded import json_of
from harness.world_files.parts import WGS84, Contents, FileSpec, Part
from harness.world_files.readers import limits
from harness.world_files.readers.footprints import circle, on_earth
from harness.world_files.readers.maps import features_of, polygon_of, simple

UNITS: Final = {"": "m", "m": "m", "ft": "ft", "feet": "ft", "fl": "fl"}  # by the name in the file
NOTES: Final = (  # on zones passed over or simplified, by the key under which they are counted
    ("empty", "zone", "without a geometry passed over"),
    ("flat", "geometry", "without an area passed over"),
    ("free", "zone", "without restriction passed over"),
    ("at times", "zone", "that apply at times only taken as always there"),
)


class _Zones:
    """The zones of a file while it is read: parts, notes, and how many are passed over or simplified."""

    def __init__(self, ends: tuple[str, str]) -> None:
        self._ends = ends  # what follows `lower` and `upper` in the names of limit and reference
        self.parts: list[Part] = []
        self.notes: list[str] = []
        self.passed = Counter[str]()

    def passes(self, restriction: Any, geometry: Any, at_times: bool) -> bool:
        """Counts a zone, and tells whether it is passed over because it forbids nothing or has no geometry."""
        why = "free" if restriction == "NO_RESTRICTION" else "" if geometry else "empty"
        self.passed[why] += 1
        self.passed["at times"] += at_times and not why
        return bool(why)

    def add(self, shape: Any, says: Mapping[str, Any], unit: str, name: str) -> None:
        found = []
        for side in ("lower", "upper"):
            value, reference = (says.get(f"{side}{end}") for end in self._ends)
            found.append(limits.read_limit(value, f"{unit} {reference or ''}", self.notes, name))
        self.parts.append(Part(shape, *limits.band_of(found[0], found[1], self.notes, name), name=name))

    def contents(self) -> Contents:
        if not self.parts:
            raise InputError("has no zone with an area that forbids something; must have some")
        notes = [f"{counted(self.passed[why], noun)} {says}" for why, noun, says in NOTES if self.passed[why]]
        return Contents(WGS84, tuple(self.parts), notes=(*self.notes, *notes))


def read_ed269(spec: FileSpec) -> Contents:
    """Reads the zones of an ED-269 file, whatever their times, except those without restriction."""
    if isinstance((content := json_of(spec.path)), dict):
        content = content.get("features", content.get("UASZoneList"))
    if not isinstance(content, list):
        raise InputError("has neither features nor UASZoneList; must be ED-269")
    found = _Zones(("Limit", "VerticalReference"))
    for zone in content:
        if not isinstance(zone, dict) or not isinstance(zone.get("geometry"), list):
            raise InputError("has a zone without a list `geometry`; must be ED-269")
        times = zone.get("applicability") or ()
        times = [times] if isinstance(times, dict) else times
        at_times = any(isinstance(t, dict) and (t.get("permanent") == "NO" or "schedule" in t) for t in times)
        passed = found.passes(zone.get("restriction"), zone["geometry"], at_times)
        for volume in () if passed else zone["geometry"]:
            _add_volume(found, volume, str(zone.get("identifier") or zone.get("name") or "")[:40])
    return found.contents()


def _add_volume(found: _Zones, volume: Any, name: str) -> None:
    projection = volume.get("horizontalProjection") if isinstance(volume, dict) else None
    if not isinstance(projection, dict):
        raise InputError(f"has zone {name!r} without a horizontalProjection")
    unit, is_round = _unit(volume.get("uomDimensions"), name), projection.get("type") == "Circle"
    if is_round and unit != "m":
        found.notes.append(f"{name}: its radius is taken as metres, its limits as {unit}")
    at = f"zone {name!r}: horizontalProjection"
    if (shape := _disc(projection, "center", name) if is_round else polygon_of(projection, at)) is None:
        raise InputError(f"has zone {name!r} whose projection is neither a circle nor a polygon with an area")
    found.add(shape, volume, unit, name)


def read_ed318(spec: FileSpec) -> Contents:
    """Reads the zones of an ED-318 file: each geometry has a layer, and a circle is a point with an extent."""
    found = _Zones(("", "Reference"))
    for tags, geometry, key in features_of(json_of(spec.path)):
        name, at_times = limits.name_of(tags), bool(tags.get("limitedApplicability"))
        passed = found.passes(str(tags.get("type", "")).upper(), geometry, at_times)
        for one, at in () if passed else simple(geometry, key):
            extent, layer = one.get("extent"), one.get("layer") or {}
            if not isinstance(layer, dict):
                raise InputError(f"has zone {name!r} whose layer is no mapping; must be ED-318")
            if isinstance(extent, dict) and one.get("type") == "Point":
                shape = _disc({**extent, **one}, "coordinates", name)
            else:
                shape = polygon_of(one, at)
            if shape is None:
                found.passed["flat"] += 1
            else:
                found.add(shape, layer, _unit(layer.get("uom"), name), name)
    return found.contents()


def _disc(says: Mapping[str, Any], center: str, name: str) -> Any:
    if (metres := limits.metres_of(says.get("radius"))) is None:
        raise InputError(f"zone {name!r}: has a circle without a radius")
    east, north, *_ = numbers(says.get(center), f"zone {name!r}: {center}", "[longitude, latitude]", (2, 3))
    return circle(on_earth(east, north), metres)


def _unit(given: Any, name: str) -> str:
    if (unit := str(given or "").strip().lower()) not in UNITS:
        raise InputError(f"zone {name!r}: has limits in {unit[:20]!r}; must be in m, ft or FL")
    return UNITS[unit]
