"""Section 3.2: the direction of one step.

Obstacles are the edge points that were sensed, each grown to a disc by the distance to be kept. Angles are
counter-clockwise from east, rad.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planner.geometry.curves import Point
from planner.interface import FloatArray


class Sector(NamedTuple):
    """Directions from `right` counter-clockwise to `left`, right <= left <= right + 2 pi."""

    right: float
    left: float


FULL_CIRCLE = Sector(-math.pi, math.pi)  # the sector where no obstacle is in the window


def distance_left_m(guide_m: float, step_m: float, off_guide_rad: float) -> float:
    """Equation (4): x, the distance to the goal after a step; x^2 = a^2 + l^2 - 2 a l cos(theta).

    Args:
        guide_m: a, length of the guide vector.
        step_m: l, length of the step.
        off_guide_rad: theta, angle between the step and the guide vector.
    """
    square = guide_m * guide_m + step_m * step_m - 2.0 * guide_m * step_m * math.cos(off_guide_rad)
    return math.sqrt(max(square, 0.0))


def fan_shaped_sectors(points_m: FloatArray, keep_m: float, node_m: Point) -> list[Sector]:
    """Section 3.2, (1): the free sectors into which obstacles break up the window, as seen from a track point.

    M and N of an obstacle, (m, 2) edge points and the distance kept from each, are the tangents to it on its left and
    on its right. Obstacles whose fans overlap are one.
    """
    if not len(points_m):
        return [FULL_CIRCLE]
    east, north = points_m[:, 0] - node_m[0], points_m[:, 1] - node_m[1]
    half = np.arcsin(np.minimum(keep_m / np.maximum(np.hypot(east, north), 1e-9), 1.0))
    right = np.arctan2(north, east) - half
    first = float(right[0])
    begin = (right - first) % math.tau
    order = np.argsort(begin)
    begin = begin[order]
    end = np.maximum.accumulate(begin + 2.0 * half[order])
    # What reaches beyond a full turn covers the beginning again.
    covered = np.maximum(np.append(0.0, end[:-1]), end[-1] - math.tau)
    gaps = np.flatnonzero(begin > covered)
    sectors = [Sector(first + float(covered[i]), first + float(begin[i])) for i in gaps]
    if end[-1] < math.tau:
        sectors.append(Sector(first + float(end[-1]), first + math.tau))
    return sectors


def clip(sector: Sector, course_rad: float, most_rad: float) -> list[Sector]:
    """Section 3.2, (1): the parts of a sector that a step of equation (1) can turn to.

    They are no further than `most_rad` off the course on arrival.
    """
    parts = []
    shift = math.tau * math.ceil((course_rad - most_rad - sector.left) / math.tau)
    while sector.right + shift <= course_rad + most_rad:
        right = max(sector.right + shift, course_rad - most_rad)
        left = min(sector.left + shift, course_rad + most_rad)
        if right <= left:
            parts.append(Sector(right, left))
        shift += math.tau
    return parts


def off_guide(sector: Sector, guide_rad: float) -> float:
    """Equation (4): the least angle theta between a direction of a sector and the guide vector."""
    if (guide_rad - sector.right) % math.tau <= sector.left - sector.right:
        return 0.0
    return min(abs(signed(sector.right - guide_rad)), abs(signed(sector.left - guide_rad)))


def select(sectors: list[Sector], guide_rad: float, count: int) -> list[Sector]:
    """Section 3.2, (2): the sectors in which equation (4) leaves least, those next to the guide vector."""
    return sorted(sectors, key=lambda sector: off_guide(sector, guide_rad))[:count]


def refine(sector: Sector, guide_m: float, guide_rad: float, step_m: float, angle_rad: float) -> float:
    """Section 3.2, (3): the direction of least distance left, (4), by continuous refinement of a sector.

    The sector is cut into thirds, and the outer third that is worse at its inner end is dropped, until no more than
    `angle_rad` is left: its middle is the direction.
    """
    right, left = sector
    while left - right > angle_rad:
        third = (left - right) / 3.0
        at_right = distance_left_m(guide_m, step_m, right + third - guide_rad)
        at_left = distance_left_m(guide_m, step_m, left - third - guide_rad)
        if at_right <= at_left:
            left -= third
        else:
            right += third
    return 0.5 * (right + left)


def whole_units(sector: Sector, direction_rad: float, course_rad: float, unit_rad: float) -> int | None:
    """Equation (1): the integer Delta whose course is nearest to a direction, inside the sector; None: none is."""
    least = math.ceil((sector.right - course_rad) / unit_rad - 1e-9)
    most = math.floor((sector.left - course_rad) / unit_rad + 1e-9)
    if least > most:
        return None
    return min(max(round((direction_rad - course_rad) / unit_rad), least), most)


def signed(angle_rad: float) -> float:
    """Returns an angle as the equal one in [-pi, pi)."""
    return (angle_rad + math.pi) % math.tau - math.pi
