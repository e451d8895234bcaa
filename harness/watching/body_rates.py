"""Rates about an aircraft's own axes, which a state does not have."""

from __future__ import annotations

import math

from aircraft.interface import AircraftState


def body_rates_radps(before: AircraftState, now: AircraftState) -> tuple[float, float, float]:
    """Rates about the aircraft's axes (ahead, right, down) between two states, from its Euler angles; 0 at once."""
    step_s = now.time_s - before.time_s
    if step_s <= 0.0:
        return 0.0, 0.0, 0.0
    roll, pitch = now.roll_rad, now.pitch_rad
    roll_rate, pitch_rate, yaw_rate = (
        math.remainder(after - first, math.tau) / step_s
        for first, after in (
            (before.roll_rad, roll),
            (before.pitch_rad, pitch),
            (before.heading_rad, now.heading_rad),
        )
    )
    return (
        roll_rate - yaw_rate * math.sin(pitch),
        pitch_rate * math.cos(roll) + yaw_rate * math.sin(roll) * math.cos(pitch),
        yaw_rate * math.cos(roll) * math.cos(pitch) - pitch_rate * math.sin(roll),
    )
