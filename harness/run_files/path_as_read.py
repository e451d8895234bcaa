"""What a file says of a path, before it is put into the local plane."""

from __future__ import annotations

from dataclasses import dataclass, field

from harness.run_files.fences import Fences


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
