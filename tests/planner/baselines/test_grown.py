"""The boundary of grown obstacles against discs drawn by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.baselines.grown import GrownObstacles
from planner.baselines.polyline import length_of
from planner.contract import GivenMap
from planner.interface import FloatArray, Mission, NoWayToBegin
from tests.planner.walls_and_paths import wall

MISSION = Mission((9000.0, 9000.0), 50.0, (0.0, 0.0, 10_000.0, 10_000.0), 200.0, 100.0, 25.0, 1.0, 3.0, 3000.0)
KEEP, SIMPLER_M = 220.0, 4.0


def grown(points: FloatArray) -> GrownObstacles:
    known = GrownObstacles(MISSION, KEEP - MISSION.clearance_m)
    known.take_in(GivenMap(points))
    return known


def covers(known: GrownObstacles, place: tuple[float, float]) -> bool:
    """Whether a line north of 1 m from a place runs through an obstacle."""
    return known.first_hit((place[0], place[1] - 300.0), place)[0] < 300.0


@settings(max_examples=20, derandomize=True, deadline=None)
@given(
    points=st.lists(
        st.tuples(st.floats(4000.0, 5000.0), st.floats(4000.0, 5000.0)), min_size=1, max_size=14, unique=True
    ),
    side=st.sampled_from([1.0, -1.0]),
)
def test_a_boundary_goes_once_round_a_union_of_discs(points: list[tuple[float, float]], side: float) -> None:
    union = shapely.buffer(shapely.MultiPoint(points), KEEP, quad_segs=256)
    part = min(shapely.get_parts(union), key=lambda each: each.distance(shapely.Point(3000.0, 4500.0)))
    foot = part.exterior.interpolate(part.exterior.project(shapely.Point(3000.0, 4500.0)))
    way = grown(np.array(points)).boundary((foot.x, foot.y), side, 1e9)
    assert part.exterior.distance(shapely.points(way)).max() < SIMPLER_M + 1.0
    assert length_of(way) == pytest.approx(part.exterior.length, rel=0.02)
    np.testing.assert_allclose(way[0], way[-1], atol=1e-6)
    ring = shapely.LinearRing(way)
    assert ring.is_ccw == (side > 0.0)  # the obstacle is on the left of a way counter-clockwise


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_straight_wall_is_followed_on_a_straight_line(side: float) -> None:
    known = grown(wall((3000.0, 5000.0), (7000.0, 5000.0), 50.0))
    way = known.boundary((4500.0, 5000.0 - side * KEEP), side, 1200.0)
    np.testing.assert_allclose(np.abs(way[:, 1] - 5000.0), KEEP, atol=SIMPLER_M)
    assert abs(way[-1, 0] - way[0, 0]) == pytest.approx(1200.0, abs=5.0)
    assert len(way) < 8


def test_the_bounds_are_a_wall_with_all_of_the_area_but_the_margin_inside() -> None:
    known = grown(np.zeros((0, 2)))
    assert not any(covers(known, place) for place in [(25.0, 5000.0), (5000.0, 9975.0), (9975.0, 9975.0)])
    assert all(covers(known, place) for place in [(5.0, 5000.0), (5000.0, 9995.0), (9990.0, 400.0)])


def test_what_is_taken_back_is_forgotten() -> None:
    known = GrownObstacles(MISSION, 20.0)
    points = np.array([(5000.0, 5000.0), (3000.0, 3000.0)])
    assert known.take_in(GivenMap(points))[1] is False
    assert covers(known, (3000.0, 3100.0))
    gone = GivenMap(points[:1])
    gone.revision = gone.last_removal_revision = 2
    fresh, edges_removed = known.take_in(gone)
    assert edges_removed
    assert len(fresh) == 1
    assert covers(known, (5000.0, 5100.0))
    assert not covers(known, (3000.0, 3100.0))


def test_an_area_without_room_is_told() -> None:
    known = GrownObstacles(replace(MISSION, clearance_m=9000.0), 20.0)
    known.take_in(GivenMap(np.array([(5000.0, 5000.0)])))
    with pytest.raises(NoWayToBegin, match="room 9,020 m away"):
        known.part_at((1000.0, 1000.0))


def test_lines_from_a_boundary_lead_inside_or_away() -> None:
    known = grown(np.array([(5000.0, 5000.0)]))
    assert known.leads_inside((5000.0 - KEEP, 5000.0), (9000.0, 5000.0))
    assert not known.leads_inside((5000.0 + KEEP, 5000.0), (9000.0, 5000.0))
    hit_m, *_ = known.first_hit((4000.0, 5000.0), (6000.0, 5000.0))
    assert hit_m == pytest.approx(1000.0 - KEEP, abs=SIMPLER_M)


def test_tangents_touch_a_disc_on_either_side() -> None:
    """From a place d from the centre of a disc of radius r they are sqrt(d^2 - r^2) long."""
    known = grown(np.array([(5000.0, 5000.0)]))
    found = known.tangents((4000.0, 5000.0), {known.part_at((4780.0, 5000.0))}, 3000.0)
    assert sorted(each.side for each in found) == [-1.0, 1.0]
    for (east, north), side, seen, dent in found:
        assert seen
        assert not dent
        assert math.copysign(1.0, 5000.0 - north) == side  # the disc is on the left of the southern one
        away_m = math.sqrt(1000.0**2 - KEEP**2)
        assert math.dist((east, north), (4000.0, 5000.0)) == pytest.approx(away_m, abs=45.0)


def test_what_hides_is_what_a_line_enters_first() -> None:
    near, far, place = (2000.0, 5000.0), (4000.0, 5000.0), (1000.0, 5000.0)
    known = grown(np.array([near, far]))
    which = {each: known.part_at((each[0] - KEEP, each[1])) for each in (near, far)}
    assert known.hiding(place, [(5000.0, 5000.0)]) == {which[near]}
    assert known.hiding(place, []) == set()
    assert known.hiding((3000.0, 5000.0), [(5000.0, 5000.0), (0.0, 5000.0)]) == {which[near], which[far]}


def test_a_line_past_one_disc_and_onto_another_of_the_same_obstacle_touches_a_dent() -> None:
    """Two discs that overlap: the line north past the first one runs into the second one."""
    known = grown(np.array([(5000.0, 5000.0), (5300.0, 5150.0)]))
    place = (4000.0, 5000.0)
    found = [each for each in known.tangents(place, {known.part_at((4780.0, 5000.0))}, 3000.0) if each.seen]
    lengths = {each.side: math.dist(each.place, place) for each in found if not each.dent}
    (dent,) = (each for each in found if each.dent)
    first = math.sqrt(1000.0**2 - KEEP**2)
    assert lengths[1.0] == pytest.approx(first, abs=45.0)
    assert lengths[-1.0] == pytest.approx(math.sqrt(1300.0**2 + 150.0**2 - KEEP**2), abs=45.0)
    assert math.dist(dent.place, place) == pytest.approx(first, abs=45.0)
    assert dent.place[1] > 5000.0


def test_two_walls_that_the_border_joins_are_as_near_to_the_goal_as_each_is() -> None:
    """A planner that takes them for one leaves neither, and calls a goal unreachable that is not."""
    far = wall((0.0, 3000.0), (3000.0, 3000.0), 50.0)
    known = grown(np.concatenate((far, wall((10_000.0, 8000.0), (8000.0, 8000.0), 50.0))))
    assert known.part_at((1500.0, 3000.0 + KEEP)) == known.part_at((9500.0, 8000.0 + KEEP))
    told = known.nearest_to_goal_m((1500.0, 3000.0 + KEEP))
    assert told == pytest.approx(math.dist((3000.0, 3000.0), MISSION.goal_m) - KEEP, abs=SIMPLER_M)
    assert known.nearest_to_goal_m((9500.0, 8000.0 + KEEP)) == pytest.approx(1000.0 - KEEP, abs=SIMPLER_M)
