"""The local plane: geodetic (WGS84) to plane coordinates and back.

The plane is the azimuthal equidistant projection about its origin: distance and bearing from the origin are
true, so a point 142 km away is where the geodesic puts it. Closed forms on the normal section through the
origin replace the geodesic; they agree with it to less than 0.1 m and 0.003 degrees out to 142 km.

pyproj has this projection, but a flight's digest would depend on the release of PROJ that it brings, and to import it
takes longer than to read a scenario. Files of maps go through it, and the tests hold this plane against its geodesic.
"""

from __future__ import annotations

import math

PATCH_M = 500.0
"""Half the width of a square patch of the plane, within which `LocalPlane.patch` stands for the projection."""
SEMI_MAJOR_M = 6_378_137.0  # figures of the WGS 84 ellipsoid, with the two below
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)


class LocalPlane:
    """East and north in metres about an origin on the WGS84 ellipsoid."""

    def __init__(self, latitude_deg: float, longitude_deg: float) -> None:
        """Lays the plane about an origin; ValueError if it is not finite or out of range."""
        if not abs(latitude_deg) <= 85.0:
            raise ValueError(f"latitude_deg of the origin must be in [-85, 85]; got {latitude_deg:g}")
        if not -180.0 <= longitude_deg <= 360.0:
            raise ValueError(f"longitude_deg of the origin must be in [-180, 360]; got {longitude_deg:g}")
        self.latitude_deg, self.longitude_deg = latitude_deg, longitude_deg
        self._latitude, self._longitude = math.radians(latitude_deg), math.radians(longitude_deg)
        self._sin, self._cos = math.sin(self._latitude), math.cos(self._latitude)
        w2 = 1.0 - ECCENTRICITY_SQUARED * self._sin**2
        self._prime_vertical_m = SEMI_MAJOR_M / math.sqrt(w2)
        self._meridian_m = self._prime_vertical_m * (1.0 - ECCENTRICITY_SQUARED) / w2
        self._axis_m = self._prime_vertical_m * self._cos
        self._polar_m = self._prime_vertical_m * (1.0 - ECCENTRICITY_SQUARED) * self._sin

    def project(self, latitude_rad: float, longitude_rad: float) -> tuple[float, float, float]:
        """Plane coordinates of a geodetic point, and the meridian convergence there.

        The point goes to the tangent plane through its ECEF coordinates. The distance is the arc over the
        chord, with the radius of the normal section after Euler: 1/R = cos^2/M + sin^2/N.

        Returns:
            East (m), north (m) and the meridian convergence (rad): a direction in the plane is the true
            direction minus the convergence, both clockwise from north.
        """
        sin_latitude, cos_latitude = math.sin(latitude_rad), math.cos(latitude_rad)
        prime_m = SEMI_MAJOR_M / math.sqrt(1.0 - ECCENTRICITY_SQUARED * sin_latitude * sin_latitude)
        axis_m = prime_m * cos_latitude
        half = 0.5 * math.remainder(longitude_rad - self._longitude, math.tau)
        sin_half, cos_half = math.sin(half), math.cos(half)
        east = 2.0 * axis_m * sin_half * cos_half
        outward = axis_m * (1.0 - 2.0 * sin_half * sin_half) - self._axis_m
        polar = prime_m * (1.0 - ECCENTRICITY_SQUARED) * sin_latitude - self._polar_m
        north = self._cos * polar - self._sin * outward
        up = self._cos * outward + self._sin * polar
        if (level2 := east * east + north * north) == 0.0:
            return 0.0, 0.0, 0.0
        curvature = (north * north / self._meridian_m + east * east / self._prime_vertical_m) / level2
        chord2 = level2 + up * up
        stretch = math.sqrt(chord2 / level2) * (1.0 + chord2 * curvature * curvature / 24.0)
        mean = 0.5 * (latitude_rad + self._latitude)
        convergence = 2.0 * math.atan2(
            sin_half * math.sin(mean), cos_half * math.cos(0.5 * (latitude_rad - self._latitude))
        )
        return east * stretch, north * stretch, convergence

    def patch(self, latitude_rad: float, longitude_rad: float) -> tuple[float, ...]:
        """`project` about a geodetic point to the second order, to 0.1 mm, for `aircraft.kernels.place_in_patch`.

        Returns:
            19 numbers: latitude and longitude (rad) of its middle; how far from there it holds, north and south, east
            and west (rad; `PATCH_M` on the ground); for east and then for north, the value in the middle (m), its
            derivatives per radian by latitude and by longitude, and half of those by latitude twice, by both, by
            longitude twice; meridian convergence (rad) in the middle, its derivatives by latitude and longitude.
        """
        up = PATCH_M / self._meridian_m
        right = up / math.cos(latitude_rad)

        def at(rows: int, columns: int) -> tuple[complex, float]:
            east, north, convergence = self.project(latitude_rad + rows * up, longitude_rad + columns * right)
            return complex(east, north), convergence

        (here, turned), (above, turned_above), (below, turned_below) = at(0, 0), at(1, 0), at(-1, 0)
        (beyond, turned_beyond), (before, turned_before) = at(0, 1), at(0, -1)
        places = (
            here,
            (above - below) / (2.0 * up),
            (beyond - before) / (2.0 * right),
            (above + below - 2.0 * here) / (2.0 * up * up),
            (at(1, 1)[0] - at(1, -1)[0] - at(-1, 1)[0] + at(-1, -1)[0]) / (4.0 * up * right),
            (beyond + before - 2.0 * here) / (2.0 * right * right),
        )
        return (
            *(latitude_rad, longitude_rad, up, right),
            *(place.real for place in places),
            *(place.imag for place in places),
            *(turned, (turned_above - turned_below) / (2.0 * up)),
            (turned_beyond - turned_before) / (2.0 * right),
        )

    def plane(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """East and north (m) of a geodetic point (degrees)."""
        east_m, north_m, _ = self.project(math.radians(latitude_deg), math.radians(longitude_deg))
        return east_m, north_m

    def geodetic(self, east_m: float, north_m: float) -> tuple[float, float]:
        """Geodetic latitude and longitude (degrees) of a plane point, to a millimetre within 150 km.

        A first guess on the osculating sphere is corrected with `project`.
        """
        latitude = self._latitude + north_m / self._meridian_m
        longitude = self._longitude + east_m / (self._prime_vertical_m * math.cos(latitude))
        for _ in range(5):
            east, north, convergence = self.project(latitude, longitude)
            east, north = east_m - east, north_m - north
            true_east = east * math.cos(convergence) + north * math.sin(convergence)
            true_north = north * math.cos(convergence) - east * math.sin(convergence)
            w2 = 1.0 - ECCENTRICITY_SQUARED * math.sin(latitude) ** 2
            prime_m = SEMI_MAJOR_M / math.sqrt(w2)
            longitude += true_east / (prime_m * math.cos(latitude))
            latitude += true_north * w2 / (prime_m * (1.0 - ECCENTRICITY_SQUARED))
        return math.degrees(latitude), math.degrees(math.remainder(longitude, math.tau))

    def convergence_rad(self, east_m: float, north_m: float) -> float:
        """Meridian convergence at a plane point: true direction minus direction in the plane (rad)."""
        latitude_deg, longitude_deg = self.geodetic(east_m, north_m)
        return self.project(math.radians(latitude_deg), math.radians(longitude_deg))[2]


class PatchedPlane:
    """Projects as `LocalPlane.project` does, to a tenth of a millimetre, in a twentieth of the time.

    It keeps a patch of the plane about the last points, and lays a new one where a point is off it.
    """

    def __init__(self, plane: LocalPlane, latitude_rad: float, longitude_rad: float) -> None:
        import numpy as np

        from aircraft import kernels  # half a second

        self._plane, self._array = plane, np.array
        self._patch = self._array(plane.patch(latitude_rad, longitude_rad))
        self._place_in_patch = kernels.for_types_of(kernels.place_in_patch, self._patch, math.nan, math.nan)

    def project(self, latitude_rad: float, longitude_rad: float) -> tuple[float, float, float]:
        """East and north (m) of a geodetic point, and the meridian convergence there (rad); NaN of one not finite."""
        place: tuple[float, float, float] = self._place_in_patch(self._patch, latitude_rad, longitude_rad)
        if math.isnan(place[0]) and math.isfinite(latitude_rad + longitude_rad):
            self._patch = self._array(self._plane.patch(latitude_rad, longitude_rad))
            place = self._place_in_patch(self._patch, latitude_rad, longitude_rad)
        return place
