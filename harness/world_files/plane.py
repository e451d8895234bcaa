"""From the coordinates of a file to the local ENU plane of a scenario, and back, by pyproj.

Axis order is x, y (longitude, latitude); the plane is that of `aircraft.frames`. InputError: an unknown crs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
import shapely
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError

from harness.files.input_file import InputError
from harness.world_files.parts import WGS84, FloatArray

CIRCLE_DEG: Final = 360.0
METRES: Final = ("m", "metre", "meter", "metres", "meters", "degree")
"""Names of the metre as a unit of heights; a crs in degrees that says nothing of heights counts as metres too."""


class Place(NamedTuple):
    """The place where the local plane of a scenario touches the earth: ENU (0, 0), WGS84."""

    latitude_deg: float
    longitude_deg: float


@dataclass(frozen=True)
class Mapping:
    """Coordinates of one file, by its crs, in a plane; without one metres of its own, to which `shift_m` is added."""

    crs: str | None
    place: Place
    shift_m: tuple[float, float] = (0.0, 0.0)

    def to_plane(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns east and north (m) of places in the file, not finite where a place has none."""
        if self.crs is None:
            return x + self.shift_m[0], y + self.shift_m[1]
        east, north = self._transformer.transform(x, y)
        return np.asarray(east, dtype=np.float64), np.asarray(north, dtype=np.float64)

    def from_plane(self, east: FloatArray, north: FloatArray, about_x: float) -> tuple[FloatArray, FloatArray]:
        """Returns x and y in the file of places in the plane; longitudes are the equal ones nearest to `about_x`."""
        if self.crs is None:
            return east - self.shift_m[0], north - self.shift_m[1]
        x, y = (np.asarray(each) for each in self._transformer.transform(east, north, direction="INVERSE"))
        if in_degrees(self.crs):
            x = x + CIRCLE_DEG * np.round((about_x - x) / CIRCLE_DEG)
        return np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)

    def geometries(self, shapes: Any) -> Any:
        """Maps shapely geometries from the file to the plane."""
        return shapely.transform(shapes, lambda p: np.column_stack(self.to_plane(p[:, 0], p[:, 1])))

    @cached_property
    def _transformer(self) -> Any:
        """Transforms from the file to the plane. The datum is named: pyproj shifts none for an ellipsoid alone."""
        latitude, longitude = self.place
        plane = f"+proj=aeqd +lat_0={latitude!r} +lon_0={longitude!r} +datum=WGS84"
        return Transformer.from_crs(pyproj_crs(self.crs or WGS84).to_2d(), plane, always_xy=True)


def check_metres(crs: str, unit: str = "") -> tuple[str, ...]:
    """Returns notes; InputError: heights are no metres, by `unit` if given, else the upward axis, else the plane's."""
    axes = pyproj_crs(crs).axis_info
    found = unit or next((axis.unit_name for axis in axes if axis.direction == "up"), axes[0].unit_name)
    if found.strip().lower() not in METRES:
        remedy = "" if unit else ", or give a crs with heights in metres, as EPSG:2263+5703"
        raise InputError(f"has heights in {found[:20]}; make them metres{remedy}")
    note = "has heights above the ellipsoid, up to 110 m beside those above mean sea level: taken as they are"
    return (note,) if any("ellipsoid" in axis.name.lower() for axis in axes) else ()


def in_degrees(name: str | None) -> bool:
    """Whether coordinates of a coordinate reference system are longitude and latitude in degrees."""
    return name is not None and bool(pyproj_crs(name).to_2d().is_geographic)


def crs_of(own: str | None, given: str | None) -> str | None:
    """Returns the crs that a file names, else the given one; that also if it says more of the file's own: heights."""
    mine, other = (each and pyproj_crs(each) for each in (own, given))
    if not (mine and other):
        return own or given
    same = mine.to_2d().equals(other.to_2d(), ignore_axis_order=True)
    return given if same and len(other.axis_info) >= len(mine.axis_info) else own


def pyproj_crs(name: str) -> Any:
    """Returns a coordinate reference system by its name; InputError: it is not known, or of no places on earth."""
    try:
        crs = CRS.from_user_input(name)
    except CRSError as error:
        raise InputError(f"has the crs {name[:60]!r}, which is not known; give EPSG:N") from error
    if crs.ellipsoid is None or crs.is_geocentric or not 6.3e6 < crs.ellipsoid.semi_major_metre < 6.4e6:
        raise InputError(f"has the crs {crs.name[:60]!r}, which is none of places on earth; give EPSG:N")
    return crs


def short_way(longitudes_deg: FloatArray) -> FloatArray:
    """Adds whole turns to longitudes to bring each nearest to the first; a file goes on across the antimeridian."""
    return longitudes_deg - CIRCLE_DEG * np.round((longitudes_deg - longitudes_deg[:1]) / CIRCLE_DEG)


def geodetic(crs: str, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Latitude and longitude (WGS84, degrees) of places in a file."""
    longitude, latitude = Transformer.from_crs(pyproj_crs(crs).to_2d(), WGS84, always_xy=True).transform(x, y)
    return np.asarray(latitude, dtype=np.float64), np.asarray(longitude, dtype=np.float64)
