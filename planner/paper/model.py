"""Section 2: the equations of motion (1) to (3), the cost of a track and obstacles on it, Definitions 1 and 2.

The paper's course theta is a mathematical angle: counter-clockwise from east, rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from planner.geometry.curves import Point
from planner.interface import FloatArray


def step(
    x_m: float, y_m: float, course_rad: float, units: float, unit_rad: float, step_m: float
) -> tuple[float, float, float]:
    """Equations (1) to (3): the next track point, x_{k+1}, y_{k+1}, and theta_{k+1}.

    Args:
        x_m: x_k, east of the current track point.
        y_m: y_k, north of it.
        course_rad: theta_k, course on arrival at it.
        units: Delta, the change of course in units of theta_0.
        unit_rad: theta_0, the smallest change of course.
        step_m: S_0, the length of the step.
    """
    course = course_rad + unit_rad * units
    return x_m + step_m * math.cos(course), y_m + step_m * math.sin(course), course


def most_units(step_m: float, turn_radius_m: float, unit_rad: float) -> int:
    """Section 2.1: the largest Delta of equation (1), so that the aircraft can turn from one step to the next.

    The corner between the two is rounded at the turn radius R. An arc that turns by phi begins R tan(phi / 2) before
    the corner. It has half of the step for that: phi <= 2 atan(S_0 / 2R).
    """
    return math.floor(2.0 * math.atan(step_m / (2.0 * turn_radius_m)) / unit_rad)


def track_cost_m(nodes: Sequence[Point]) -> float:
    """Section 2.2: c, the sum of the costs c_k from w_k to w_{k+1}. The cost is the length; threats cost nothing."""
    return sum(math.dist(a, b) for a, b in pairwise(nodes))


def within(points_m: FloatArray, center_m: Point, radius_m: float) -> FloatArray:
    """Definition 1: those of (m, 2) points x with |x - w_k| <= r; with r_1 in place of r, the window of section 3.3."""
    return points_m[np.hypot(points_m[:, 0] - center_m[0], points_m[:, 1] - center_m[1]) <= radius_m]


def guide_vector(position_m: Point, goal_m: Point) -> tuple[float, float]:
    """Definition 2: alpha, from w_k to the goal w_n, as its length a (m) and its angle from east (rad)."""
    east, north = goal_m[0] - position_m[0], goal_m[1] - position_m[1]
    return math.hypot(east, north), math.atan2(north, east)


def crosses(a: Point, b: Point, points_m: FloatArray, keep_m: float) -> bool:
    """Sections 2.2 and 3.2: whether the line from a to b crosses an obstacle.

    It does where it comes nearer than `keep_m` to a sensed edge point and does not only lead away from it.
    """
    ux, uy = b[0] - a[0], b[1] - a[1]
    dx, dy = points_m[:, 0] - a[0], points_m[:, 1] - a[1]
    share = np.clip((dx * ux + dy * uy) / max(ux * ux + uy * uy, 1e-12), 0.0, 1.0)
    near = np.square(dx - share * ux) + np.square(dy - share * uy) < keep_m * keep_m
    return bool((near & (share > 0.0)).any())
