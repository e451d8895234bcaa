"""What a scenario says of an aircraft's autopilot, and flight on a state of some age."""

import math
from collections import deque

import numpy as np
import pytest

from aircraft.airframe import AutopilotKeys
from aircraft.airframes import airframe
from aircraft.guidance.preview import PreviewConfig, PreviewLaw, bandwidth_of_delay_margin
from aircraft.interface import AircraftState, FloatArray, delayed_state
from aircraft.route import weave
from aircraft.trials import in_flight


def rolled(keys: AutopilotKeys, seconds: float = 3.0) -> FloatArray:
    """(n,) bank (deg) at every step after a command of 45 degrees at time 0."""
    model = in_flight(airframe("aerosonde", None, keys), 25.0)
    model.command(math.radians(45.0), 300.0, 25.0)
    banks = []
    for _ in range(round(seconds * model.step_rate_hz)):
        model.advance(1)
        banks.append(math.degrees(model.state().roll_rad))
    return np.array(banks)


@pytest.mark.flights
def test_roll_rate_and_time_constant_are_those_of_the_keys() -> None:
    slow = rolled(AutopilotKeys(roll_rate_limit_degps=20.0))
    assert np.diff(slow).max() * 60.0 == pytest.approx(20.0, rel=0.1)
    # A first-order roll has 1 - 1/e of a small step after its time constant.
    model = in_flight(airframe("aerosonde", None, AutopilotKeys(roll_time_constant_s=0.6)), 25.0)
    model.command(math.radians(5.0), 300.0, 25.0)
    model.advance(36)
    assert math.degrees(model.state().roll_rad) == pytest.approx(5.0 * (1.0 - math.exp(-1.0)), rel=0.1)


def test_a_bank_limit_reaches_guidance() -> None:
    frame = airframe("aerosonde", None, AutopilotKeys(bank_limit_deg=30.0))
    assert frame.guidance_limits().bank_limit_rad == pytest.approx(math.radians(30.0))


def test_the_autopilot_reads_a_state_of_the_latency() -> None:
    model = in_flight(airframe("aerosonde", None, AutopilotKeys(latency_s=0.2)), 25.0)
    model.command(math.radians(30.0), 310.0, 25.0)
    now, old = [], []
    for _ in range(240):
        model.advance(1)
        now.append(model._fdm["position/h-sl-ft"])
        old.append(model._fdm["wayproof/measured/h-sl-ft"])
    assert old[100:] == pytest.approx(now[88:-12], abs=1e-9)


def test_the_pitch_of_now_is_known_in_a_steady_turn() -> None:
    """Turning at 45 degrees of bank, gyros show a pitch rate of g / V sin 45 = 16 deg/s, and pitch stays as it is."""
    model = in_flight(airframe("aerosonde", None, AutopilotKeys(latency_s=0.2)), 25.0)
    model.command(math.radians(45.0), 300.0, 25.0)
    model.advance(120 * 10)
    believed_rad, true_rad = model._fdm["wayproof/measured/theta-rad-now"], model.state().pitch_rad
    assert math.degrees(model._fdm["velocities/q-rad_sec"]) > 12.0
    assert math.degrees(believed_rad - true_rad) == pytest.approx(0.0, abs=0.3)


@pytest.mark.flights
@pytest.mark.parametrize(
    ("name", "latency_s"), [("aerosonde", 0.12), ("aerosonde", 0.22), ("ultrastick25e", 0.22), ("aerosonde", 0.5)]
)
def test_preview_tracks_turns_on_an_old_state(name: str, latency_s: float) -> None:
    """Untold of 0.3 s it was 16 m off; here it flies the turns of 110 m with the age that it is told."""
    frame = airframe(name, None, AutopilotKeys(latency_s=latency_s))
    limits = frame.guidance_limits()
    law, model = PreviewLaw(PreviewConfig().resolved(limits), limits), in_flight(frame, limits.airspeed_mps)
    law.follow(weave(110.0))
    past: deque[AircraftState] = deque()
    worst = 0.0
    while True:
        if (output := law.update(delayed_state(past, model.state(), latency_s))).past_end:
            break
        worst = max(worst, abs(output.cross_track_m))
        model.command(output.roll_command_rad, 300.0, limits.airspeed_mps)
        model.advance(6)
        assert model.fault() is None
    assert worst < 2.0


def test_bandwidth_leaves_the_delay_margin_of_the_open_loop() -> None:
    """Read off the open loop on a fine grid: gain 1, and the phase left there over the frequency."""
    bandwidth, damping, delay = bandwidth_of_delay_margin(0.5, 0.1), 0.9, 0.15
    omega = np.linspace(0.01, 20.0, 400_000)
    loop = (2.0 * damping * bandwidth * 1j * omega + bandwidth**2) / (1j * omega) ** 2
    at = np.argmin(np.abs(np.abs(loop) - 1.0))
    assert (math.pi + float(np.angle(loop[at]))) / omega[at] - delay == pytest.approx(0.5, abs=0.01)
