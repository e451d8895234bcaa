"""The boundary of grown obstacles against shapely's buffers."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import islice

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.baselines.boundary import GrownObstacles
from planner.geometry.curves import sample
from planner.interface import BoolArray, FloatArray, Mission, MovingEdges, Path

MISSION = Mission(
    (9000.0, 9000.0), 50.0, (0.0, 0.0, 10_000.0, 10_000.0), 200.0, 100.0, 25.0, 1.0, 3.0, 3000.0
)
KEEP = 220.0
MakePoints = Callable[..., FloatArray]


class Seen:
    spacing_m = 50.0
    moving: tuple[MovingEdges, ...] = ()
    last_contradiction_s = -math.inf

    def __init__(self, points: FloatArray) -> None:
        self.points, self.revision, self.last_removal_revision = points, 1, 0

    def edges_since(self, revision: int) -> FloatArray:
        return self.points if revision < self.revision else np.zeros((0, 2))

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        return np.zeros(len(points_m), dtype=np.bool_)


def grown(points: FloatArray) -> GrownObstacles:
    known = GrownObstacles(MISSION, KEEP - MISSION.clearance_m)
    known.take_in(Seen(points))
    return known


@settings(max_examples=20, derandomize=True)
@given(
    points=st.lists(
        st.tuples(st.floats(4000.0, 5000.0), st.floats(4000.0, 5000.0)), min_size=1, max_size=14, unique=True
    ),
    side=st.sampled_from([1.0, -1.0]),
)
def test_the_arcs_are_the_outline_of_the_union_of_discs(
    points: list[tuple[float, float]], side: float
) -> None:
    centers = np.array(points)
    known = grown(centers)
    disc, seat = known.seat((3000.0, 4500.0))
    union = shapely.buffer(shapely.MultiPoint(centers), KEEP, quad_segs=256)
    part = next(
        each for each in shapely.get_parts(union) if shapely.distance(each, shapely.Point(seat)) < 1.0
    )
    outline = shapely.get_exterior_ring(part)
    length = 0.0
    for contact in known.contacts(disc, seat, side):
        angles = np.linspace(contact.begin_rad, contact.end_rad, 5)
        places = known.points_m[contact.disc] + KEEP * np.column_stack(
            (np.cos(angles), side * np.sin(angles))
        )
        assert (shapely.distance(outline, shapely.points(places)) < 0.02).all()
        arc = KEEP * (contact.end_rad - contact.begin_rad)
        if length + arc >= outline.length:
            break
        length += arc
    # After one length of the outline it is back where it began: nothing is left out and nothing followed twice.
    angle = contact.begin_rad + (outline.length - length) / KEEP
    end = known.points_m[contact.disc] + KEEP * np.array((math.cos(angle), side * math.sin(angle)))
    assert math.dist(end, seat) < 1.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_straight_wall_is_followed_on_a_straight_line(side: float, wall: MakePoints) -> None:
    known = grown(wall((3000.0, 5000.0), (7000.0, 5000.0), 50.0))
    place = (4000.0, 5000.0 - side * KEEP)
    disc, seat = known.seat(place)
    way = known.path_along(place, list(islice(known.contacts(disc, seat, side), 30)), side)
    places = sample(Path(np.array(way)), 10.0)[20:-10]
    np.testing.assert_allclose(np.abs(places[:, 1] - 5000.0), KEEP, atol=1e-6)
    assert abs(places[-1, 0] - 4000.0) > 1000.0


def test_a_hollow_corner_is_cut_at_the_kept_distance(wall: MakePoints) -> None:
    points = np.concatenate(
        (wall((3000.0, 3000.0), (6000.0, 3000.0), 50.0), wall((6000.0, 3000.0), (6000.0, 6000.0), 50.0))
    )
    known = grown(points)
    disc, seat = known.seat((4000.0, 3000.0 + KEEP))
    way = known.path_along(seat, list(islice(known.contacts(disc, seat, -1.0), 80)), -1.0)
    places = sample(Path(np.array(way)), 5.0)
    off = shapely.distance(shapely.MultiPoint(points), shapely.points(places))
    assert off.min() > KEEP - 1e-3
    assert off.max() < 1.05 * KEEP
    assert places[-1, 1] > 4000.0
    assert shapely.LineString(places).is_simple


@pytest.mark.parametrize("place", [(5000.0, 5400.0), (5000.0, 5110.0), (5150.0, 5000.0), (4910.0, 4950.0)])
def test_a_seat_is_the_nearest_place_of_the_boundary(place: tuple[float, float]) -> None:
    centers = np.array([(5000.0, 5000.0), (5150.0, 5000.0), (4900.0, 4950.0), (5000.0, 4800.0)])
    disc, seat = grown(centers).seat(place)
    boundary = shapely.boundary(shapely.buffer(shapely.MultiPoint(centers), KEEP, quad_segs=512))
    assert shapely.distance(boundary, shapely.Point(seat)) < 0.01
    assert math.dist(seat, place) == pytest.approx(shapely.distance(boundary, shapely.Point(place)), abs=0.01)
    assert math.dist(seat, centers[disc - len(grown(np.zeros((0, 2))).points_m)]) == pytest.approx(KEEP)


def covers(known: GrownObstacles, place: tuple[float, float]) -> bool:
    """Whether a place lies inside a disc."""
    return bool((np.hypot(*(known.points_m - place).T) < known.radii_m).any())


def test_the_bounds_are_a_wall_with_all_of_the_area_but_the_margin_inside() -> None:
    known = grown(np.zeros((0, 2)))
    inside = [(25.0, 5000.0), (5000.0, 25.0), (9975.0, 5000.0), (25.0, 25.0), (9975.0, 9975.0)]
    assert not any(covers(known, place) for place in inside)
    assert all(
        covers(known, place) for place in [(5.0, 5000.0), (5000.0, 9995.0), (-1.0, -1.0), (3333.0, 4.0)]
    )


def test_what_is_taken_back_is_forgotten() -> None:
    known = GrownObstacles(MISSION, 20.0)
    seen = Seen(np.array([(5000.0, 5000.0), (3000.0, 3000.0)]))
    assert known.take_in(seen)[1] is False
    assert covers(known, (3000.0, 3100.0))
    seen.points, seen.revision, seen.last_removal_revision = seen.points[:1], 2, 2
    fresh, taken_back = known.take_in(seen)
    assert taken_back
    assert len(fresh) == 1
    assert covers(known, (5000.0, 5100.0))
    assert not covers(known, (3000.0, 3100.0))


def test_labels_stay_with_their_points_while_something_moves_a_little() -> None:
    known = GrownObstacles(MISSION, 20.0)
    seen = Seen(np.array([(3000.0, 3000.0)]))
    outline = np.array([(8000.0, 8000.0), (8050.0, 8000.0)])
    seen.moving = (MovingEdges(0.0, outline, (1.0, 0.0)),)
    known.take_in(seen)
    seen.points = np.array([(3000.0, 3000.0), (6000.0, 3000.0), (6050.0, 3000.0)])
    seen.revision, seen.moving = 2, (MovingEdges(0.5, outline + 0.5, (1.0, 0.0)),)
    known.take_in(seen)
    of_place = dict(zip(map(tuple, known.points_m.tolist()), known.labels.tolist(), strict=True))
    assert of_place[6000.0, 3000.0] == of_place[6050.0, 3000.0] != of_place[8000.0, 8000.0]
    assert len({of_place[place] for place in [(3000.0, 3000.0), (6000.0, 3000.0), (8000.0, 8000.0)]}) == 3


def test_turned_back_tells_inward_from_outward() -> None:
    known = grown(np.array([(5000.0, 5000.0)]))
    assert known.turned_back((5000.0 - KEEP, 5000.0), (9000.0, 5000.0))
    assert not known.turned_back((5000.0 + KEEP, 5000.0), (9000.0, 5000.0))
