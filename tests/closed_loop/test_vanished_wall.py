"""A wall across the way vanishes while the aircraft flies along it: the way that has become free is taken soon."""

import math
from typing import Any

import numpy as np
import pytest

from tests.closed_loop.small import flown_by_point_mass, small_world

GONE_S = 100.0
GOAL = (9600.0, 4000.0)


@pytest.mark.parametrize("wind", [None, {"speed_mps": 8.0, "from_deg": 300.0}])
def test_a_vanished_wall_is_cut_short_within_25_seconds(wind: dict[str, Any] | None) -> None:
    # When it vanishes, the end that the aircraft flies to is more than a kilometre away.
    wall = {
        "polygon": {"vertices_m": [[2000, 500], [2100, 500], [2100, 7500], [2000, 7500]]},
        "active_s": [0.0, GONE_S],
    }
    mission = {"start_m": [1000.0, 4000.0], "course_deg": 90.0, "goal_m": list(GOAL), "time_limit_s": 900.0}
    scenario = small_world(
        wall,
        area={"bounds_m": [0, 0, 10_000, 8000]},
        mission=mission,
        sensor={"range_m": 3000.0},
        planner={"clearance_m": 50.0},
        environment={"wind": wind} if wind else {},
    )
    track = flown_by_point_mass(scenario).track
    to_goal = np.arctan2(GOAL[0] - track.east_m, GOAL[1] - track.north_m)
    off = np.abs((np.radians(track.course_deg) - to_goal + math.pi) % math.tau - math.pi)
    before = (track.time_s > GONE_S - 5.0) & (track.time_s < GONE_S)
    assert off[before].min() > math.radians(60.0), "the aircraft does not fly along the wall"
    assert track.time_s[(track.time_s > GONE_S) & (off < math.radians(15.0))][0] < GONE_S + 25.0
