"""An aircraft that is beside its line comes back to it, whatever it rolls like."""

import numpy as np
import pytest

from aircraft.airframes import aircraft_names, airframe
from aircraft.guidance.npfg import NpfgConfig
from aircraft.interface import FloatArray, Route
from aircraft.jsbsim_loading import REFERENCE_ALTITUDE_M
from aircraft.trials import in_flight
from harness.scenario.kinds import guidance_kinds

BESIDE_S, RETURNED_S = 2.0, 0.02  # flying times: so far beside the line it begins, and so near it comes


def errors_s(name: str, kind: str, flight_s: float = 160.0, beside_s: float = BESIDE_S, **keys: float) -> FloatArray:
    """Cross-track errors ten times a second on a flight that begins so far beside a line, in flying time."""
    frame = airframe(name)
    speed, errors = frame.cruise_mps, []
    law = guidance_kinds()[kind].law(frame.guidance_limits(), **keys)
    law.follow(Route(np.array([[beside_s * speed, 0.0, 0.0, 1.0, 0.0, 1e6]])))
    model = in_flight(frame, speed)
    for _ in range(round(10.0 * flight_s)):
        output = law.update(model.state())
        errors.append(output.cross_track_m)
        model.command(output.roll_command_rad, REFERENCE_ALTITUDE_M, speed)
        model.advance(model.step_rate_hz // 10)
    return np.array(errors) / speed


@pytest.mark.flights
@pytest.mark.parametrize(("name", "beside_s", "settled_s"), [("J3Cub", 1.5, 10), ("T38", 4, 20)])
def test_from_far_off_a_line_is_joined_without_a_swing(name: str, beside_s: float, settled_s: float) -> None:
    errors = errors_s(name, "preview", settled_s + 20.0, beside_s)
    assert errors.max() < 0.1 * beside_s
    assert np.abs(errors[round(10.0 * settled_s) :]).max() < 0.02 * beside_s


@pytest.mark.flights
def test_npfg_counts_on_no_faster_roll_than_the_rate_limit_allows() -> None:
    """A Cessna 182 rolls at 15 deg/s: with the time constant of its roll loop alone npfg swings from bank to bank."""
    limits = airframe("c182").guidance_limits()
    constant_s = NpfgConfig().resolved(limits).roll_time_constant_s
    assert constant_s == pytest.approx(limits.bank_limit_rad / limits.roll_rate_radps)
    too_fast = errors_s("c182", "npfg", roll_time_constant_s=limits.roll_lag_s + limits.roll_delay_s)
    assert np.abs(too_fast[-300:]).max() > 1.0


@pytest.mark.flights
@pytest.mark.parametrize("kind", ["preview", "npfg"])
@pytest.mark.parametrize("name", aircraft_names())
def test_every_aircraft_of_the_fleet_comes_back_to_its_line(name: str, kind: str) -> None:
    assert np.abs(errors_s(name, kind)[-300:]).max() < RETURNED_S
