"""What of a scan may be of something that moves, as those before it tell."""

from __future__ import annotations

import math

import numpy as np

from harness.mapping.earlier_scans import EarlierScans, Look
from harness.mapping.followed_outline import FollowedOutline
from harness.mapping.scan import RangeScan
from harness.mapping.scan_matching import Outline
from harness.world.obstacle import Circle, Obstacle
from tests.harness.sensing import CLEARANCE, sensor, world_of

PLACE, VELOCITY = (3000.0, 1500.0), complex(0.2, -0.7)


def look(scan: RangeScan) -> Look:
    hits = (scan.ranges_m < math.inf).nonzero()[0]
    return Look(scan.kept(), hits, scan.ends_m(hits))


def test_the_rest_of_what_is_known_by_a_piece_is_not_taken_for_something_that_stands() -> None:
    """It comes nearer, slowly: its face is close to where it was, but where nothing was; beside it stands something."""
    body = Obstacle(Circle((2950.0, 2400.0), 200.0), velocity_mps=(VELOCITY.real, VELOCITY.imag))
    still = Circle((3420.0, 2300.0), 120.0)
    eye = sensor(world_of(body, still))
    earlier = EarlierScans(CLEARANCE, 0.02 * CLEARANCE, exact=True, flawed=False)
    for time_s in (0.0, 3.0, 6.0, 9.0):
        earlier.keep(look(eye.scan(*PLACE, 0.0, time_s)))
    now, hits, places = look(eye.scan(*PLACE, 0.0, 12.0))
    center = complex(2950.0, 2400.0) + 12.0 * VELOCITY
    mine = np.abs(np.abs(places - center) - 200.0) < 1.0
    piece = places[mine][:4]
    track = FollowedOutline(Outline(piece, (True, False)), 12.0, velocity=VELOCITY, error_mps=0.1, moves=True)
    may = np.zeros(len(places), dtype=np.bool_)
    may[earlier.of_it(track, places, now)] = True
    assert may[mine].mean() > 0.5
    assert not may[~mine].any()
    assert len(hits) == len(places)
