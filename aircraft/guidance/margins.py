"""Gain and delay margins of guidance laws on a straight line, from the open loop of the cross-track error.

A law is made linear about the line, phi = k_e e + k_chi chi, by its answers to small offsets. With e'' = g phi, chi =
e' / V and the roll R behind its command the open loop is L(s) = -g (k_e + k_chi s / V) R(s) / s^2. R is a delay and,
but for `preview`, whose command leads by it, a first-order lag. Source of the method: any text on control, such as
Franklin, Powell and Emami-Naeini, chapter 6.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLimits
from aircraft.guidance.registry import DEFAULT_KIND, GuidanceKind
from aircraft.interface import GRAVITY_MPS2, AircraftState, Route

LINE_M, OFFSET_M, OFF_COURSE_RAD = 1e5, 0.01, 1e-4
"""A law is made linear half way along a line of this length, by offsets of place and of course."""
FREQUENCIES_RADPS = np.logspace(-2.5, 2.0, 20_000)  # frequencies at which the open loop of a law is evaluated


class LawMargins(NamedTuple):
    """Margins of a law against oscillation on a straight line in calm air."""

    gain: float  # the loop may be stronger by this factor
    delay_s: float  # the state may be older by this


def law_margins(kind: GuidanceKind, limits: GuidanceLimits) -> LawMargins:
    """Computes the margins of a law whose keys are at their defaults."""
    speed = limits.airspeed_mps

    def roll_rad(off_m: float, course_rad: float) -> float:
        law = kind.law(limits)
        law.follow(Route(np.array([[0.0, 0.0, 0.0, 1.0, 0.0, LINE_M]])), 0.5 * LINE_M)
        velocity = speed * math.sin(course_rad), speed * math.cos(course_rad), 0.0
        attitude = course_rad % math.tau, 0.0, 0.0
        state = AircraftState(0.0, off_m, 0.5 * LINE_M, 300.0, *velocity, *attitude, speed, 1.0)
        for _ in range(3):  # a command that leads has come to rest
            output = law.update(state)
        return output.roll_command_rad

    per_m = (roll_rad(OFFSET_M, 0.0) - roll_rad(-OFFSET_M, 0.0)) / (2.0 * OFFSET_M)
    per_rad = (roll_rad(0.0, OFF_COURSE_RAD) - roll_rad(0.0, -OFF_COURSE_RAD)) / (2.0 * OFF_COURSE_RAD)
    s = 1j * FREQUENCIES_RADPS
    lag_s = 0.0 if kind.kind == DEFAULT_KIND else limits.roll_lag_s
    roll = np.exp(-s * (limits.roll_delay_s + 0.5 / UPDATE_RATE_HZ)) / (1.0 + lag_s * s)
    loop = -GRAVITY_MPS2 * (per_m + per_rad * s / speed) * roll / s**2
    size, phase = np.abs(loop), np.unwrap(np.angle(loop))
    phase -= math.tau * round((phase[0] + math.pi) / math.tau)  # two integrators: it begins at -pi
    crossing = int(np.argmax(size < 1.0))
    turned = np.flatnonzero((phase[:-1] > -math.pi) & (phase[1:] <= -math.pi))
    gain = 1.0 / float(size[turned[-1]]) if len(turned) else math.inf
    return LawMargins(gain, float(phase[crossing] + math.pi) / float(FREQUENCIES_RADPS[crossing]))
