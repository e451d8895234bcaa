"""The obstacle map where the poses of scans err: what is seen from nearer by counts."""

from __future__ import annotations

import math

import numpy as np
import pytest

from harness.mapping.obstacle_map import ObstacleMap
from tests.harness.looking import BOUNDS, CLEARANCE, RANGE, WALL, FloatArray, scans, sensor, world_of

TURNED_RAD = math.radians(3.0)
NORTH_M = 6000.0
"""The face of the wall."""
EAST_RAD, SPACING_M = 0.5 * math.pi, 0.25 * CLEARANCE


def nearest_m(shifted: bool, turned_rad: float) -> FloatArray:
    """(8,) how far beyond the wall its edges are at the least, every quarter of the clearance along it.

    The aircraft has flown along it at the clearance, by a heading that errs, and is beside these places now.
    """
    seen = ObstacleMap(BOUNDS, CLEARANCE, RANGE, doubtful=False, shifted=shifted)
    way = [(2500.0 + 12.5 * step, NORTH_M - CLEARANCE) for step in range(193)]
    for scan in scans(sensor(world_of(WALL)), way, heading_rad=EAST_RAD):
        seen.update(scan.taken_from(scan.east_m, scan.north_m, scan.heading_rad + turned_rad))
    edges = seen.edges_since(-1)
    along = np.floor((edges[:, 0] - way[-1][0]) / SPACING_M)
    return np.array([edges[along == place, 1].min() - NORTH_M for place in range(-4, 4)])


@pytest.mark.parametrize("turned_rad", [-TURNED_RAD, TURNED_RAD])
def test_a_wall_is_no_further_off_than_the_heading_misplaces_it_a_clearance_away(turned_rad: float) -> None:
    beyond_m = nearest_m(True, turned_rad)
    assert beyond_m.max() < 1.05 * TURNED_RAD * CLEARANCE
    assert beyond_m.min() > -2.0 * TURNED_RAD * CLEARANCE


def test_what_has_moved_comes_in_anew_and_is_taken_back_where_it_was() -> None:
    seen = ObstacleMap(BOUNDS, CLEARANCE, RANGE, doubtful=False, shifted=True)
    way = [(3000.0, NORTH_M - CLEARANCE), (4000.0, NORTH_M - CLEARANCE)]
    far, near = scans(sensor(world_of(WALL)), way, heading_rad=EAST_RAD)
    seen.update(far.taken_from(far.east_m, far.north_m, far.heading_rad - math.radians(1.0)))
    before, revision = seen.edges_since(-1), seen.revision
    seen.update(near)
    assert seen.last_removal_revision > revision
    fresh, now = seen.edges_since(revision), seen.edges_since(-1)
    assert np.array_equal(now[len(now) - len(fresh) :], fresh)
    assert len(now) < len(before) + len(fresh)
    assert {*map(tuple, now.tolist())} - {*map(tuple, fresh.tolist())} < {*map(tuple, before.tolist())}
