"""What a file says of a path, before it is put into the local plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from harness.files.input_file import InputError
from harness.run_files.fences import Fences

Point = tuple[float, float, float | None]
"""Latitude, longitude, altitude."""


@dataclass(frozen=True)
class PathAsRead:
    """A path as its file has it.

    Attributes:
        local: positions are east and north in metres; else latitude and longitude in degrees.
        positions: one a point.
        altitudes_m: above mean sea level, one a point; none where the file has none.
        above_ground: the altitudes are above the ground instead.
        fences: areas that come with it, their positions as those of the points.
        notes: what else is in the file and does not change the path, a line each.
    """

    local: bool
    positions: tuple[tuple[float, float], ...]
    altitudes_m: tuple[float, ...]
    above_ground: bool = False
    fences: Fences = field(default_factory=Fences)
    notes: tuple[str, ...] = ()


def of_points(
    points: Sequence[Point],
    where: str,
    fences: Fences,
    notes: Sequence[str],
    above_ground: bool = False,
) -> PathAsRead:
    """A path in degrees.

    Raises:
        InputError: some of its points have an altitude, and others none.
    """
    heights = tuple(altitude for *_, altitude in points if altitude is not None)
    if heights and len(heights) != len(points):
        raise InputError(
            f"{where}: has an altitude at {len(heights)} of {len(points)} points; give it at all or none"
        )
    positions = tuple((latitude, longitude) for latitude, longitude, _ in points)
    return PathAsRead(False, positions, heights, above_ground and bool(heights), fences, tuple(notes))
