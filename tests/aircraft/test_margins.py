"""Margins of guidance laws, against a point that flies a line on an old state."""

from collections import deque

import numpy as np
import pytest

from aircraft.airframes import airframe
from aircraft.guidance.interface import GuidanceLimits
from aircraft.guidance.margins import law_margins
from aircraft.interface import AircraftState, Route, delayed_state
from aircraft.start import StartConditions
from harness.scenario.kinds import guidance_kinds
from tests.point_mass import PointMass

LIMITS: GuidanceLimits = airframe("aerosonde").guidance_limits(25.0)


def swing(kind: str, latency_s: float) -> float:
    """Cross-track error late in a flight along a line begun 1 m off it, over that of earlier on."""
    law = guidance_kinds()[kind].law(LIMITS)
    law.follow(Route(np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 1e5]])))
    model = PointMass(StartConditions(1.0, 10.0, 300.0, 0.0, 25.0), roll_lag_s=LIMITS.roll_lag_s)
    past: deque[AircraftState] = deque()
    off = []
    for _ in range(600):
        state = delayed_state(past, model.state(), latency_s)
        off.append(abs(model.state().east_m))
        model.command(law.update(state).roll_command_rad, 300.0, 25.0)
        model.advance(model.step_rate_hz // 10)
    return max(off[450:]) / max(off[50:200])


@pytest.mark.parametrize("kind", ["preview", "npfg", "bearing"])
def test_a_law_swings_beyond_its_delay_margin_and_not_within(kind: str) -> None:
    margin_s = law_margins(guidance_kinds()[kind], LIMITS).delay_s
    # The point has no delay of roll of its own.
    margin_s += LIMITS.roll_delay_s
    assert swing(kind, 0.75 * margin_s) < 0.5
    assert swing(kind, 1.35 * margin_s) > 1.0
