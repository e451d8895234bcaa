"""What tests of planners share: edge points of rings and walls, and joined pieces of a path."""

import math

import numpy as np
from hypothesis import strategies as st

from planner.geometry.curves import Pose, Segment, along
from planner.interface import FloatArray, Path

PIECES = st.lists(
    st.tuples(st.sampled_from([0.0, 1 / 900.0, -1 / 500.0, 1 / 200.0, -1 / 150.0]), st.floats(1.0, 900.0)),
    min_size=1,
    max_size=6,
)


def one_a_cell(points: FloatArray, spacing_m: float) -> FloatArray:
    """The first point of every cell of a grid, as an obstacle map keeps them."""
    _, first = np.unique(np.floor(points / spacing_m), axis=0, return_index=True)
    return points[np.sort(first)]


def ring(east_m: float, north_m: float, radius_m: float, spacing_m: float) -> FloatArray:
    count = max(8, math.ceil(4.0 * math.pi * radius_m / spacing_m))
    angle = np.arange(count) * math.tau / count
    points = np.column_stack((east_m + radius_m * np.cos(angle), north_m + radius_m * np.sin(angle)))
    return one_a_cell(points, spacing_m)


def wall(start_m: tuple[float, float], end_m: tuple[float, float], spacing_m: float) -> FloatArray:
    """Edge points of a straight wall, both ends among them."""
    count = math.ceil(2.0 * math.dist(start_m, end_m) / spacing_m) + 1
    points = np.column_stack([np.linspace(a, b, count) for a, b in zip(start_m, end_m, strict=True)])
    return one_a_cell(np.concatenate((points[-1:], points)), spacing_m)


def joined(pose: Pose, pieces: list[tuple[float, float]]) -> list[Segment]:
    segments: list[Segment] = []
    for curvature, length in pieces:
        segments.append((*pose, curvature, length))
        pose = along(segments[-1], length)
    return segments


def path_of(pose: Pose, pieces: list[tuple[float, float]]) -> Path:
    return Path(np.array(joined(pose, pieces)))


def integrated(start: tuple[float, float, float, float], segments: list[Segment], step_m: float) -> FloatArray:
    """(k, 4) places and tangents along joined segments by the midpoint rule, blind to where each starts."""
    x, y, tx, ty = start
    course = math.atan2(ty, tx)
    rows = [np.array([[x, y, tx, ty]])]
    for *_, curvature, length in segments:
        count = max(1, math.ceil(length / step_m))
        h = length / count
        middle = course + curvature * h * (np.arange(count) + 0.5)
        end = course + curvature * h * np.arange(1, count + 1)
        xs, ys = x + h * np.cumsum(np.cos(middle)), y + h * np.cumsum(np.sin(middle))
        rows.append(np.column_stack((xs, ys, np.cos(end), np.sin(end))))
        x, y, course = float(xs[-1]), float(ys[-1]), course + curvature * length
    return np.concatenate(rows)


def assert_flyable(path: Path, radius_m: float) -> None:
    """A path without a jump in place or direction that nowhere bends more than the radius allows."""
    rows = path.segments
    assert len(rows)
    assert np.isfinite(rows).all()
    assert (rows[:, 5] > 0.0).all()
    np.testing.assert_allclose(np.hypot(rows[:, 2], rows[:, 3]), 1.0, atol=1e-9)
    assert np.abs(rows[:, 4]).max() <= 1.0 / radius_m + 1e-9
    for row, following in zip(rows.tolist(), rows[1:].tolist(), strict=False):
        end = integrated((row[0], row[1], row[2], row[3]), [tuple(row)], radius_m / 500.0)[-1]
        # The midpoint rule with this step is off by less than a millimetre a kilometre.
        np.testing.assert_allclose(end[:2], following[:2], atol=1e-4 + 1e-6 * row[5])
        np.testing.assert_allclose(end[2:], following[2:4], atol=1e-6)
