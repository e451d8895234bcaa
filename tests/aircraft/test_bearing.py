"""The law `bearing`: against a flight of a simple autopilot, and what it does at waypoints."""

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest

from aircraft.airframes import airframe
from aircraft.guidance.bearing import BearingConfig, BearingLaw, bank_to_point
from aircraft.guidance.waypoints import waypoint_law
from aircraft.interface import Route
from aircraft.start import StartConditions
from tests.point_mass import PointMass

FLOWN = Path(__file__).parents[2].parent / "shared" / "flown"
LIMITS = airframe("aerosonde").guidance_limits(25.0)
SQUARE_M = 400.0


@pytest.mark.skipif(not FLOWN.is_dir(), reason="no shared/flown beside the checkout")
def test_bank_is_what_the_autopilot_of_a_flown_flight_commanded() -> None:
    log = parquet.read_table(FLOWN / "thor75.parquet").to_pydict()
    mission = json.loads((FLOWN / "thor75.json").read_text())["mission"]
    rows = [row for row, on in enumerate(log["autonomous"]) if on]
    assert len(rows) > 5000
    wrong = []
    for row in rows:
        east, north = mission["corners_east_north_m"][log["target_index"][row]]
        course = math.atan2(log["ve_mps"][row], log["vn_mps"][row])
        wanted = bank_to_point(east - log["east_m"][row], north - log["north_m"][row], course, 1.5)
        limited = max(-mission["bank_limit_deg"], min(mission["bank_limit_deg"], math.degrees(wanted)))
        wrong.append(abs(limited - log["bank_command_deg"][row]))
    # Where the target lies behind, the two may turn to different sides.
    assert np.quantile(wrong, 0.999) < 0.01


def flown(by_passing: bool, radius_m: float, seconds: float = 120.0) -> np.ndarray:
    """(n, 2) the track of a point mass round two corners of a square, begun 30 m beside the first leg."""
    config = BearingConfig(switch_by_passing=by_passing)
    law = waypoint_law(BearingLaw(config, LIMITS), "bearing", config, LIMITS, radius_m)
    rows = [
        [*a, (b[0] - a[0]) / SQUARE_M, (b[1] - a[1]) / SQUARE_M, 0.0, SQUARE_M]
        for a, b in itertools.pairwise([(0.0, 0.0), (0.0, SQUARE_M), (SQUARE_M, SQUARE_M), (SQUARE_M, 0.0)])
    ]
    law.follow(Route(np.array(rows)))
    model = PointMass(StartConditions(30.0, 300.0, 300.0, 0.0, 25.0))
    track = []
    for _ in range(round(seconds * 10)):
        state = model.state()
        track.append((state.east_m, state.north_m))
        model.command(law.update(state).roll_command_rad, 300.0, 25.0)
        model.advance(model.step_rate_hz // 10)
    return np.array(track)


def nearest(track: np.ndarray, east: float, north: float) -> float:
    return float(np.hypot(track[:, 0] - east, track[:, 1] - north).min())


def test_switches_within_the_acceptance_radius() -> None:
    for corner in ((0.0, SQUARE_M), (SQUARE_M, SQUARE_M)):
        assert nearest(flown(by_passing=False, radius_m=10.0), *corner) <= 10.0


def test_a_waypoint_is_passed_by_only_where_that_is_wanted() -> None:
    """One that lies inside the turn circle (R = V^2 / (g tan 45 deg) = 64 m) is circled for ever, or let go."""
    config = {"radius_m": 0.5, "seconds": 200.0}
    circling, on = flown(by_passing=False, **config), flown(by_passing=True, **config)
    assert nearest(on[1500:], 0.0, SQUARE_M) > 200.0
    assert nearest(circling[1500:], 0.0, SQUARE_M) < 2.5 * 64.0
