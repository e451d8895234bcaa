"""What earlier scans tell of what is seen now."""

from __future__ import annotations

import numpy as np
import pytest

from harness.earlier_scans import EarlierScans, Look
from harness.followed_outline import FollowedOutline
from harness.obstacle import Obstacle
from harness.registration import Outline
from harness.world import World
from tests.harness.sensing import BOUNDS, CLEARANCE, block, sensor

MOVER = Obstacle(block(2900.0, 2400.0, 3100.0, 2500.0), (0.0, -8.0))


@pytest.mark.parametrize("since_s", [0.0, 3.0])
def test_what_a_scan_met_where_nothing_of_it_was_is_not_its(since_s: float) -> None:
    """Be that the first scan kept, or a later one from before it was there."""
    beside = Obstacle(block(3105.0, 2200.0, 3250.0, 2310.0), active_s=(since_s, 1e6))
    eye = sensor(World([MOVER, beside], BOUNDS))
    earlier = EarlierScans(CLEARANCE, 0.02 * CLEARANCE, exact=True, flawed=False)
    for time_s in (0.0, 6.0, 12.0, 18.0):
        scan = eye.scan(3000.0, 1500.0, 0.0, time_s)
        hits = np.flatnonzero(np.isfinite(scan.ranges_m))
        places = scan.ends_m(hits)
        earlier.keep(Look(scan, hits, places))
    ours = places.real < 3101.0
    track = FollowedOutline(Outline(places[ours], (True, True)), 18.0)
    track.velocity, track.moves = -8j, True
    assert np.count_nonzero(~ours) > 5
    np.testing.assert_array_equal(earlier.of_it(track, places), np.flatnonzero(ours))
