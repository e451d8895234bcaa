"""From the coordinates of a file to the local ENU plane of a scenario, and back.

pyproj does the work: axis order is always x, y (longitude, latitude), and grid north of a national grid is turned to
true north at the origin. The plane is the azimuthal equidistant one of `aircraft.frames`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from harness.world_files.parts import WGS84, FloatArray, WorldFileError

MOST_LATITUDE_DEG: Final = 85.0
TURN_DEG: Final = 360.0


@dataclass(frozen=True)
class Place:
    """Where the local plane of a scenario touches the earth.

    Attributes:
        latitude_deg: of ENU (0, 0), WGS84.
        longitude_deg: of ENU (0, 0).
    """

    latitude_deg: float
    longitude_deg: float


@dataclass(frozen=True)
class Mapping:
    """Coordinates of one file in the plane of a scenario.

    Attributes:
        crs: of the file; None: metres in a plane of its own.
        place: where the scenario lies.
        shift_m: east and north that are added to the metres of a file without a CRS.
    """

    crs: str | None
    place: Place
    shift_m: tuple[float, float] = (0.0, 0.0)

    def to_plane(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """East and north of places in the file; not finite where there is none."""
        if self.crs is None:
            return x + self.shift_m[0], y + self.shift_m[1]
        east, north = self._transformer.transform(x, y)
        return np.asarray(east, dtype=np.float64), np.asarray(north, dtype=np.float64)

    def from_plane(
        self, east: FloatArray, north: FloatArray, about_x: float | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """X and y in the file of places of the plane.

        Args:
            east: of the places.
            north: of the places.
            about_x: in the middle of what the file has; longitudes are given by the turn that is nearest to it, since
                files write those across the antimeridian in several ways.
        """
        if self.crs is None:
            return east - self.shift_m[0], north - self.shift_m[1]
        x, y = (np.asarray(each) for each in self._transformer.transform(east, north, direction="INVERSE"))
        if about_x is not None and self._in_degrees:
            x = x + TURN_DEG * np.round((about_x - x) / TURN_DEG)
        return np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)

    def geometries(self, shapes: Any) -> Any:
        """Shapely geometries of the file in the plane."""
        import shapely

        return shapely.transform(
            shapes, lambda points: np.column_stack(self.to_plane(points[:, 0], points[:, 1]))
        )

    @cached_property
    def _in_degrees(self) -> bool:
        return in_degrees(self.crs)

    @cached_property
    def _transformer(self) -> Any:
        """From the file to the plane. Its datum must be named: of an ellipsoid alone no datum shift is made."""
        from pyproj import Transformer

        plane = (
            f"+proj=aeqd +lat_0={self.place.latitude_deg!r} +lon_0={self.place.longitude_deg!r} +datum=WGS84"
        )
        return Transformer.from_crs(flat_crs(self.crs or WGS84), plane, always_xy=True)


def flat_crs(name: str) -> Any:
    """A coordinate reference system without its vertical part.

    Raises:
        WorldFileError: there is none of that name.
    """
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    try:
        return CRS.from_user_input(name).to_2d()
    except CRSError as error:
        raise WorldFileError(
            f"has the crs {name[:60]!r}, which is not known; give one as EPSG:32632"
        ) from error


def in_degrees(name: str | None) -> bool:
    """Whether coordinates of a coordinate reference system are longitude and latitude in degrees.

    Raises:
        WorldFileError: there is none of that name.
    """
    return name is not None and bool(flat_crs(name).is_geographic)


def short_way(longitudes_deg: FloatArray) -> FloatArray:
    """Longitudes by turns that bring them nearest together: across the antimeridian, files go on at its other side.

    Those that leave no half of the earth free stay as they are, and so do the two ends of a map of the whole.
    """
    turned = longitudes_deg % TURN_DEG
    every = np.unique(turned)
    if len(every) < 2:
        return longitudes_deg
    gaps = np.diff(every, append=every[0] + TURN_DEG)
    widest = int(np.argmax(gaps))
    if gaps[widest] < 0.5 * TURN_DEG:
        return longitudes_deg
    begin = every[(widest + 1) % len(every)]
    together: FloatArray = begin + (turned - begin) % TURN_DEG
    return together


def vertical_unit_m(name: str) -> float:
    """Length in metres of the unit of heights of a coordinate reference system; 1 where it has no heights.

    Raises:
        WorldFileError: there is none of that name.
    """
    return next((float(axis.unit_conversion_factor) for axis in _axes(name) if axis.direction == "up"), 1.0)


def has_heights(name: str) -> bool:
    """Whether a coordinate reference system says what heights are.

    Raises:
        WorldFileError: there is none of that name.
    """
    return any(axis.direction == "up" for axis in _axes(name))


def unit_that_is_no_metre(name: str) -> str:
    """The unit of the plane of a coordinate reference system, as PROJ names it; empty for metres and degrees.

    Raises:
        WorldFileError: there is none of that name.
    """
    if in_degrees(name):
        return ""
    axis = _axes(name)[0]
    return "" if axis.unit_conversion_factor == 1.0 else str(axis.unit_name)


def _axes(name: str) -> list[Any]:
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    try:
        return list(CRS.from_user_input(name).axis_info)
    except CRSError as error:
        raise WorldFileError(
            f"has the crs {name[:60]!r}, which is not known; give one as EPSG:32632"
        ) from error


def geodetic(crs: str, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Latitude and longitude (WGS84, degrees) of places in a file."""
    from pyproj import Transformer

    longitude, latitude = Transformer.from_crs(flat_crs(crs), WGS84, always_xy=True).transform(x, y)
    return np.asarray(latitude, dtype=np.float64), np.asarray(longitude, dtype=np.float64)
