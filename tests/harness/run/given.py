"""Paths for checks, and how far a track is off one: written anew with numpy, nothing of the package is used."""

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

LATITUDE_DEG, LONGITUDE_DEG, HOME_M = 47.0, 8.0, 300.0
SEMI_MAJOR_M, ECCENTRICITY_2 = 6_378_137.0, 0.00669437999014  # WGS 84
_FLAT = 1.0 - ECCENTRICITY_2 * math.sin(math.radians(LATITUDE_DEG)) ** 2
NORTH_M = math.radians(SEMI_MAJOR_M * (1.0 - ECCENTRICITY_2) / _FLAT**1.5)
EAST_M = math.radians(SEMI_MAJOR_M / math.sqrt(_FLAT) * math.cos(math.radians(LATITUDE_DEG)))
"""Metres in a degree of latitude and of longitude."""

Array = np.ndarray[Any, Any]


def item(
    number: int,
    east_m: float,
    north_m: float,
    up_m: float = 100.0,
    command: int = 16,
    params: Sequence[float] = (),
    frame: int = 3,
) -> str:
    """A line of a .waypoints file, its altitude above home unless another frame is given."""
    four = [*params, 0.0, 0.0, 0.0, 0.0][:4]
    latitude = LATITUDE_DEG + north_m / NORTH_M
    longitude = LONGITUDE_DEG + east_m / EAST_M
    return "\t".join(map(str, [number, 0, frame, command, *four, f"{latitude:.9f}", f"{longitude:.9f}", up_m, 1]))


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def waypoints_file(
    folder: Path, places: Sequence[tuple[float, float]], acceptance_m: float = 0.0, more: Sequence[str] = ()
) -> Path:
    """A mission of waypoints 100 m above home at places east and north of it; `more` lines follow."""
    home = f"0\t1\t0\t16\t0\t0\t0\t0\t{LATITUDE_DEG}\t{LONGITUDE_DEG}\t{HOME_M}\t1"
    lines = [item(n, *place, params=(0.0, acceptance_m)) for n, place in enumerate(places, start=1)]
    return written(folder / "mission.waypoints", "\n".join(["QGC WPL 110", home, *lines, *more]) + "\n")


def off_polyline_m(points: Array, line: Sequence[tuple[float, float]]) -> Array:
    """(n,) distances of points (n, 2) from the nearest edge of a polyline."""
    ends = np.array(line)
    nearest = np.full(len(points), np.inf)
    for begin, end in pairwise(ends):
        along = end - begin
        share = np.clip((points - begin) @ along / (along @ along), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(*(points - begin - share[:, None] * along).T))
    return nearest
