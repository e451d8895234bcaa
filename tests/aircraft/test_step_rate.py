"""The step rate changes how finely an aircraft is integrated, not what it does."""

import math

import pytest

from aircraft.airframes import airframe
from aircraft.frames import LocalPlane
from aircraft.jsbsim_model import JsbsimModel
from aircraft.start import StartConditions


def track(name: str, rate_hz: int) -> list[tuple[float, float]]:
    """Positions every second under roll commands that come by the clock."""
    frame = airframe(name)
    start = StartConditions(0.0, 0.0, 300.0, 0.3, frame.cruise_mps)
    model = JsbsimModel(frame, start, LocalPlane(47.0, 8.0), step_rate_hz=rate_hz)
    places = []
    for second in range(30):
        model.command(math.radians(25.0 if second // 5 % 2 else -25.0), 300.0, frame.cruise_mps)
        model.advance(rate_hz)
        state = model.state()
        places.append((state.east_m, state.north_m))
    return places


@pytest.mark.parametrize("name", ["aerosonde", "c172p"])
def test_every_rate_flies_the_same_track(name: str) -> None:
    """Integrals of the autopilot that ran at another step than the flight were off by more than a metre."""
    fine = track(name, 480)
    assert max(map(math.dist, track(name, 120), fine)) < 0.15
    assert max(map(math.dist, track(name, 60), fine)) < 0.3
