"""Reads a path that somebody gives: CSV, GeoJSON, QGroundControl .plan, MAVLink .waypoints.

What is read is a polyline in the local plane; positions in degrees are put into a plane about the first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from aircraft.frames import LocalPlane
from harness.files.input_file import InputError, read_text
from harness.files.wording import counted
from harness.run_files.csv_path import read_csv
from harness.run_files.fences import Fence, Fences, checked
from harness.run_files.geojson_path import read_geojson
from harness.run_files.given_path import SAME_PLACE_M
from harness.run_files.mission_files import read_plan, read_waypoints
from harness.run_files.path_as_read import PathAsRead
from harness.scenario.sections import ALTITUDES_M

FloatArray = NDArray[np.float64]

MAX_BYTES: Final = 64_000_000
MAX_SPAN_M: Final = 500e3
SAME_ALTITUDE_M: Final = 1.0


@dataclass(frozen=True, eq=False)
class GivenPath:
    """A path as it was given.

    Attributes:
        points_m: (n, 2) east, north; every point of the file, not all in one place.
        origin_deg: latitude and longitude of east = north = 0; None where the file does not say.
        altitude_m: above mean sea level; None where the file does not say.
        drawn: the line itself is wanted; else it is a mission, whose corners may be cut.
        acceptance_m: (n,) how far from each point a mission lets it pass, 0 where it does not say; (0,) for what is
            drawn.
        fences: areas that come with it.
        notes: what else is in the file and does not change the path, a line each.
    """

    points_m: FloatArray
    origin_deg: tuple[float, float] | None
    altitude_m: float | None
    drawn: bool = True
    acceptance_m: FloatArray = field(default_factory=lambda: np.zeros(0))
    fences: Fences = field(default_factory=Fences)
    notes: tuple[str, ...] = ()


def read_path(
    path: Path,
    any_altitude: bool = False,
    origin_deg: tuple[float, float] | None = None,
    polygons: str | None = None,
) -> GivenPath:
    """Reads a path; the name's ending says how it is written.

    Args:
        path: .csv, .geojson or .json, .plan, .waypoints.
        any_altitude: points at different altitudes are taken, for a flight whose altitude is given otherwise.
        origin_deg: latitude and longitude of east = north = 0; None: those of the first point of a path in degrees.
        polygons: what the polygons beside a drawn path are that do not say so themselves: `exclusion`, `inclusion` or
            `none`; None: `exclusion`.

    Raises:
        InputError: the file cannot be read, is not of its format, or holds more than a path at one
            altitude that can be flown.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: is none of {', '.join(READERS)}; save the path as one of them")
    found = reader(read_text(path, MAX_BYTES, "a path"), str(path))
    if len(found.positions) < 2:
        raise InputError(f"{path}: has {counted(len(found.positions), 'point')}; a path has at least 2")
    if found.drawn and polygons is not None:
        found = _as_asked(found, polygons)
    origin = None if found.local else origin_deg or found.positions[0]
    points, fences = _in_plane(found, origin, str(path))
    _check_span(points, str(path))
    return GivenPath(
        points,
        origin,
        _altitude(found.altitudes_m, any_altitude, str(path)),
        found.drawn,
        np.array(found.acceptance_m),
        _checked(fences, str(path)),
        found.notes,
    )


def given_points(points: Any) -> GivenPath:
    """A drawn path from points in the local plane.

    Args:
        points: (n, 2) east, north in metres; a third column, the altitude above mean sea level, is the same at all.

    Raises:
        InputError: they are no such array, not finite, too far, or all in one place.
    """
    try:
        array = np.array(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"path: is no array of numbers ({error}); must be (n, 2): east, north") from error
    if array.ndim != 2 or array.shape[1] not in (2, 3) or len(array) < 2:
        raise InputError(f"path: has the shape {array.shape}; must be (n, 2), n at least 2: east, north")
    if not np.isfinite(array).all():
        raise InputError("path: holds a number that is not finite; must be metres")
    _check_span(array[:, :2], "path")
    return GivenPath(array[:, :2].copy(), None, _altitude(array[:, 2:].ravel().tolist(), False, "path"))


def _check_span(points: FloatArray, source: str) -> None:
    with np.errstate(over="ignore"):
        reach = max(float(np.ptp(points, axis=0).max()), float(np.abs(points).max()))
    if reach > MAX_SPAN_M:
        raise InputError(
            f"{source}: reaches {reach / 1e3:.0f} km; must stay within {MAX_SPAN_M / 1e3:.0f} km of its origin"
        )
    if np.hypot(*(points - points[0]).T).max() <= SAME_PLACE_M:
        raise InputError(f"{source}: all its points are in one place; a path has at least 2")


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


def _in_plane(
    found: PathAsRead, origin: tuple[float, float] | None, source: str
) -> tuple[FloatArray, Fences]:
    """Points and fences in the local plane."""
    if origin is None:
        return np.array(found.positions), found.fences
    for number, (latitude, longitude) in enumerate(found.positions):
        if not (abs(latitude) <= 85.0 and abs(longitude) <= 180.0):
            raise InputError(
                f"{source}: point {number} is at latitude {latitude:g}, longitude {longitude:g}; must be degrees "
                "within 85 and 180 (local metres can be given as CSV with the columns x_m,y_m)"
            )
    for fence in found.fences.every:
        _check_degrees(fence, source)
    plane = LocalPlane(*origin)
    points = np.array([plane.plane(latitude, longitude) for latitude, longitude in found.positions])
    return points, found.fences.moved(lambda place: plane.plane(*place))


def _check_degrees(fence: Fence, source: str) -> None:
    places = [*(place for ring in fence.rings for place in ring), *((fence.center,) if fence.center else ())]
    for latitude, longitude in places:
        if not (abs(latitude) <= 85.0 and abs(longitude) <= 180.0):
            raise InputError(
                f"{source}: {fence.name}: has latitude {latitude:g}, longitude {longitude:g}; must be degrees within "
                "85 and 180"
            )


def _checked(fences: Fences, source: str) -> Fences:
    clean = replace(fences, every=tuple(checked(fence, source) for fence in fences.every))
    if clean.allowed is not None and clean.allowed.is_empty:
        names = ", ".join(fence.name for fence in clean.inclusions)
        raise InputError(
            f"{source}: {names}: have no place in common; an aircraft has to stay inside of all of them"
        )
    return clean


def _altitude(altitudes_m: Sequence[float], any_altitude: bool, source: str) -> float | None:
    if any_altitude or not altitudes_m:
        return None
    first = altitudes_m[0]
    for number, altitude in enumerate(altitudes_m):
        if not abs(altitude - first) <= SAME_ALTITUDE_M:
            raise InputError(
                f"{source}: point {number} is at {altitude:g} m, point 0 at {first:g} m; a checked path has one "
                "altitude: level it or give --altitude-m"
            )
    lowest, highest = ALTITUDES_M
    if not lowest <= first <= highest:
        raise InputError(
            f"{source}: is at {first:g} m above the sea; must be between {lowest:g} and {highest:g} m, or give "
            "--altitude-m"
        )
    return first


READERS: Final[dict[str, Callable[[str, str], PathAsRead]]] = {
    ".csv": read_csv,
    ".geojson": read_geojson,
    ".json": read_geojson,
    ".plan": read_plan,
    ".waypoints": read_waypoints,
}
"""Reader by the ending of a file's name."""
