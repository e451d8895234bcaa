"""Reads a path that somebody gives: a drawn line, a recorded track, or a mission.

What is read is put into the local plane; positions in degrees lie in a plane about the first.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from aircraft.frames import LocalPlane
from harness.files.input_file import InputError, decoded, read_data
from harness.files.kmz import kml_of
from harness.files.wording import counted
from harness.run_files.csv_path import read_csv
from harness.run_files.fences import Fence, Fences, checked
from harness.run_files.geojson_path import read_geojson
from harness.run_files.given_path import SAME_PLACE_M
from harness.run_files.igc_path import read_igc
from harness.run_files.map_paths import read_gpx, read_kml
from harness.run_files.mission.flying import GivenMission
from harness.run_files.mission.items import HOME, MissionAsRead
from harness.run_files.mission.plan_file import read_plan
from harness.run_files.mission.program import program
from harness.run_files.mission.steps import Program
from harness.run_files.mission.wpl_file import WPL, read_waypoints
from harness.run_files.path_as_read import PathAsRead
from harness.scenario.sections import ALTITUDES_M

FloatArray = NDArray[np.float64]
Place = tuple[float, float]

MAX_BYTES: Final = 64_000_000
MAX_SPAN_M: Final = 500e3
JSON_ENDINGS: Final = (".json", ".txt", ".mission")
PACKED: Final = (".kml", ".kmz")
"""Endings of KML files, packed or not."""
PLAN: Final = re.compile(r'"fileType"\s*:\s*"Plan"|"groundStation"\s*:\s*"MissionPlanner"')
"""What stands in every plan of QGroundControl, or mission of Mission Planner in JSON, whatever the name of its file."""


@dataclass(frozen=True, eq=False)
class PathAsGiven:
    """A path as it was given.

    Attributes:
        source: the file, for faults.
        points_m: (n, 2) east, north; every point of the file that has a place.
        origin_deg: latitude and longitude of east = north = 0; None where the file does not say.
        altitudes_m: (n,) above mean sea level; (0,) where the file does not say, and for a mission.
        above_ground: the altitudes are above the ground instead.
        mission: what is flown, where it is a mission; None for a line that is wanted as drawn.
        fences: areas that come with it.
        notes: what else is in the file and does not change the path, a line each.
    """

    source: str
    points_m: FloatArray
    origin_deg: Place | None
    altitudes_m: FloatArray = field(default_factory=lambda: np.zeros(0))
    above_ground: bool = False
    mission: GivenMission | None = None
    fences: Fences = field(default_factory=Fences)
    notes: tuple[str, ...] = ()

    @property
    def drawn(self) -> bool:
        """Whether the line itself is wanted; else it is a mission, whose corners may be cut."""
        return self.mission is None


def read_path(
    path: Path,
    any_altitude: bool = False,
    origin_deg: Place | None = None,
    polygons: str | None = None,
) -> PathAsGiven:
    """Reads a path; the name's ending says how it is written.

    Args:
        path: .csv, .geojson or .json, .kml or .kmz, .gpx, .igc; or a mission: .plan, .waypoints or .txt, .mission.
        any_altitude: the altitudes of a drawn line are left out, for a flight whose altitude is given otherwise.
        origin_deg: latitude and longitude of east = north = 0; None: those of the first point of a path in degrees.
        polygons: what the polygons beside a drawn path are that do not say so themselves: `exclusion`, `inclusion` or
            `none`; None: `exclusion`.

    Raises:
        InputError: the file cannot be read, is not of its format, or holds no path that can be flown.
    """
    suffix = path.suffix.lower()
    if suffix not in (*LINES, *MISSIONS):
        raise InputError(f"{path}: is none of {', '.join((*LINES, *MISSIONS))}; save the path as one of them")
    text, name, notes = _text_of(path, suffix)
    mission = _mission_reader(text, suffix)
    if mission is not None:
        return _mission(mission(text, str(path)), origin_deg)
    found = LINES[suffix](text, name)
    if polygons is not None:
        found = _as_asked(found, polygons)
    if len(found.positions) < 2:
        raise InputError(f"{path}: has {counted(len(found.positions), 'point')}; a path has at least 2")
    origin = None if found.local else origin_deg or found.positions[0]
    _check_degrees(origin, found.positions, lambda place: f"point {place}", str(path))
    origin = _turned(origin)
    points = _in_plane(found.positions, origin)
    _check_span(points, str(path))
    _check_places(points, str(path))
    altitudes = () if any_altitude else found.altitudes_m
    if not found.above_ground:
        _check_altitudes(altitudes, str(path))
    return PathAsGiven(
        source=str(path),
        points_m=points,
        origin_deg=origin,
        altitudes_m=np.array(altitudes),
        above_ground=found.above_ground,
        fences=_fences(found.fences, origin, str(path)),
        notes=(*found.notes, *notes),
    )


def _text_of(path: Path, suffix: str) -> tuple[str, str, tuple[str, ...]]:
    """The text of a path's file, what it is called in faults, and notes on what was packed with it."""
    data = read_data(path, MAX_BYTES, "a path")
    if suffix == ".igc":  # loggers write names in Latin-1
        return data.decode("latin-1"), str(path), ()
    if suffix not in PACKED:
        return decoded(data, str(path), "a path", utf_16=True), str(path), ()
    data, name, notes = kml_of(data, str(path), MAX_BYTES)
    return decoded(data, name, "a path", utf_16=True), name, notes


def _mission_reader(text: str, suffix: str) -> Callable[[str, str], MissionAsRead] | None:
    """The reader of a mission, told by what stands in it, else by its name; None of a drawn line."""
    if text.startswith(WPL):
        return read_waypoints
    if suffix in JSON_ENDINGS and PLAN.search(text):
        return read_plan
    return MISSIONS.get(suffix)


def _mission(found: MissionAsRead, origin_deg: Place | None) -> PathAsGiven:
    """A mission in the local plane."""
    source, flown = found.source, program(found)
    positions = [step.position for step in flown.steps]
    placed = [position for position in positions if position is not None]
    items = [step.item for step in flown.steps if step.position is not None]
    origin = None if flown.local else origin_deg or placed[0]
    _check_degrees(origin, placed, lambda place: f"item {items[place]}", source)
    origin = _turned(origin)
    points = _in_plane(placed, origin)
    _check_span(points, source)
    each = iter(points.tolist())
    places = tuple(None if position is None else complex(*next(each)) for position in positions)
    return PathAsGiven(
        source=source,
        points_m=points,
        origin_deg=origin,
        mission=GivenMission(flown, places, found.home_altitude_m),
        fences=_fences(found.fences, origin, source),
        notes=(*found.notes, *_without_home(found, flown)),
    )


def _without_home(found: MissionAsRead, flown: Program) -> tuple[str, ...]:
    """What is to be said of altitudes above a home that the file does not have."""
    if found.home is not None or flown.local:
        return ()
    above = [step for step in flown.steps if step.above == HOME and step.height_m is not None]
    return ("has no home: altitudes above home are counted from the sea",) if above else ()


def given_points(points: Any) -> PathAsGiven:
    """A drawn path from points in the local plane.

    Args:
        points: (n, 2) east, north in metres; (n, 3) with the altitude above mean sea level, linear along legs.

    Raises:
        InputError: they are no such array, not finite, too far, or all in one place.
    """
    try:
        array = np.array(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"path: is no array of numbers ({error}); must be (n, 2), or (n, 3) with altitudes: metres"
        ) from error
    if array.ndim != 2 or array.shape[1] not in (2, 3) or len(array) < 2:
        raise InputError(
            f"path: has the shape {array.shape}; must be (n, 2), or (n, 3) with altitudes, n at least 2"
        )
    if not np.isfinite(array).all():
        raise InputError("path: holds a number that is not finite; must be metres")
    points = array[:, :2].copy()
    _check_span(points, "path")
    _check_places(points, "path")
    altitudes = array[:, 2:].ravel()
    _check_altitudes(altitudes.tolist(), "path")
    return PathAsGiven("path", points, None, altitudes)


def _check_span(points: FloatArray, source: str) -> None:
    with np.errstate(over="ignore"):
        reach = max(float(np.ptp(points, axis=0).max()), float(np.abs(points).max()))
    if reach > MAX_SPAN_M:
        raise InputError(
            f"{source}: reaches {reach / 1e3:.0f} km; must stay within {MAX_SPAN_M / 1e3:.0f} km of its origin"
        )


def _check_places(points: FloatArray, source: str) -> None:
    if np.hypot(*(points - points[0]).T).max() <= SAME_PLACE_M:
        raise InputError(f"{source}: all its points are in one place; a path has at least 2")


def _check_altitudes(altitudes_m: Sequence[float], source: str) -> None:
    lowest, highest = ALTITUDES_M
    for number, altitude in enumerate(altitudes_m):
        if not lowest <= altitude <= highest:
            raise InputError(
                f"{source}: point {number} is at {altitude:g} m above the sea; must be between {lowest:g} and "
                f"{highest:g} m, or give --altitude-m"
            )


def _check_degrees(
    origin: Place | None, positions: Sequence[Place], named: Callable[[int], str], source: str
) -> None:
    for number, (latitude, longitude) in enumerate(positions if origin is not None else ()):
        if not (abs(latitude) <= 85.0 and abs(longitude) <= 360.0):
            raise InputError(
                f"{source}: {named(number)} is at latitude {latitude:g}, longitude {longitude:g}; must be degrees "
                "within 85 and 360 (local metres can be given as CSV with the columns x_m,y_m)"
            )


def _turned(origin: Place | None) -> Place | None:
    """An origin whose longitude is within half a turn."""
    if origin is None or abs(origin[1]) <= 180.0:
        return origin
    return origin[0], math.remainder(origin[1], 360.0)


def _as_asked(found: PathAsRead, polygons: str) -> PathAsRead:
    """A drawn path whose polygons are what was asked for."""
    if polygons != "none":
        every = tuple(fence.stated_as(polygons == "inclusion") for fence in found.fences.every)
        return replace(found, fences=replace(found.fences, every=every))
    kept = tuple(fence for fence in found.fences.every if fence.stated)
    count = len(found.fences.every) - len(kept)
    notes = (
        (*found.notes, f"{counted(count, 'Polygon')} beside the path passed over") if count else found.notes
    )
    return replace(found, fences=replace(found.fences, every=kept), notes=notes)


def _in_plane(positions: Sequence[Place], origin: Place | None) -> FloatArray:
    """(n, 2) positions in the local plane."""
    if origin is None:
        return np.array(positions, dtype=np.float64).reshape(-1, 2)
    plane = LocalPlane(*origin)
    return np.array([plane.plane(latitude, longitude) for latitude, longitude in positions]).reshape(-1, 2)


def _fences(fences: Fences, origin: Place | None, source: str) -> Fences:
    """Fences in the local plane."""
    if origin is not None:
        for fence in fences.every:
            _check_fence(fence, source)
        plane = LocalPlane(*origin)
        fences = fences.moved(lambda place: plane.plane(*place))
    clean = replace(fences, every=tuple(checked(fence, source) for fence in fences.every))
    if clean.allowed is not None and clean.allowed.is_empty:
        names = ", ".join(fence.name for fence in clean.inclusions)
        raise InputError(
            f"{source}: {names}: have no place in common; an aircraft has to stay inside of all of them"
        )
    return clean


def _check_fence(fence: Fence, source: str) -> None:
    places = [*(place for ring in fence.rings for place in ring), *((fence.center,) if fence.center else ())]
    for latitude, longitude in places:
        if not (abs(latitude) <= 85.0 and abs(longitude) <= 360.0):
            raise InputError(
                f"{source}: {fence.name}: has latitude {latitude:g}, longitude {longitude:g}; must be degrees within "
                "85 and 360"
            )


LINES: Final[dict[str, Callable[[str, str], PathAsRead]]] = {
    ".csv": read_csv,
    ".geojson": read_geojson,
    ".json": read_geojson,
    ".kml": read_kml,
    ".kmz": read_kml,
    ".gpx": read_gpx,
    ".igc": read_igc,
}
"""Readers of drawn lines and recorded tracks by the ending of a file's name."""

MISSIONS: Final[dict[str, Callable[[str, str], MissionAsRead]]] = {
    ".plan": read_plan,
    ".mission": read_plan,
    ".waypoints": read_waypoints,
    ".txt": read_waypoints,
}
"""Readers of missions, likewise."""
