"""Reads a path that somebody gives, a drawn line, a track or a mission, into a plane about its first position."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from aircraft.frames import LocalPlane
from aircraft.interface import FloatArray
from harness.files.input_file import InputError, decoded, read_data
from harness.files.mavlink.items import HOME, WPL, Place
from harness.files.wording import counted
from harness.run_files.drawn_lines import PathAsRead, read_csv, read_geojson, read_gpx, read_igc, read_kml
from harness.run_files.fences import Fences, in_plane
from harness.run_files.given_path import SAME_PLACE_M
from harness.run_files.mission.mission_files import PLAN, read_plan, read_waypoints
from harness.run_files.mission.program import Program
from harness.scenario.sections import ALTITUDES_M

MAX_BYTES: Final = 64_000_000  # a larger path file is refused
MAX_SPAN_M: Final = 500e3  # a path that reaches further is refused
ON_EARTH_DEG: Final = (85.0, 360.0)  # a latitude or longitude further from 0, either way, is refused
LINES: Final[dict[str, Callable[[str, str], PathAsRead]]] = {  # readers of lines by a file name's ending
    ".csv": read_csv,
    **dict.fromkeys((".geojson", ".json"), read_geojson),
    ".gpx": read_gpx,
    ".igc": read_igc,
}
KML_ENDINGS: Final = (".kml", ".kmz")
MISSIONS: Final[dict[str, Callable[[str, str], Program]]] = {  # readers by a file name's ending
    ".plan": read_plan,
    **dict.fromkeys((".waypoints", ".txt"), read_waypoints),
}


@dataclass(frozen=True, eq=False)
class PathAsGiven:
    """A path as it was given, its file or `path` for faults, and notes on what does not change the path.

    Points are (n, 2) east, north; latitude and longitude of the origin are None where the file does not say. Altitudes
    are (n,) above mean sea level or `above_ground`; (0,) where the file does not say, and for a mission. A mission lies
    in the plane; it is None for a line that is wanted as drawn.
    """

    source: str
    points_m: FloatArray
    origin_deg: Place | None
    altitudes_m: FloatArray = field(default_factory=lambda: np.zeros(0))
    above_ground: bool = False
    mission: Program | None = None
    notes: tuple[str, ...] = ()

    @property
    def fences(self) -> Fences:
        """The fences of the mission, in the plane."""
        return Fences() if self.mission is None else self.mission.fences


def read_path(path: Path, any_altitude: bool = False, origin_deg: Place | None = None) -> PathAsGiven:
    """Reads a path; the name's ending says how it is written.

    With `any_altitude` the altitudes of a drawn line are left out. The origin is latitude and longitude of east = north
    = 0; None: those of the first point of a path in degrees. An InputError says that the file cannot be read, is not of
    its format, or holds no path that can be flown.
    """
    source, suffix = str(path), path.suffix.lower()
    if suffix not in (every := (*LINES, *KML_ENDINGS, *MISSIONS)):
        raise InputError(f"{path}: is none of {', '.join(every)}; save the path as one of them")
    data = read_data(path, MAX_BYTES, "a path")
    if suffix in KML_ENDINGS:
        return _of_line(read_kml(data, source, MAX_BYTES), source, any_altitude, origin_deg)
    if suffix == ".igc":  # loggers write names in Latin-1
        return _of_line(read_igc(data.decode("latin-1"), source), source, any_altitude, origin_deg)
    text = decoded(data, source, "a path")
    mission = MISSIONS.get(suffix)
    if text.startswith(WPL):
        mission = read_waypoints
    elif suffix in (".json", ".txt") and PLAN.search(text):
        mission = read_plan
    if mission is not None:
        return _of_mission(mission(text, source), source, origin_deg)
    found = read_csv(text, source, any_altitude) if suffix == ".csv" else LINES[suffix](text, source)
    return _of_line(found, source, any_altitude, origin_deg)


def _of_line(found: PathAsRead, source: str, any_altitude: bool, origin_deg: Place | None) -> PathAsGiven:
    """Puts a drawn line into the plane and checks it; its altitudes are left out with `any_altitude`."""
    if (count := len(found.points)) < 2:
        raise InputError(f"{source}: has {counted(count, 'point')}; a path has at least 2")
    heights = [altitude for *_, altitude in found.points if altitude is not None]
    if heights and len(heights) != count:
        raise InputError(f"{found.where}: has an altitude at {len(heights)} of {count} points; give all or none")
    positions = [(first, second) for first, second, _ in found.points]
    if found.local:
        origin, points = None, np.array(positions)
    else:
        origin, place = _plane(positions, [f"point {k}" for k in range(count)], origin_deg, source)
        points = np.array(list(map(place, positions)))
    altitudes = np.array(() if any_altitude else heights)
    above_ground = found.above_ground and bool(heights)
    _check_points(points, () if above_ground else altitudes.tolist(), source)
    return PathAsGiven(source, points, origin, altitudes, above_ground, notes=tuple(found.notes))


def _of_mission(flown: Program, source: str, origin_deg: Place | None) -> PathAsGiven:
    placed = [(f"item {step.item}", step.position) for step in flown.steps if step.position is not None]
    names, positions = zip(*placed, strict=True)
    origin, place = _plane(positions, names, origin_deg, source)
    points = np.array(list(map(place, positions)))
    _check_span(points, source)
    for fence in flown.fences.every:
        _check_degrees([fence.name] * len(fence.places), fence.places, source)
    fences, notes = in_plane(flown.fences, place, source), flown.notes
    steps = tuple(replace(step, position=step.position and place(step.position)) for step in flown.steps)
    if flown.home is None and any(step.height_m is not None and step.above == HOME for step in flown.steps):
        notes = (*notes, "has no home: altitudes above home are counted from the sea")
    return PathAsGiven(source, points, origin, mission=replace(flown, steps=steps, fences=fences), notes=notes)


def given_points(points: Any, any_altitude: bool = False, origin_deg: Place | None = None) -> PathAsGiven:
    """Returns a drawn path of points in the local plane, (n, 2) or with altitudes above the sea (n, 3), in metres.

    A table with names of columns, of pandas or pyarrow, is read as a CSV file with this header.
    """
    names = getattr(points, "column_names", getattr(points, "columns", ()))
    if any(isinstance(name, str) for name in names):
        csv.writer(text := io.StringIO()).writerows([names, *np.array(points, dtype=object).tolist()])
        return _of_line(read_csv(text.getvalue(), "path", any_altitude), "path", any_altitude, origin_deg)
    try:
        array = np.ma.filled(np.ma.array(points, dtype=np.float64), np.nan)
    except (TypeError, ValueError) as error:
        raise InputError(f"path: is no array of numbers ({error}); must be (n, 2) or (n, 3)") from error
    if array.ndim != 2 or array.shape[1] not in (2, 3) or len(array) < 2:
        raise InputError(f"path: has the shape {array.shape}; must be (n, 2) or (n, 3), n at least 2")
    if not np.isfinite(array).all():
        raise InputError("path: holds a number that is not finite; must be metres")
    points, altitudes = array[:, :2].copy(), array[:, 2:].ravel()
    _check_points(points, altitudes.tolist(), "path")
    return PathAsGiven("path", points, None, altitudes)


def _plane(
    positions: Sequence[Place], names: Sequence[str], origin: Place | None, source: str
) -> tuple[Place, Callable[[Place], Place]]:
    """Returns latitude and longitude of the origin, and a function that puts a position into the plane."""
    _check_degrees(names, positions, source)
    latitude, longitude = origin or positions[0]
    at = latitude, math.remainder(longitude, 360.0)
    plane = LocalPlane(*at)
    return at, lambda place: plane.plane(*place)


def _check_degrees(names: Sequence[str], places: Sequence[Place], source: str) -> None:
    for name, (latitude, longitude) in zip(names, places, strict=True):
        if not (abs(latitude) <= ON_EARTH_DEG[0] and abs(longitude) <= ON_EARTH_DEG[1]):
            wanted = "degrees within 85 and 360 (local metres can be given as CSV with the columns x_m,y_m)"
            text = f"{name} is at latitude {latitude:g}, longitude {longitude:g}"
            raise InputError(f"{source}: {text}; must be {wanted}")


def _check_points(points: FloatArray, altitudes_m: Sequence[float], source: str) -> None:
    _check_span(points, source)
    if np.hypot(*(points - points[0]).T).max() <= SAME_PLACE_M:
        raise InputError(f"{source}: all its points are in one place; a path has at least 2")
    lowest, highest = ALTITUDES_M
    for number, altitude in enumerate(altitudes_m):
        if not lowest <= altitude <= highest:
            text = f"point {number} is at {altitude:g} m above the sea"
            wanted = f"between {lowest:g} and {highest:g} m, or give --altitude-m"
            raise InputError(f"{source}: {text}; must be {wanted}")


def _check_span(points: FloatArray, source: str) -> None:
    with np.errstate(over="ignore"):
        reach = max(float(np.ptp(points, axis=0).max()), float(np.abs(points).max()))
    if reach > MAX_SPAN_M:
        most = f"{MAX_SPAN_M / 1e3:.0f} km"
        raise InputError(f"{source}: reaches {reach / 1e3:,.6g} km; must stay within {most} of its origin")
