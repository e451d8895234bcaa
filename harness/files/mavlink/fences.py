"""Fences of autopilots: the geoFence of a QGroundControl plan, and fences that stand among mission items.

Fences and rally points are lists of items of their own (https://mavlink.io/en/services/mission.html#mission_types);
files that ground stations write may hold them together with the mission.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from harness.files.input_file import InputError, finite, listed, numbers
from harness.files.mavlink.commands import CIRCLES, CORNERS, HOME_CIRCLE
from harness.files.mavlink.items import Item

if TYPE_CHECKING:
    from shapely import Geometry

Place = tuple[float, float]
Keys = dict[str, Any]

CIRCLE_SIDES: Final = 720
"""A circle is compared as a polygon of so many sides: one of 10 km is off by 0.1 m."""


@dataclass(frozen=True)
class Fence:
    """An area to stay inside of, or out of; its places are east and north in metres, or degrees while it is read."""

    name: str
    """Its place in its file, for messages."""
    inclusion: bool
    """Whether the aircraft must stay inside; else it must stay out."""
    rings: tuple[tuple[Place, ...], ...] = ()
    """The outer ring and its holes; empty for a circle."""
    center: Place | None = None
    radius_m: float = 0.0

    @property
    def kind(self) -> str:
        """`inclusion` or `exclusion`."""
        return "inclusion" if self.inclusion else "exclusion"

    @property
    def places(self) -> tuple[Place, ...]:
        """All its positions."""
        corners = tuple(place for ring in self.rings for place in ring)
        return corners if self.center is None else (self.center,)

    @cached_property
    def area(self) -> Geometry:
        """The polygon or disc that it encloses."""
        import shapely

        if self.center is not None:
            return shapely.Point(self.center).buffer(self.radius_m, quad_segs=CIRCLE_SIDES // 4)
        return shapely.Polygon(self.rings[0], self.rings[1:])

    def moved(self, place: Callable[[Place], Place]) -> Fence:
        """The same fence with every position put elsewhere."""
        rings = tuple(tuple(map(place, ring)) for ring in self.rings)
        return replace(self, rings=rings, center=place(self.center) if self.center is not None else None)

    def plain(self) -> dict[str, Any]:
        """Its content for `metrics.json`."""
        shape: dict[str, Any] = {"rings_m": [[list(point) for point in ring] for ring in self.rings]}
        if self.center is not None:
            shape = {"center_m": list(self.center), "radius_m": self.radius_m}
        return {"name": self.name, "kind": self.kind, **shape}


def plan_fences(geofence: Any, source: str) -> tuple[Fence, ...]:
    """The geoFence of a plan: polygons and circles, in degrees.

    `source` begins an InputError, `path: ` or nothing: a key is missing, or of another kind.
    """
    if geofence is None:
        return ()
    if not isinstance(geofence, dict):
        raise InputError(f"{source}geoFence: must be a mapping")
    found = []
    if old := geofence.get("polygon"):  # before version 2: one, to stay inside of
        found.append(_polygon({"polygon": old, "inclusion": True}, source, "geoFence"))
    for kind, read in (("polygons", _polygon), ("circles", _circle)):
        for number, each in enumerate(listed(geofence.get(kind) or [], f"{source}geoFence.{kind}")):
            key = f"geoFence.{kind}[{number}]"
            if not isinstance(each, dict) or not isinstance(each.get("inclusion"), bool):
                raise InputError(f"{source}{key}.inclusion: must be true or false")
            found.append(read(each, source, key))
    return tuple(found)


def _polygon(each: Keys, source: str, key: str) -> Fence:
    corners = listed(each.get("polygon"), f"{source}{key}.polygon", " of [latitude, longitude]")
    ring = [_place(corner, f"{source}{key}.polygon[{number}]") for number, corner in enumerate(corners)]
    return Fence(key, each["inclusion"], (tuple(ring),))


def _circle(each: Keys, source: str, key: str) -> Fence:
    circle = each.get("circle")
    if not isinstance(circle, dict):
        raise InputError(f"{source}{key}.circle: must have center and radius")
    radius = finite(circle.get("radius"), f"{source}{key}.circle.radius")
    if not radius > 0.0:
        raise InputError(f"{source}{key}.circle.radius: is {radius:g}; must be greater than 0")
    center = _place(circle.get("center"), f"{source}{key}.circle.center")
    return Fence(key, each["inclusion"], center=center, radius_m=radius)


def _place(value: Any, where: str) -> Place:
    latitude, longitude, *_ = numbers(value, where, "[latitude, longitude]", (2, 3))
    return latitude, longitude


def item_fences(items: Sequence[Item], home: Place | None) -> tuple[Fence, ...]:
    """The fences among some items, in degrees.

    An InputError says that one has fewer corners than it says, or a circle has no radius or no place.
    """
    found: list[Fence] = []
    corners: list[Item] = []
    for item in (each for each in items if each.command in (*CORNERS, *CIRCLES)):
        if corners and item.command != corners[0].command:
            raise _torn(corners)
        if item.command in CIRCLES:
            found.append(_item_circle(item, home))
            continue
        corners.append(item)
        if len(corners) >= corners[0].params[0]:
            ring = tuple((each.params[4], each.params[5]) for each in corners)
            name = f"items {corners[0].number} to {item.number}"
            found.append(Fence(name, CORNERS[item.command], (ring,)))
            corners = []
    if corners:
        raise _torn(corners)
    return tuple(found)


def _torn(corners: Sequence[Item]) -> InputError:
    begun = f"{corners[0].place}: item {corners[0].number} begins a fence of {corners[0].params[0]:g} corners"
    return InputError(f"{begun}, of which {len(corners)} follow; it may be torn")


def _item_circle(item: Item, home: Place | None) -> Fence:
    radius, told = item.params[0], f"{item.place}: item {item.number} is a fence"
    if not radius > 0.0:
        raise InputError(f"{told} of radius {radius:g} m; must be greater than 0")
    center = home if item.command == HOME_CIRCLE else (item.params[4], item.params[5])
    if center is None:
        raise InputError(f"{told} about home, which has no position; give a circle with a place")
    return Fence(f"item {item.number}", CIRCLES[item.command], center=center, radius_m=radius)
