"""What turns of a plan ask for, and the wind, by formulas that stand here."""

import math

import numpy as np
import pytest

from harness.analysis.flight_limits import FlightLimits
from harness.analysis.in_force import InForce, demand
from tests.harness.conftest import plan, track

G, V, BANK_RAD, ROLL_RADPS, W = 9.80665, 25.0, math.radians(40.0), math.radians(90.0), 12.0
LIMITS = FlightLimits(300.0, 50.0, BANK_RAD, 110.0, airspeed_mps=V, roll_rate_radps=ROLL_RADPS)


@pytest.mark.parametrize("bend", [0.01, -0.01])
@pytest.mark.parametrize(
    ("along_mps", "across_mps", "lateral_per_bend"),
    [(W, 0.0, (V + W) ** 2), (-W, 0.0, (V - W) ** 2), (0.0, W, V * math.sqrt(V**2 - W**2)), (0.0, 0.0, V**2)],
)
def test_a_turn_asks_for_the_lift_of_its_groundspeed_across_the_heading(
    along_mps: float, across_mps: float, lateral_per_bend: float, bend: float
) -> None:
    """It is k Vg^2 / cos(drift); across the wind Vg is sqrt(V^2 - W^2), and cos(drift) Vg / V."""
    sine, cosine = math.sin(math.radians(30.0)), math.cos(math.radians(30.0))
    wind = along_mps * sine + across_mps * cosine, along_mps * cosine - across_mps * sine
    force = InForce(np.full(51, V), np.tile(wind, (51, 1)), BANK_RAD, ROLL_RADPS)
    path = plan([(0, 0, sine, cosine, 0.0, 60.0), (60 * sine, 60 * cosine, sine, cosine, bend, 900.0)])
    found = demand(track(51, course_deg=30.0), [path], force)
    assert found.calm == pytest.approx(abs(bend) * V**2 / G / math.tan(BANK_RAD))
    assert found.windy == pytest.approx(abs(bend) * lateral_per_bend / G / math.tan(BANK_RAD))
    # The mean of a second's flight grows evenly from 0 to the bend: the bank begins to at k V^2 / g in a second.
    assert found.roll_rate == pytest.approx(abs(bend) * V**2 / G / ROLL_RADPS, rel=0.01)


def test_the_wind_is_what_the_ground_velocity_has_beyond_the_level_part_of_the_airspeed() -> None:
    """Heading 350 degrees, climbing at 7 m/s of 25: 24 m/s of it are level; the wind is (-5, 3)."""
    rows, heading = 401, math.radians(350.0)
    east, north = 24.0 * math.sin(heading) - 5.0, 24.0 * math.cos(heading) + 3.0
    gusts = 2.0 * np.sign(np.sin(math.tau * (np.arange(rows) + 0.5) / 10.0))
    flown = track(
        rows, up_m=300.0 + 0.7 * np.arange(rows), heading_deg=350.0,
        course_deg=np.degrees(np.arctan2(east + gusts, north)), groundspeed_mps=np.hypot(east + gusts, north),
    )  # fmt: skip
    assert InForce.of(flown, LIMITS).wind_mps[100:300] == pytest.approx(np.tile((-5.0, 3.0), (200, 1)), abs=0.02)
