"""The local plane as a flight model asks for it: for many points, each near the one before."""

from __future__ import annotations

import math

import numpy as np

from aircraft.frames import LocalPlane


class PatchedPlane:
    """Projects as `LocalPlane.project` does, to a tenth of a millimetre, in a twentieth of the time.

    It keeps a patch of the plane about the last points, a polynomial, and lays a new one where a point is off it.

    Args:
        plane: the local plane.
        latitude_rad: geodetic latitude of where the first patch is laid.
        longitude_rad: longitude of it.
    """

    def __init__(self, plane: LocalPlane, latitude_rad: float, longitude_rad: float) -> None:
        from aircraft import kernels  # half a second

        self._plane, self._place_in_patch = plane, kernels.place_in_patch
        self._patch = np.array(plane.patch(latitude_rad, longitude_rad))

    def project(self, latitude_rad: float, longitude_rad: float) -> tuple[float, float, float]:
        """East and north (m) of a geodetic point, and the meridian convergence there (rad); NaN of one not finite."""
        east_m, north_m, convergence_rad = self._place_in_patch(self._patch, latitude_rad, longitude_rad)
        if math.isnan(east_m) and math.isfinite(latitude_rad + longitude_rad):
            self._patch = np.array(self._plane.patch(latitude_rad, longitude_rad))
            return self._place_in_patch(self._patch, latitude_rad, longitude_rad)
        return east_m, north_m, convergence_rad
