"""Curves against numerical integration and brute force."""

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from planner.geometry.curves import (
    Limits,
    Point,
    Pose,
    along,
    between,
    end_of,
    fillet,
    full_turn,
    moved,
    on_loiter,
    onward,
    onward_in_turn,
    place_on,
    places_along,
    pose_at,
    poses_at,
    sample,
    turn_centres,
    turn_onto,
)
from planner.interface import Path
from tests.examples import examples
from tests.planner.walls_and_paths import PIECES, assert_flyable, integrated, joined, path_of

EAST = Pose(0.0, 0.0, 1.0, 0.0)
ANGLES = st.floats(-math.pi, math.pi)
POSES = st.builds(
    lambda x, y, course: Pose(x, y, math.cos(course), math.sin(course)),
    st.floats(-5e3, 5e3),
    st.floats(-5e3, 5e3),
    ANGLES,
)
WALKS = st.lists(st.tuples(st.floats(600.0, 5000.0), st.floats(-2.2, 2.2)), min_size=1, max_size=6)


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


@given(start=POSES, pieces=PIECES, share=st.floats(0.0, 1.0), more=st.floats(0.0, 1.0))
def test_pose_sample_and_stretch_agree(
    start: Pose, pieces: list[tuple[float, float]], share: float, more: float
) -> None:
    path = path_of(start, pieces)
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
    # The chord of 20 m of the tightest arc here lies 0.33 m from it.
    assert shapely.LineString(points).distance(shapely.Point(pose_at(path, begin)[:2])) < 0.34


@given(start=POSES, pieces=PIECES, deviation=st.floats(0.01, 5.0))
def test_sample_keeps_chords_near_their_arcs(start: Pose, pieces: list[tuple[float, float]], deviation: float) -> None:
    segments = joined(start, pieces)
    line = shapely.LineString(sample(Path(np.array(segments)), math.inf, deviation))
    dense = integrated(start, segments, 2.0)[:, :2]
    assert shapely.distance(line, shapely.points(dense)).max() <= deviation + 0.02


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
        # The first place with the target straight ahead: there it passes from the inner to the outer side.
        if len(found := np.flatnonzero((off[:-1] > 0.0) & (off[1:] <= 0.0) & ahead[:-1])):
            i = found[0]
            lengths.append(radius * turn[i] + math.hypot(dx[i], dy[i]))
    return min(lengths)


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
    assume(abs(pose.tangent_east * math.sin(bearing) - pose.tangent_north * math.cos(bearing)) > 0.01)
    segments = turn_onto(pose, target, radius)
    assert segments is not None
    length = sum(segment[5] for segment in segments)
    assert length == pytest.approx(shortest_turn_by_search(pose, target, radius), abs=2e-3 * radius)
    np.testing.assert_allclose(along(segments[-1], segments[-1][5])[:2], target, atol=1e-5)


@given(
    start=POSES,
    walk=WALKS,
    limits=st.builds(Limits, st.floats(50.0, 300.0), st.sampled_from([0.0, 60.0])),
    cut=st.floats(0.0, 500.0),
    before=st.sampled_from([-1.0, 0.0, 1.0]),
)
def test_a_fillet_is_smooth_and_passes_its_corners_as_near_as_asked(
    start: Pose, walk: list[tuple[float, float]], limits: Limits, cut: float, before: float
) -> None:
    nodes = corners(start, walk)
    path = fillet(start, nodes, limits, cut, before / limits.radius_m)
    assume(path is not None)
    assert path is not None
    assert_flyable(path, limits.radius_m)
    # A left and a right turn are parted by a straight run, also that which ends at the start.
    last, straight = before, 0.0
    for *_, curvature, length in path.segments.tolist():
        if curvature == 0.0:
            straight += length
            continue
        if curvature * last < 0.0:
            assert straight >= limits.roll_m - 1e-5
        last, straight = curvature, 0.0
    np.testing.assert_allclose(path.segments[0, :4], start, atol=1e-5)
    np.testing.assert_allclose(end_of(path)[:2], nodes[-1], atol=1e-4)
    line = shapely.LineString(sample(path, 50.0, 0.01))
    # The first turn changes the course on which the first corner is met: corners after it are judged.
    for into, corner, after in zip(nodes, nodes[1:], nodes[2:], strict=False):
        ax, ay = corner[0] - into[0], corner[1] - into[1]
        bx, by = after[0] - corner[0], after[1] - corner[1]
        turn = abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by))
        tightest = limits.radius_m * (1.0 / math.cos(0.5 * turn) - 1.0)
        assert line.distance(shapely.Point(corner)) <= max(cut, tightest) + 0.05


def test_a_turn_against_the_one_before_begins_after_the_room_to_roll() -> None:
    limits = Limits(100.0, 40.0)
    behind_right = [(-1000.0, -500.0)]
    at_once = fillet(EAST, behind_right, limits, 0.0)
    against = fillet(EAST, behind_right, limits, 0.0, 1.0 / 100.0)
    assert at_once is not None
    assert against is not None
    assert at_once.segments[0, 4] == pytest.approx(-0.01)
    np.testing.assert_allclose(against.segments[0], (0.0, 0.0, 1.0, 0.0, 0.0, 40.0))
    assert against.segments[1, 4] == pytest.approx(-0.01)


@pytest.mark.parametrize(
    ("nodes", "radius"),
    [
        ([(1000.0, 0.0), (1000.0, 90.0), (2000.0, 90.0)], 100.0),  # a step too narrow for its two turns
        ([(1000.0, 0.0), (0.0, 0.0)], 10.0),  # straight back
        ([(1000.0, 0.0), (1000.0, 0.0)], 10.0),  # a leg of no length
        ([(0.0, 0.0)], 10.0),  # the start itself
    ],
)
def test_what_cannot_be_rounded_has_no_fillet(nodes: list[Point], radius: float) -> None:
    assert fillet(EAST, nodes, Limits(radius, 0.0), 50.0) is None


@settings(max_examples=examples(30))
@given(start=POSES, pieces=PIECES, shares=st.lists(st.floats(-0.2, 1.2), min_size=1, max_size=20))
def test_poses_at_many_stations_are_those_of_integration(
    start: Pose, pieces: list[tuple[float, float]], shares: list[float]
) -> None:
    path = path_of(start, pieces)
    arc_lengths_m = np.array(shares) * path.length_m
    found = poses_at(path, arc_lengths_m)
    assert found.shape == (len(shares), 4)
    for arc_length_m, pose in zip(arc_lengths_m.tolist(), found, strict=True):
        kept = between(path, 0.0, arc_length_m)
        expected = integrated(start, kept, 0.5)[-1] if kept else np.array(start)
        np.testing.assert_allclose(pose[:2], expected[:2], atol=5e-3)
        np.testing.assert_allclose(pose[2:], expected[2:], atol=1e-6)
        np.testing.assert_allclose(pose, pose_at(path, arc_length_m), atol=1e-6)
    end_m = float(arc_lengths_m.max())
    even = np.linspace(0.0, end_m, len(shares) + 1)
    np.testing.assert_allclose(places_along(path, end_m, len(shares)), poses_at(path, even)[:, :2], atol=1e-6)


@settings(max_examples=examples(30))
@given(start=POSES, pieces=PIECES, share=st.floats(0.0, 1.0))
# Its length less that of the first segment is more than that of the last, by a rounding.
@example(
    start=Pose(0.0, 0.0, 1.0, 0.0),
    pieces=[(0.0, 124.35687337714592), (1 / 900.0, 899.7551453830558)],
    share=1.0,
)
def test_turns_off_a_path_begin_after_a_straight_where_it_turns_the_other_way(
    start: Pose, pieces: list[tuple[float, float]], share: float
) -> None:
    path = path_of(start, pieces)
    arc_length_m = share * path.length_m
    pose, bend = place_on(path, arc_length_m)
    centres = turn_centres(path, np.array([0.0, arc_length_m]), 100.0, 15.0)
    assert centres.shape == (2, 2, 2)
    for side, centre in zip((1.0, -1.0), centres[1], strict=True):
        begins = along((*pose, 0.0, 0.0), 15.0) if side * bend < 0.0 else pose
        across = along((*begins, side / 100.0, 0.0), 100.0 * math.pi)
        np.testing.assert_allclose(centre, np.add(begins[:2], across[:2]) / 2.0, atol=1e-6)


@settings(max_examples=examples(30))
@given(
    start=POSES,
    pieces=PIECES,
    side=st.sampled_from([1.0, -1.0]),
    share=st.floats(0.0, 1.0),
    further=st.floats(1.0, 4000.0),
)
def test_onward_goes_round_the_loiter_as_integration_does(
    start: Pose, pieces: list[tuple[float, float]], side: float, share: float, further: float
) -> None:
    before = joined(start, pieces)
    turn = full_turn(along(before[-1], before[-1][5]), 150.0, side)
    path = Path(np.array([*before, turn]), loiter=True)
    arc_length_m = share * path.length_m
    stretch = onward(path, arc_length_m, further)
    assert sum(segment[5] for segment in stretch) == pytest.approx(further, abs=1e-4)
    # The truth: the path with so many turns at its end that it cannot run out.
    endless = Path(np.array([*before, *[turn] * 8]))
    np.testing.assert_allclose(stretch[0][:4], pose_at(endless, arc_length_m), atol=1e-5)
    end = integrated(pose_at(endless, arc_length_m), stretch, 0.5)[-1]
    truth = integrated(start, between(endless, 0.0, arc_length_m + further), 0.5)[-1]
    np.testing.assert_allclose(end, truth, atol=2e-2)
    np.testing.assert_allclose(
        along(stretch[-1], stretch[-1][5]), pose_at(path, on_loiter(path, arc_length_m + further)), atol=1e-4
    )


@given(start=POSES, to=POSES, pieces=PIECES)
def test_moved_segments_are_the_same_curve_from_another_pose(
    start: Pose, to: Pose, pieces: list[tuple[float, float]]
) -> None:
    segments = joined(start, pieces)
    elsewhere = moved(segments, to)
    np.testing.assert_allclose(elsewhere[0][:4], to, atol=1e-9)
    np.testing.assert_array_equal(np.array(elsewhere)[:, 4:], np.array(segments)[:, 4:])
    for before, after in itertools.pairwise(elsewhere):
        np.testing.assert_allclose(along(before, before[5]), after[:4], atol=1e-6)
    # Turned as a whole: distances from the first place stay.
    away, there = (np.hypot(*(np.array(rows)[:, :2] - rows[0][:2]).T) for rows in (segments, elsewhere))
    np.testing.assert_allclose(there, away, atol=1e-6)
    np.testing.assert_allclose(moved(elsewhere, start), segments, atol=1e-5)
    for _ in range(100):  # as an aircraft does that begins each plan on the one before
        elsewhere = moved(elsewhere, Pose(*elsewhere[0][:4]))
    np.testing.assert_allclose(moved(elsewhere, start), segments, atol=1e-5)


@given(
    curvature=st.floats(1e-4, 1e-2).flatmap(lambda bend: st.sampled_from((bend, -bend))),
    course=st.floats(-math.pi, math.pi),
    share=st.floats(0.001, 0.999),
)
def test_a_turn_comes_by_each_of_its_poses(curvature: float, course: float, share: float) -> None:
    pose = Pose(300.0, -200.0, math.cos(course), math.sin(course))
    round_m = math.tau / abs(curvature)
    arc = onward_in_turn(pose, curvature, along((*pose, curvature, round_m), share * round_m))
    assert arc is not None
    assert len(arc) == 1
    assert arc[0][:5] == (*pose, curvature)
    assert arc[0][5] == pytest.approx(share * round_m)


def test_only_on_a_turn_there_is_a_way_on_in_it() -> None:
    pose = Pose(0.0, 0.0, 1.0, 0.0)
    assert onward_in_turn(pose, 0.0, pose) is None
    assert onward_in_turn(pose, 0.01, pose) == []
    assert onward_in_turn(pose, 0.01, Pose(100.0, 101.0, 0.0, 1.0)) is None
    assert onward_in_turn(pose, 0.01, Pose(100.0, 100.0, 0.0, -1.0)) is None
