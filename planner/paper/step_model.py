"""Section 2.1: the equations of motion (1) to (3), and the turn that a step may begin with.

The paper's course theta is a mathematical angle: counter-clockwise from east, rad.
"""

from __future__ import annotations

import math


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
