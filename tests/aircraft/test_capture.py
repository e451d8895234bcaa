"""An aircraft that is beside its line comes back to it, whatever it rolls like."""

import numpy as np
import pytest

from aircraft.airframes import aircraft_names, airframe
from aircraft.guidance.npfg import NpfgConfig
from aircraft.interface import Route
from aircraft.jsbsim_loading import REFERENCE_ALTITUDE_M
from aircraft.trials import in_flight
from harness.scenario.kinds import guidance_kinds

BESIDE_S, RETURNED_S = 2.0, 0.02  # flying times: so far beside the line it begins, and so near it comes


def last_error_s(name: str, kind: str, flight_s: float = 160.0, **keys: float) -> float:
    """Largest distance from the line in the last 30 s of a flight that begins beside it, in flying time."""
    frame = airframe(name)
    speed, errors = frame.cruise_mps, []
    law = guidance_kinds()[kind].law(frame.guidance_limits(), **keys)
    law.follow(Route(np.array([[BESIDE_S * speed, 0.0, 0.0, 1.0, 0.0, 1e6]])))
    model = in_flight(frame, speed)
    for _ in range(round(10.0 * flight_s)):
        output = law.update(model.state())
        errors.append(abs(output.cross_track_m))
        model.command(output.roll_command_rad, REFERENCE_ALTITUDE_M, speed)
        model.advance(model.step_rate_hz // 10)
    return max(errors[-300:]) / speed


@pytest.mark.flights
def test_npfg_counts_on_no_faster_roll_than_the_rate_limit_allows() -> None:
    """A Cessna 182 rolls at 15 deg/s: with the time constant of its roll loop alone npfg swings from bank to bank."""
    limits = airframe("c182").guidance_limits()
    constant_s = NpfgConfig().resolved(limits).roll_time_constant_s
    assert constant_s == pytest.approx(limits.bank_limit_rad / limits.roll_rate_radps)
    assert last_error_s("c182", "npfg", roll_time_constant_s=limits.roll_lag_s + limits.roll_delay_s) > 1.0
    assert last_error_s("c182", "npfg") < RETURNED_S


@pytest.mark.flights
@pytest.mark.parametrize("kind", ["preview", "npfg"])
@pytest.mark.parametrize("name", aircraft_names())
def test_every_aircraft_of_the_fleet_comes_back_to_its_line(name: str, kind: str) -> None:
    assert last_error_s(name, kind) < RETURNED_S
