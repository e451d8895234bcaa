"""The paper's kinematic step model, equations (1) to (3), and its step cost, equation (4).

The paper measures the course theta as a mathematical angle: counter-clockwise from east.
"""

from __future__ import annotations

import math


def largest_course_change_rad(step_m: float, turn_radius_m: float) -> float:
    """Largest |Delta theta_0| over a step S_0: a chord S_0 of a circle of radius R turns by 2 asin(S_0 / 2R)."""
    return 2.0 * math.asin(min(1.0, step_m / (2.0 * turn_radius_m)))


def step(
    x_m: float, y_m: float, course_rad: float, change_rad: float, step_m: float
) -> tuple[float, float, float]:
    """The next track point: equations (1) to (3) of the paper.

    Args:
        x_m: east of the present track point.
        y_m: north of it.
        course_rad: course theta_k on arrival at it.
        change_rad: Delta theta_0, the change of course.
        step_m: S_0, the length of the step.

    Returns:
        x, y and course at the next track point.
    """
    course = course_rad + change_rad
    return x_m + step_m * math.cos(course), y_m + step_m * math.sin(course), course


def distance_left_m(guide_m: float, step_m: float, off_guide_rad: float) -> float:
    """Distance to the goal after a step, equation (4): x^2 = a^2 + l^2 - 2 a l cos(theta).

    Args:
        guide_m: a, length of the guide vector.
        step_m: l, length of the step.
        off_guide_rad: theta, angle between the step and the guide vector.
    """
    square = guide_m * guide_m + step_m * step_m - 2.0 * guide_m * step_m * math.cos(off_guide_rad)
    return math.sqrt(max(square, 0.0))
