"""What is certified lies in space seen to be free, and nothing longer could have been."""

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.geometry.curves import Limits, Pose, between, pose_at, poses_at, sample
from planner.geometry.terrain import Terrain
from planner.interface import BoolArray, FloatArray, Path
from planner.shield.certificate import Certified, Certifier
from planner.shield.tracking import tracked
from tests.examples import examples
from tests.planner.rolling_window.test_rolling_window import Seen
from tests.planner.walls_and_paths import assert_flyable, path_of

RADIUS, ROLL, SPACING, HORIZON, KEEP = 100.0, 15.0, 20.0, 2000.0, 40.0
LIMITS = Limits(RADIUS, ROLL)
CERTIFIER = Certifier(LIMITS, KEEP, HORIZON, SPACING)
DISC_M = max(1.04 * RADIUS, RADIUS + 0.5 * KEEP)
WIDE = (-1e4, -1e4, 1e4, 1e4)
EAST = Pose(0.0, 0.0, 1.0, 0.0)
STRAIGHT = Path(np.array([(0.0, 0.0, 1.0, 0.0, 0.0, 1500.0)]))
BENDS = st.sampled_from([0.0, 1 / 300.0, -1 / 180.0, 1 / 120.0, -1 / 100.0])
PIECES = st.lists(st.tuples(BENDS, st.floats(50.0, 500.0)), min_size=1, max_size=5)


class FreeDiscs(Seen):
    """Space seen to be free: some discs."""

    def __init__(self, discs: FloatArray) -> None:
        super().__init__(np.zeros((0, 2)))
        self._discs = discs

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        return self.depth_m(points_m) < 0.0

    def depth_m(self, points_m: FloatArray) -> FloatArray:
        """(k,) how far points lie outside of all discs; 0 or less inside."""
        x, y, radius = self._discs.T[:, :, None]
        return np.asarray((np.hypot(points_m[:, 0] - x, points_m[:, 1] - y) - radius).min(axis=0))


def terrain(points: FloatArray | None = None) -> Terrain:
    points = np.zeros((0, 2)) if points is None else points
    return Terrain(points, np.full(len(points), KEEP), WIDE)


def filled_disc(path: Path, radius: float, spacing: float) -> FloatArray:
    """A dense sample of the disc about the middle of a path's closing turn."""
    x, y, tx, ty, curvature, _ = path.segments[-1]
    middle = (x - ty / curvature, y + tx / curvature)
    axis = np.arange(-radius, radius + spacing, spacing)
    dx, dy = (each.ravel() for each in np.meshgrid(axis, axis))
    inside = dx * dx + dy * dy <= radius * radius
    places: FloatArray = np.column_stack((dx[inside], dy[inside])) + middle
    return places


def assert_certified(found: Certified, path: Path, seen: FreeDiscs, points: FloatArray) -> None:
    """Free all along and in the whole disc, at its distance from points, and in one piece with the path."""
    assert_flyable(found.path, RADIUS)
    assert found.path.loiter
    closing = found.path.segments[-1]
    assert closing[5] == pytest.approx(math.tau * RADIUS)
    assert abs(closing[4]) == pytest.approx(1.0 / RADIUS)
    # Between the places that were asked it may be hidden by half their distance at most.
    assert seen.depth_m(sample(found.path, 2.0)).max() <= SPACING
    assert seen.depth_m(filled_disc(found.path, DISC_M - SPACING, 4.0)).max() <= SPACING
    line = shapely.LineString(sample(found.path, 5.0, 0.01))
    assert shapely.distance(line, shapely.points(points)).min(initial=math.inf) >= KEEP - 0.02
    arc_lengths_m = np.linspace(0.0, found.loiter_entry_m, 50)
    np.testing.assert_allclose(poses_at(found.path, arc_lengths_m), poses_at(path, arc_lengths_m), atol=1e-6)


@settings(max_examples=examples(40))
@given(pieces=PIECES, seed=st.integers(0, 2**32 - 1), count=st.integers(1, 8))
def test_what_is_certified_is_free(pieces: list[tuple[float, float]], seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    path = path_of(EAST, pieces)
    on_it = poses_at(path, rng.uniform(0.0, path.length_m, count))[:, :2]
    discs = np.column_stack((on_it + rng.normal(0.0, 80.0, (count, 2)), rng.uniform(150.0, 500.0, count)))
    seen = FreeDiscs(np.concatenate((discs, [(0.0, 0.0, 60.0)])))
    points = rng.uniform(-1500.0, 1500.0, (40, 2))
    line = shapely.LineString(sample(path, 10.0, 0.1))
    points = points[shapely.distance(line, shapely.points(points)) > KEEP + 1.0]
    if (ahead := CERTIFIER.certify_ahead(path, seen, terrain(points), math.inf)) is not None:
        assert_certified(ahead, path, seen, points)
    if (found := CERTIFIER.certify(path, seen, terrain(points))) is not None:
        assert_certified(found, path, seen, points)
        return
    # Nothing: then no disc beside the part of the path that is free is free of points and seen through.
    # Where even the coarse places are free the answer would have been another.
    free_to = CERTIFIER.seen_free_to_m(path, seen)
    for arc_length_m in free_to - 50.0 * np.arange(int(free_to / 50.0) + 1):
        for side in (1.0, -1.0):
            probe = Path(np.array([(*pose_at(path, arc_length_m), side / RADIUS, 1.0)]))
            if not seen.seen_free(filled_disc(probe, DISC_M, 3.0)).all():
                continue
            turn = Path(np.array([(*pose_at(path, arc_length_m), side / RADIUS, math.tau * RADIUS)]))
            bends = [row[4] for row in between(path, arc_length_m, arc_length_m + 1e-3)]
            opposite = any(side * bend < 0.0 for bend in bends) or side * path.segments[-1, 4] < 0.0
            assert opposite or not terrain(points).admits(turn)


@settings(max_examples=examples(30))
@given(free_m=st.floats(300.0, 1800.0))
def test_it_is_the_last_turn_off_the_path_that_is_free(free_m: float) -> None:
    # Free space ends in a straight front across the path (a very large disc).
    far = 1e7
    seen = FreeDiscs(np.array([(free_m - far, 0.0, far)]))
    found = CERTIFIER.certify(STRAIGHT, seen, terrain())
    assert found is not None
    assert_certified(found, STRAIGHT, seen, np.zeros((0, 2)))
    furthest = min(free_m - DISC_M, STRAIGHT.length_m)
    # The best on a grid of stations half a radius, or a 32nd of the free part, apart.
    assert furthest - max(0.5 * RADIUS, free_m / 32) - SPACING <= found.loiter_entry_m <= furthest + SPACING


def test_it_turns_to_the_side_that_is_free() -> None:
    for side in (1.0, -1.0):
        corridor = [(x, side * 90.0, 220.0) for x in np.arange(0.0, 1500.0, 50.0)]
        found = CERTIFIER.certify(STRAIGHT, FreeDiscs(np.array(corridor)), terrain())
        assert found is not None
        assert found.path.segments[-1, 4] * side > 0.0


def test_a_path_bending_behind_something_in_a_gap_is_left_straight_on() -> None:
    # Beyond the gap the path turns left, to where nothing was seen; the view goes straight on, to room on the right.
    path = path_of(EAST, [(0.0, 650.0), (1.0 / RADIUS, 0.5 * math.pi * RADIUS), (0.0, 900.0)])
    lane = [(x, 0.0, 70.0) for x in np.arange(0.0, 900.0, 20.0)]
    seen = FreeDiscs(np.array([*lane, (950.0, -100.0, 180.0)]))
    points = np.array([(600.0, -60.0), (600.0, 60.0)])
    assert CERTIFIER.certify(path, seen, terrain(points)) is None
    found = CERTIFIER.certify_ahead(path, seen, terrain(points), math.inf)
    assert found is not None
    assert_certified(found, path, seen, points)
    assert 500.0 < found.loiter_entry_m <= 700.0
    assert found.path.segments[-1, 4] < 0.0


def test_an_edge_point_in_the_turn_forbids_it_though_it_was_seen_free() -> None:
    seen = FreeDiscs(np.array([(0.0, 0.0, 1e5)]))
    found = CERTIFIER.certify(STRAIGHT, seen, terrain())
    assert found is not None
    assert found.loiter_entry_m == STRAIGHT.length_m
    # The only turn where the points are not is at the beginning.
    walls = np.array([(x, y) for x in np.arange(130.0, 1800.0, 20.0) for y in (-60.0, 60.0)])
    less = CERTIFIER.certify(STRAIGHT, seen, terrain(walls))
    assert less is None or less.loiter_entry_m < 130.0


def test_a_tip_inside_the_circle_but_not_on_it_forbids_the_turn() -> None:
    # Free is a ring along the turning circle; its middle is not seen.
    path = Path(np.array([(0.0, 0.0, 1.0, 0.0, 0.0, 10.0)]))
    angle = np.arange(0.0, math.tau, 0.1)
    for side in (1.0, -1.0):
        ring = np.column_stack((RADIUS * np.cos(angle), side * RADIUS + RADIUS * np.sin(angle)))
        seen = FreeDiscs(np.column_stack((ring, np.full(len(ring), 50.0))))
        assert CERTIFIER.certify(path, seen, terrain()) is None


def test_a_turn_against_the_bend_of_the_path_begins_after_room_to_roll() -> None:
    path = path_of(EAST, [(1 / 200.0, 300.0), (0.0, 1.0)])
    seen = FreeDiscs(np.array([(100.0, 0.0, 3000.0)]))
    x, y, tx, ty = pose_at(path, path.length_m)
    # Points to the left of the end leave only turns to the right.
    beside = 130.0 * np.array([-ty, tx]) + (x, y)
    along_it = np.array([(tx, ty)]) * np.arange(0.0, 170.0, 20.0)[:, None]
    found = CERTIFIER.certify(path, seen, terrain(beside + along_it))
    assert found is not None
    assert_certified(found, path, seen, beside + along_it)
    assert all(a * b >= 0.0 for a, b in pairwise([row[4] for row in found.path.segments.tolist()]))


def test_a_turn_that_begins_after_room_to_roll_is_free_where_it_is_flown() -> None:
    fine, roll = 4.0, 60.0
    certifier = Certifier(Limits(RADIUS, roll), KEEP, HORIZON, fine)
    path = path_of(EAST, [(1 / 200.0, 300.0)])
    x, y, tx, ty = pose_at(path, path.length_m)
    # Free is the path, and the disc of a right turn that begins at its end without rolling.
    disc = (x + RADIUS * ty, y - RADIUS * tx, DISC_M + fine)
    seen = FreeDiscs(np.array([*((east, north, 15.0) for east, north in sample(path, 5.0)), disc]))
    found = certifier.certify(path, seen, terrain())
    assert found is None or seen.depth_m(sample(found.path, 2.0)).max() <= fine


def test_a_path_beside_the_aircraft_is_tracked_on_the_arc_to_a_place_ahead() -> None:
    # 2 x / L^2 (Coulter) to a place 10 m to the left, eight steps of at most R / 12 ahead: the first from 0.6 R on.
    track = tracked(Pose(0.0, -10.0, 1.0, 0.0), 0.0, STRAIGHT, 0.0, Limits(RADIUS, 0.0), 500.0)
    assert track is not None
    assert track.path.segments[0, 4] == pytest.approx(20.0 / ((8.0 * RADIUS / 12.0) ** 2 + 10.0**2), rel=0.02)


def test_nothing_is_certified_beyond_where_a_path_is_cut() -> None:
    space = FreeDiscs(np.array([(700.0, 0.0, 3000.0)]))
    whole = CERTIFIER.certify(STRAIGHT, space, terrain())
    cut = CERTIFIER.certify(STRAIGHT, space, terrain(), 600.0)
    assert whole is not None
    assert cut is not None
    assert whole.loiter_entry_m > 1400.0
    assert 500.0 < cut.loiter_entry_m <= 600.0
    for least_m in (0.0, 0.3 * RADIUS):
        least = CERTIFIER.certify(STRAIGHT, space, terrain(), least_m)
        assert least is not None
        assert least.loiter_entry_m == least_m


OVER_M, AREA = 1400.0, (-10.0, -30.0, 1450.0, 500.0)


class FreeBox(FreeDiscs):
    """Free are all places of a rectangle."""

    def __init__(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        super().__init__(np.zeros((0, 3)))
        self._low, self._high = low, high

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        free: BoolArray = np.all((points_m >= self._low) & (points_m <= self._high), axis=1)
        return free


def test_a_path_is_certified_until_the_flight_is_over_where_it_and_its_sides_are_free() -> None:
    cases = ((-30, 0, 20, True), (-30, -1, 20, False), (-30, 0, 19, False), (-19, 0, 20, False))
    for south, east, north, free in cases:
        found = CERTIFIER.certify_up_to(OVER_M, STRAIGHT, FreeBox((0.0, south), (OVER_M + east, north)), AREA)
        assert (found is not None) is free
        assert found is None or (found.path is STRAIGHT and found.loiter_entry_m == OVER_M)


@pytest.mark.parametrize(("reach_m", "free"), [(750.0, True), (650.0, False)])
def test_no_path_is_certified_to_its_end_over_what_is_hidden_in_between(reach_m: float, free: bool) -> None:
    seen = FreeDiscs(np.array([(0.0, 0.0, reach_m), (OVER_M, 0.0, reach_m)]))
    assert (CERTIFIER.certify_up_to(OVER_M, STRAIGHT, seen, WIDE) is not None) is free


def test_outside_of_the_area_nothing_has_to_be_free() -> None:
    seen = FreeBox((0.0, -5.0), (OVER_M, 20.0))
    assert CERTIFIER.certify_up_to(OVER_M, STRAIGHT, seen, (-10.0, -5.0, 1450.0, 500.0)) is not None
    assert CERTIFIER.certify_up_to(OVER_M, STRAIGHT, seen, (-10.0, 1.0, 1450.0, 500.0)) is None
    assert CERTIFIER.certify_up_to(OVER_M, STRAIGHT, seen, (-10.0, -5.0, OVER_M - 1.0, 500.0)) is None


def test_a_path_of_which_only_the_end_is_hidden_is_not_seen_free_to_its_end() -> None:
    assert CERTIFIER.seen_free_to_m(STRAIGHT, FreeDiscs(np.array([(0.0, 0.0, 1499.9)]))) < STRAIGHT.length_m
