"""Curves against numerical integration and brute force."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.curves import (
    Point,
    Pose,
    Segment,
    along,
    between,
    end_of,
    fillet,
    full_turn,
    pose_at,
    sample,
    turn_onto,
)
from planner.interface import FloatArray, Path

Integrated = Callable[..., FloatArray]
AssertFlyable = Callable[[Path, float], None]

ANGLES = st.floats(-math.pi, math.pi)
POSES = st.builds(
    lambda x, y, course: Pose(x, y, math.cos(course), math.sin(course)),
    st.floats(-5e3, 5e3),
    st.floats(-5e3, 5e3),
    ANGLES,
)
PIECES = st.lists(
    st.tuples(st.sampled_from([0.0, 1 / 900.0, -1 / 500.0, 1 / 200.0, -1 / 150.0]), st.floats(1.0, 900.0)),
    min_size=1,
    max_size=6,
)
WALKS = st.lists(st.tuples(st.floats(600.0, 5000.0), st.floats(-2.2, 2.2)), min_size=1, max_size=6)


def joined(start: Pose, pieces: list[tuple[float, float]]) -> list[Segment]:
    segments: list[Segment] = []
    pose = start
    for curvature, length in pieces:
        segments.append((*pose, curvature, length))
        pose = along(segments[-1], length)
    return segments


def corners(start: Pose, walk: list[tuple[float, float]]) -> list[Point]:
    """Nodes of a polyline from a pose: legs and the turns before them."""
    x, y = start[:2]
    course = math.atan2(start.tangent_north, start.tangent_east)
    nodes = []
    for leg, turn in walk:
        course += turn
        x, y = x + leg * math.cos(course), y + leg * math.sin(course)
        nodes.append((x, y))
    return nodes


@settings(deadline=None)
@given(start=POSES, pieces=PIECES)
def test_joined_segments_are_where_integration_says(
    start: Pose, pieces: list[tuple[float, float]], integrated: Integrated
) -> None:
    segments = joined(start, pieces)
    dense = integrated(start, segments, 0.2)
    np.testing.assert_allclose(end_of(Path(np.array(segments))), dense[-1], atol=1e-3)


@settings(deadline=None)
@given(start=POSES, pieces=PIECES, share=st.floats(0.0, 1.0), more=st.floats(0.0, 1.0))
def test_pose_sample_and_stretch_agree(
    start: Pose, pieces: list[tuple[float, float]], share: float, more: float, integrated: Integrated
) -> None:
    path = Path(np.array(joined(start, pieces)))
    begin = share * path.length_m
    stop = begin + more * (path.length_m - begin)
    assume(stop - begin > 1e-3)
    stretch = between(path, begin, stop)
    assert sum(segment[5] for segment in stretch) == pytest.approx(stop - begin, abs=1e-5)
    np.testing.assert_allclose(stretch[0][:4], pose_at(path, begin), atol=1e-5)
    np.testing.assert_allclose(along(stretch[-1], stretch[-1][5]), pose_at(path, stop), atol=1e-4)
    np.testing.assert_allclose(integrated(stretch[0][:4], stretch, 0.2)[-1], pose_at(path, stop), atol=1e-3)
    points = sample(path, 20.0)
    np.testing.assert_allclose(points[0], start[:2], atol=1e-9)
    np.testing.assert_allclose(points[-1], end_of(path)[:2], atol=1e-6)
    assert np.hypot(*np.diff(points, axis=0).T).max() <= 20.0 + 1e-9
    middle = shapely.Point(pose_at(path, begin)[:2])
    # The chord of 20 m of the tightest arc here lies 0.33 m from it.
    assert shapely.LineString(points).distance(middle) < 0.34


@settings(deadline=None)
@given(start=POSES, pieces=PIECES, deviation=st.floats(0.01, 5.0))
def test_sample_keeps_chords_near_their_arcs(
    start: Pose, pieces: list[tuple[float, float]], deviation: float, integrated: Integrated
) -> None:
    segments = joined(start, pieces)
    line = shapely.LineString(sample(Path(np.array(segments)), math.inf, deviation))
    dense = integrated(start, segments, 2.0)[:, :2]
    assert shapely.distance(line, shapely.points(dense)).max() <= deviation + 0.02


def test_stations_beyond_the_ends_are_the_ends() -> None:
    path = Path(np.array([(0.0, 0.0, 1.0, 0.0, 0.0, 100.0)]))
    assert pose_at(path, -5.0) == (0.0, 0.0, 1.0, 0.0)
    assert pose_at(path, 105.0) == (100.0, 0.0, 1.0, 0.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_full_turn_ends_where_it_began_and_stays_on_its_side(side: float) -> None:
    pose = Pose(10.0, 20.0, 0.6, 0.8)
    path = Path(np.array([full_turn(pose, 150.0, side)]), loiter=True)
    np.testing.assert_allclose(end_of(path), pose, atol=1e-9)
    offset = sample(path, 5.0) - (10.0, 20.0)
    assert (side * (0.6 * offset[:, 1] - 0.8 * offset[:, 0]) > -1e-9).all()
    assert path.length_m == pytest.approx(math.tau * 150.0)


def shortest_turn_by_search(pose: Pose, target: Point, radius: float) -> float:
    """Length of the shortest turn that points at the target, found by following both turns in small steps."""
    lengths = [math.inf]
    for side in (1.0, -1.0):
        turn = np.linspace(0.0, math.tau, 20_001)
        course = math.atan2(pose.tangent_north, pose.tangent_east) + side * turn
        x = pose.east_m - side * radius * pose.tangent_north + side * radius * np.sin(course)
        y = pose.north_m + side * radius * pose.tangent_east - side * radius * np.cos(course)
        dx, dy = target[0] - x, target[1] - y
        off = side * (np.cos(course) * dy - np.sin(course) * dx)
        ahead = np.cos(course) * dx + np.sin(course) * dy > 0.0
        # The first place from which the target lies straight ahead: it passes from the inner to the outer side.
        found = np.flatnonzero((off[:-1] > 0.0) & (off[1:] <= 0.0) & ahead[:-1])
        if len(found):
            i = found[0]
            lengths.append(radius * turn[i] + math.hypot(dx[i], dy[i]))
    return min(lengths)


@settings(deadline=None)
@given(pose=POSES, away=st.floats(10.0, 3000.0), bearing=ANGLES, radius=st.floats(100.0, 600.0))
def test_turn_onto_is_the_shorter_tangent(pose: Pose, away: float, bearing: float, radius: float) -> None:
    target = (pose.east_m + away * math.cos(bearing), pose.north_m + away * math.sin(bearing))
    centres = [
        (pose.east_m - side * radius * pose.tangent_north, pose.north_m + side * radius * pose.tangent_east)
        for side in (1.0, -1.0)
    ]
    outside = [math.dist(centre, target) - radius for centre in centres]
    assume(min(abs(gap) for gap in outside) > 0.01 * radius)
    # Straight ahead and a whole turn differ by less than rounding.
    off = pose.tangent_east * math.sin(bearing) - pose.tangent_north * math.cos(bearing)
    assume(abs(off) > 0.01)
    segments = turn_onto(pose, target, radius)
    assert segments is not None
    length = sum(segment[5] for segment in segments)
    assert length == pytest.approx(shortest_turn_by_search(pose, target, radius), abs=2e-3 * radius)
    np.testing.assert_allclose(along(segments[-1], segments[-1][5])[:2], target, atol=1e-5)


def test_turn_onto_goes_straight_at_what_lies_ahead() -> None:
    segments = turn_onto(Pose(0.0, 0.0, 0.6, 0.8), (600.0, 800.0), 100.0)
    assert segments is not None
    assert sum(segment[5] for segment in segments) == pytest.approx(1000.0)


@settings(deadline=None)
@given(start=POSES, walk=WALKS, radius=st.floats(50.0, 300.0), cut=st.floats(1.0, 500.0))
def test_a_fillet_is_smooth_and_passes_its_corners_as_near_as_asked(
    start: Pose,
    walk: list[tuple[float, float]],
    radius: float,
    cut: float,
    assert_flyable: AssertFlyable,
) -> None:
    nodes = corners(start, walk)
    path = fillet(start, nodes, radius, cut)
    assume(path is not None)
    assert path is not None
    assert_flyable(path, radius)
    np.testing.assert_allclose(path.segments[0, :4], start, atol=1e-5)
    end = end_of(path)
    np.testing.assert_allclose(end[:2], nodes[-1], atol=1e-4)
    line = shapely.LineString(sample(path, 50.0, 0.01))
    polyline = [pose_at(path, 0.0)[:2], *nodes]
    for before, corner, after in zip(polyline, nodes, nodes[1:], strict=False):
        into = (corner[0] - before[0], corner[1] - before[1])
        out = (after[0] - corner[0], after[1] - corner[1])
        turn = abs(math.atan2(into[0] * out[1] - into[1] * out[0], into[0] * out[0] + into[1] * out[1]))
        if corner == nodes[0]:
            continue  # the first turn changes the course on which the first corner is met
        tightest = radius * (1.0 / math.cos(0.5 * turn) - 1.0)
        assert line.distance(shapely.Point(corner)) <= max(cut, tightest) + 0.05


@settings(deadline=None)
@given(radius=st.floats(50.0, 300.0), turn=st.floats(0.2, 2.2), cut=st.floats(1.0, 400.0))
def test_one_corner_is_cut_by_what_is_asked_and_room_allows(radius: float, turn: float, cut: float) -> None:
    leg = 4000.0
    corner = (leg, 0.0)
    end = (leg + leg * math.cos(turn), leg * math.sin(turn))
    path = fillet(Pose(0.0, 0.0, 1.0, 0.0), [corner, end], radius, cut)
    assert path is not None
    sharpness = 1.0 / math.cos(0.5 * turn) - 1.0
    widest = leg / math.tan(0.5 * turn)
    wanted = max(radius, min(cut / sharpness, widest))
    assert 1.0 / path.max_curvature_1pm == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize(
    ("nodes", "radius"),
    [
        ([(1000.0, 0.0), (1000.0, 90.0), (2000.0, 90.0)], 100.0),  # a step too narrow for its two turns
        ([(1000.0, 0.0), (0.0, 0.0)], 10.0),  # straight back
        ([(1000.0, 0.0), (1000.0, 0.0)], 10.0),  # a leg of no length
    ],
)
def test_what_cannot_be_rounded_has_no_fillet(nodes: list[Point], radius: float) -> None:
    assert fillet(Pose(0.0, 0.0, 1.0, 0.0), nodes, radius, 50.0) is None


def test_a_straight_run_through_nodes_is_straight() -> None:
    path = fillet(Pose(0.0, 0.0, 1.0, 0.0), [(300.0, 0.0), (700.0, 0.0), (1000.0, 0.0)], 100.0, 50.0)
    assert path is not None
    assert path.max_curvature_1pm == 0.0
    assert path.length_m == pytest.approx(1000.0)
