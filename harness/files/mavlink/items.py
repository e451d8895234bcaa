"""Mission items and fences as files hold them: "QGC WPL" (.waypoints, .txt), and the geoFence of a QGroundControl plan.

https://mavlink.io/en/file_formats/#mission_plain_text_file, https://mavlink.io/en/services/mission.html#mission_types
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from harness.files.input_file import InputError, finite, listed, numbers, shown, whole
from harness.files.mavlink import commands
from harness.files.mavlink.commands import CIRCLES, CORNERS, HOME_CIRCLE

if TYPE_CHECKING:
    from shapely import Geometry

SEA, HOME, GROUND = "sea", "home", "ground"
MISSION: Final = 2  # MAV_FRAME without a place: ArduPilot takes altitudes as above the sea, PX4 refuses them
FRAMES: Final = {0: SEA, 5: SEA, MISSION: SEA, 3: HOME, 6: HOME, 10: GROUND, 11: GROUND}
"""The datum of the altitude for each MAV_FRAME. Autopilots load no item to fly to in any other global frame."""
NOWHERE_DEG: Final = 1e-7  # no position has less in both; ArduPilot writes zeros where none is meant
WPL: Final = "QGC WPL"  # first word of a mission file in plain text
WPL_FIELDS: Final = 12  # number of fields in a line of such a file
GEOFENCE_KEYS: Final = ("polygons", "circles", "breachReturn", "version", "polygon")  # keys of a geofence
Place = tuple[float, float]
Keys = dict[str, Any]
CIRCLE_SIDES: Final = 720  # a circle is compared as a polygon of so many sides: one of 10 km is off by 0.1 m


@dataclass(frozen=True)
class Item:
    """One mission item: its place in its file for messages, number in the mission, MAV_CMD, MAV_FRAME, parameters."""

    place: str
    number: int
    command: int
    frame: int
    params: tuple[float, ...]  # 5 to 7: latitude, longitude, altitude; 0 is left to the autopilot
    autocontinue_off: bool = False  # the autopilot waits after it to be told to go on

    def __post_init__(self) -> None:
        for name, value, most in (("command", self.command, 65_535), ("frame", self.frame, 255)):
            if not 0 <= value <= most:
                raise InputError(f"{self.place}: has the {name} {value:g}; those of MAVLink are 0 to {most}")

    @property
    def position(self) -> tuple[float, float] | None:
        """Latitude and longitude; None where it has none."""
        latitude, longitude = self.params[4:6]
        return None if max(abs(latitude), abs(longitude)) < NOWHERE_DEG else (latitude, longitude)

    @property
    def above(self) -> str:
        """The datum of its altitude; an InputError says that its frame has none."""
        if self.frame not in FRAMES:
            wanted = f"{', '.join(map(str, sorted(FRAMES)))} (a path in local metres can be given as CSV)"
            reason = f"item {self.number} has the frame {self.frame}; must be one of {wanted}"
            raise InputError(f"{self.place}: {reason}")
        return FRAMES[self.frame]


def filled(
    params: Sequence[float | None], command: int, frame: int, missing: Callable[[int], str]
) -> tuple[float, ...]:
    """Returns seven parameters, 0 for None; an InputError names what of a place, or an altitude, is `missing`."""
    latitude, longitude, altitude = params[4:7]
    if command in commands.FLOWN and (latitude is None) != (longitude is None):
        raise InputError(f"{missing(4 if latitude is None else 5)}; a place must have latitude and longitude")
    needed = command in commands.AT_AN_ALTITUDE
    needed |= command in commands.LOITERS and latitude is not None
    needed |= command in commands.LANDINGS and FRAMES.get(frame) != HOME
    if altitude is None and needed:
        raise InputError(f"{missing(6)}; a {commands.name_of(command)} must have an altitude")
    return tuple(0.0 if value is None else value for value in params)


def wpl_items(text: str, source: str) -> list[Item]:
    """Reads the items of a plain-text file, home among them, without comments (#). `source` begins an InputError."""
    where = f"{source}:" if source else "line "
    header, *lines = text.splitlines() or [""]
    if (begin := " ".join(header.split())) != f"{WPL} 110":
        raise InputError(f'{where}1: is {shown(begin)!r}; must be "{WPL} 110", as a mission begins')
    rows = [(f"{where}{number}", line.split()) for number, line in enumerate(lines, start=2)]
    return [_item(cells, place) for place, cells in rows if cells and not cells[0].startswith("#")]


def _item(cells: list[str], place: str) -> Item:
    if len(cells) != WPL_FIELDS:
        raise InputError(f"{place}: has {len(cells)} fields; a mission item has {WPL_FIELDS}")
    number, frame, command = (whole(cells[at], f"{place}: field {at + 1}", text=True) for at in (0, 2, 3))
    # What is left to the autopilot is 0, or no number; the first parameter is field 5, counted from 1.
    given = [
        None if cell.lower() == "nan" else finite(cell, f"{place}: field {field}", text=True)
        for field, cell in enumerate(cells[4:11], start=5)
    ]
    params = filled(given, command, frame, lambda index: f"{place}: field {5 + index} is nan")
    waits = finite(cells[11], f"{place}: field 12", text=True) == 0.0
    return Item(place, number, command, frame, params, waits)


@dataclass(frozen=True)
class Fence:
    """An area to stay inside of, or out of, named by its place in its file; in metres, or degrees while it is read."""

    name: str
    inclusion: bool
    rings: tuple[tuple[Place, ...], ...] = ()  # the outer one and its holes, none for a circle
    center: Place | None = None
    radius_m: float = 0.0

    @property
    def kind(self) -> str:
        """`inclusion` or `exclusion`."""
        return "inclusion" if self.inclusion else "exclusion"

    @property
    def places(self) -> tuple[Place, ...]:
        """All its corners, or its centre."""
        return tuple(each for ring in self.rings for each in ring) if self.center is None else (self.center,)

    @cached_property
    def area(self) -> Geometry:
        """The polygon or disc that it encloses."""
        import shapely

        if self.center is not None:
            return shapely.Point(self.center).buffer(self.radius_m, quad_segs=CIRCLE_SIDES // 4)
        return shapely.Polygon(self.rings[0], self.rings[1:])

    def moved(self, place: Callable[[Place], Place]) -> Fence:
        """Returns the fence with every position mapped by `place`."""
        rings = tuple(tuple(map(place, ring)) for ring in self.rings)
        return replace(self, rings=rings, center=place(self.center) if self.center is not None else None)

    def plain(self) -> dict[str, Any]:
        """Returns its content for `metrics.json`."""
        shape: dict[str, Any] = {"rings_m": [[list(point) for point in ring] for ring in self.rings]}
        if self.center is not None:
            shape = {"center_m": list(self.center), "radius_m": self.radius_m}
        return {"name": self.name, "kind": self.kind, **shape}


def plan_fences(plan: Keys, source: str) -> tuple[tuple[Fence, ...], bool, int]:
    """Returns fences of a plan (degrees), whether all inclusions hold, and its rally points; `source` begins faults."""
    inner = {"": plan, **{key: plan.get(key) for key in ("geoFence", "mission", "rallyPoints")}}
    for (key, value), newest in zip(inner.items(), (1, 2, 2, 2), strict=True):  # their versions
        if not isinstance(value, dict | None):
            raise InputError(f"{source}{key}: must be a mapping")
        at = f"{source}{key}.version" if key else f"{source}version"
        if (version := whole((value or {}).get("version") or 1, at)) > newest:
            raise InputError(f"{at}: is {version}; must be at most {newest}, the newest that is read")
    _, geofence, mission, rally = (value or {} for value in inner.values())
    firmware = mission.get("firmwareType")
    is_px4 = firmware is not None and whole(firmware, f"{source}mission.firmwareType") == commands.PX4
    points = listed(rally.get("points") or [], f"{source}rallyPoints.points")
    return _geofence(geofence, source), not is_px4, len(points)


def _geofence(geofence: Keys, source: str) -> tuple[Fence, ...]:
    for key in (key for key, value in geofence.items() if value and key not in GEOFENCE_KEYS):
        raise InputError(f"{source}geoFence.{shown(key)}: is not known; must be one of {', '.join(GEOFENCE_KEYS)}")
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
    if not isinstance(circle := each.get("circle"), dict):
        raise InputError(f"{source}{key}.circle: must have center and radius")
    if not (radius := finite(circle.get("radius"), f"{source}{key}.circle.radius")) > 0.0:
        raise InputError(f"{source}{key}.circle.radius: is {radius:g}; must be greater than 0")
    center = _place(circle.get("center"), f"{source}{key}.circle.center")
    return Fence(key, each["inclusion"], center=center, radius_m=radius)


def _place(value: Any, where: str) -> Place:
    latitude, longitude, *_ = numbers(value, where, "[latitude, longitude]", (2, 3))
    return latitude, longitude


def item_fences(items: Sequence[Item], home: Place | None) -> tuple[Fence, ...]:
    """Returns the fences among items, in degrees; an InputError says that one is torn, or has no radius or place."""
    found: list[Fence] = []
    left = [each for each in items if each.command in (*CORNERS, *CIRCLES)]
    while left:
        first, wanted = left[0], left[0].params[0]
        corners = left[: max(math.ceil(wanted), 1)]
        if first.command in CIRCLES:
            corners = [first]
            found.append(_item_circle(first, home))
        elif (count := [each.command for each in corners].count(first.command)) < max(wanted, len(corners)):
            begun = f"{first.place}: item {first.number} begins a fence of {wanted:g} corners"
            raise InputError(f"{begun}, of which {count} follow; it may be torn")
        else:
            ring = tuple((each.params[4], each.params[5]) for each in corners)
            name = f"items {first.number} to {corners[-1].number}"
            found.append(Fence(name, CORNERS[first.command], (ring,)))
        left = left[len(corners) :]
    return tuple(found)


def _item_circle(item: Item, home: Place | None) -> Fence:
    radius, subject = item.params[0], f"{item.place}: item {item.number} is a fence"
    if not radius > 0.0:
        raise InputError(f"{subject} of radius {radius:g} m; must be greater than 0")
    if (center := home if item.command == HOME_CIRCLE else (item.params[4], item.params[5])) is None:
        raise InputError(f"{subject} about home, which has no position; give a circle with a place")
    return Fence(f"item {item.number}", CIRCLES[item.command], center=center, radius_m=radius)
