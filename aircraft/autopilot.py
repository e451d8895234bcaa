"""Gains of the inner loops, from the linearised aircraft.

The structure, in systems/autopilot.xml, is the same for every aircraft. The gains follow from the stability derivatives
at trim by rules that put each loop at a fixed place relative to the aircraft's own modes. Phase margins are read off
the open loops on a grid of frequencies (such as Franklin, Powell and Emami-Naeini, chapter 6).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aircraft.interface import FloatArray

GRAVITY_FPS2 = 32.174
S = 1j * np.logspace(-1.0, 2.5, 4000)
"""The Laplace variable at the frequencies (rad/s) at which open loops are evaluated."""
NEEDED_MARGIN_DEG = 45.0
"""The least phase margin that loops keep behind servos; a margin of 45 degrees is what is usually asked of aircraft
(MIL-F-9490D, 3.1.3.6.1, for modes of less than 1 Hz and up)."""
ComplexArray = NDArray[np.complexfloating[Any, Any]]
ROLL_ERROR_SHARE = 0.8  # share of the steady roll rate at full aileron that a roll error may ask for
LEAST_AILERON_S = 0.1  # least aileron command per roll rate (s) assumed: full aileron then rolls at 10 rad/s


@dataclass(frozen=True)
class Derivatives:
    """Dimensional derivatives at a level trim, in JSBSim's units: ft, rad, s and normalised commands.

    `lp` is d(p_dot)/dp, `lda` is d(p_dot)/d(aileron command), and so on: L roll, M pitch, N yaw, X the
    airspeed, Z the angle of attack (`za` = d(alpha_dot)/d(alpha)). Inertia coupling is included.
    """

    airspeed_fps: float
    alpha_rad: float
    qbar_psf: float
    lp: float
    lr: float
    lda: float
    ldr: float
    np: float
    nr: float
    nb: float
    yb: float
    nda: float
    ndr: float
    za: float
    ma: float
    mq: float
    mde: float
    xa: float
    xdt: float

    @property
    def roll_mode_radps(self) -> float:
        """Roll mode with the roll rate loop closed: lambda = max(1.4 |Lp|, 10) 1/s."""
        return max(1.4 * abs(self.lp), 10.0)


@dataclass(frozen=True)
class Gains:
    """Gains of systems/autopilot.xml; the field `a_b` is the property `wayproof/gain/a-b`."""

    qbar_psf: float  # dynamic pressure that they hold at, lbf/ft2; the autopilot scales them to others
    roll: float  # roll rate over roll error, 1/s
    roll_rate_limit: float  # rad/s
    aileron_p: float  # aileron over roll rate error, s
    aileron_p_integral: float  # and over its integral
    aileron_p_forward: float  # aileron that holds a roll rate, s
    aileron_r_forward: float  # and a yaw rate in a turn
    rudder_r: float  # rudder over yaw rate beyond that of the coordinated turn, s
    rudder_p_forward: float  # rudder that keeps sideslip at zero in a roll, s
    rudder_r_forward: float  # and in a turn
    altitude: float  # climb rate over altitude error, 1/s
    climb_limit_fps: float  # of the climb command, ft/s
    climb: float  # pitch over flight path angle error
    climb_integral: float  # and over its integral, 1/s
    pitch: float  # pitch rate over pitch error, 1/s
    pitch_bank_forward: float  # pitch added per (1 - cos roll), rad
    alpha: float  # angle of attack of the trim, rad
    alpha_per_load: float  # angle of attack over load factor there, rad
    elevator_q: float  # elevator over pitch rate error, s
    elevator_q_integral: float  # and over its integral
    elevator_q_forward: float  # elevator that makes a steady pull-up rate, s
    elevator_turn_forward: float  # elevator against pitch damping in a turn, s
    elevator_load_forward: float  # elevator per unit of load factor beyond 1
    speed: float  # energy rate (as a climb rate) over airspeed error
    speed_by_pitch: float  # share of it that pitch makes where the throttle has nothing left
    throttle_integral: float  # throttle over the integral of the energy rate error, 1/ft
    throttle_energy_forward: float  # throttle over energy rate, s/ft
    throttle_load_forward: float  # throttle against induced drag, per (load factor squared - 1)

    def rounded(self, digits: int) -> Gains:
        """Returns the gains rounded to a number of significant digits."""
        return Gains(**{f.name: float(f"{getattr(self, f.name):.{digits}g}") for f in fields(self)})

    def properties(self) -> dict[str, float]:
        """The value of each gain by the name of its JSBSim property."""
        return {f"wayproof/gain/{f.name.replace('_', '-')}": getattr(self, f.name) for f in fields(self)}


def derivatives(
    states: Sequence[str], inputs: Sequence[str], system: FloatArray, control: FloatArray, **trim: float
) -> Derivatives:
    """Takes the derivatives from a linear model x_dot = A x + B u of FGLinearization, which settles propellers itself.

    `trim` has the first three fields of `Derivatives`.
    """
    row = {name: k for k, name in enumerate(states)}
    column = {name: k for k, name in enumerate(inputs)}

    def slope(of: str, name: str) -> float:
        return float(system[row[of], row[name]] if name in row else control[row[of], column[name]])

    return Derivatives(
        **trim,
        lp=slope("P", "P"),
        lr=slope("P", "R"),
        lda=slope("P", "DaCmd"),
        ldr=slope("P", "DrCmd"),
        np=slope("R", "P"),
        nr=slope("R", "R"),
        nb=slope("R", "Beta"),
        yb=slope("Beta", "Beta"),
        nda=slope("R", "DaCmd"),
        ndr=slope("R", "DrCmd"),
        za=slope("Alpha", "Alpha"),
        ma=slope("Q", "Alpha"),
        mq=slope("Q", "Q"),
        mde=slope("Q", "DeCmd"),
        # Along the flight path gravity counts with alpha at constant pitch; what is left is drag.
        xa=GRAVITY_FPS2 - slope("Vt", "Alpha"),
        xdt=slope("Vt", "ThtlCmd"),
    )


def gains(at: Derivatives, pace: float = 1.0, pitch_pace: float = 1.0, climb_pace: float = 1.0) -> Gains:
    """Derives the gains that put each loop in its place relative to the aircraft's modes.

    Roll: the roll mode goes to lambda = max(1.4 |Lp|, 10) 1/s and roll to lambda/4. Yaw: the Dutch
    roll is damped to 0.7; feed-forwards solve rolling and yawing moment for no sideslip. Pitch: the short
    period omega^2 = -M_alpha + M_q Z_alpha sets the pitch, climb and altitude loops, each three to four
    times slower than the one inside.
    Throttle: 1.5 rad/s on airspeed, less where that would ask for more than 0.05 per ft/s.

    `pace` is the share of the feedback in roll and yaw, `pitch_pace` in pitch, climb and altitude, for aircraft whose
    actuators or control laws, which the derivatives do not show, take a part of the phase; `climb_pace` is that in
    climb and altitude alone, for those that know their climb late. ValueError if a control has no authority or the
    wrong sign, or the short period is not oscillatory.
    """
    authority = {"aileron": at.lda, "elevator": -at.mde, "throttle": at.xdt}
    if at.ndr:  # a flying wing has no rudder
        authority["rudder"] = -at.ndr
    for name, value in authority.items():
        if not value > 0.0:
            lacks = "acts the wrong way" if value < 0.0 else "has no authority"
            raise ValueError(f"the {name} {lacks} at trim ({value:.3g}): no gains can be derived")
    short_period2 = -at.ma + at.mq * at.za
    if not short_period2 > 0.0:
        raise ValueError(f"unstable in pitch at trim (omega^2 = {short_period2:.3g} 1/s2): no gains can be derived")
    speed = at.airspeed_fps
    roll = pace * at.roll_mode_radps / 4.0
    aileron_p = pace * (at.roll_mode_radps - abs(at.lp)) / at.lda

    determinant = at.lda * at.ndr - at.ldr * at.nda

    def balance(rolling: float, yawing: float) -> tuple[float, float]:
        """Aileron and rudder whose moments are the given accelerations; without a rudder, those of roll alone."""
        if not at.ndr:
            return rolling / at.lda, 0.0
        return (
            (rolling * at.ndr - at.ldr * yawing) / determinant,
            (at.lda * yawing - at.nda * rolling) / determinant,
        )

    aileron_p_forward, rudder_p_forward = balance(
        -at.lp - at.lr * at.alpha_rad, GRAVITY_FPS2 / speed - at.np - at.nr * at.alpha_rad
    )
    aileron_r_forward, rudder_r_forward = balance(-at.lr, -at.nr)
    dutch_roll = math.sqrt(max(at.nb + at.nr * at.yb, 0.0))
    rudder_r = pace * max(1.4 * dutch_roll + at.nr + at.yb, 0.0) / -at.ndr if at.ndr else 0.0

    short_period = math.sqrt(short_period2)
    pitch = pitch_pace * min(3.5, 0.315 * short_period)
    alpha_per_load = GRAVITY_FPS2 / (speed * -at.za)
    throttle = min(1.5 / at.xdt, 0.05)
    energy_forward = GRAVITY_FPS2 / (speed * at.xdt)
    return Gains(
        qbar_psf=at.qbar_psf,
        roll=roll,
        roll_rate_limit=ROLL_ERROR_SHARE / max(aileron_p_forward, LEAST_AILERON_S),
        aileron_p=aileron_p,
        aileron_p_integral=2.0 * aileron_p,
        aileron_p_forward=aileron_p_forward,
        aileron_r_forward=aileron_r_forward,
        rudder_r=rudder_r,
        rudder_p_forward=rudder_p_forward,
        rudder_r_forward=rudder_r_forward,
        altitude=climb_pace * 0.23 * pitch,
        climb_limit_fps=0.08 * speed,
        climb=climb_pace * 2.4,
        climb_integral=climb_pace * 0.29 * pitch,
        pitch=pitch,
        pitch_bank_forward=alpha_per_load - at.alpha_rad,
        alpha=at.alpha_rad,
        alpha_per_load=alpha_per_load,
        elevator_q=pitch_pace * short_period / -at.mde,
        elevator_q_integral=pitch_pace**2 * 0.64 * short_period2 / -at.mde,
        elevator_q_forward=(at.ma / at.za - at.mq) / -at.mde,
        elevator_turn_forward=-at.mq / -at.mde,
        elevator_load_forward=-at.ma * alpha_per_load / -at.mde,
        speed=throttle / energy_forward,
        speed_by_pitch=0.15,
        throttle_integral=0.3 * energy_forward,
        throttle_energy_forward=energy_forward,
        throttle_load_forward=0.5 * at.xa * alpha_per_load / at.xdt,
    )


def roll_margin_deg(at: Derivatives, gains: Gains, lag_s: float, latency_s: float = 0.0) -> float:
    """Lesser phase margin of the loops of roll rate and roll, behind the aileron's lag, with roll read late."""
    plant = at.lda / (S - at.lp) / (1.0 + lag_s * S)
    inner = (gains.aileron_p + gains.aileron_p_integral / S) * plant
    attitude = gains.roll / S * (gains.aileron_p_forward * plant + inner) / (1.0 + inner)
    return _least_margin_deg(inner, attitude * _attitude_as_read(latency_s))


def pitch_margin_deg(at: Derivatives, gains: Gains, lag_s: float, latency_s: float = 0.0) -> float:
    """Lesser phase margin of the loops of pitch rate and pitch, behind the elevator's lag, with pitch read late."""
    inner, attitude = _pitch_loops(at, gains, lag_s)
    return _least_margin_deg(inner, attitude * _attitude_as_read(latency_s))


def climb_margin_deg(at: Derivatives, gains: Gains, lag_s: float, latency_s: float) -> float:
    """Lesser phase margin of the loops of climb and altitude around pitch, with climb and altitude read late."""
    _, attitude = _pitch_loops(at, gains, lag_s)
    path = attitude / (1.0 + attitude * _attitude_as_read(latency_s)) / (1.0 - S / at.za)
    late = np.exp(-S * latency_s)
    feedback = gains.climb + gains.climb_integral / S
    climb = feedback * path * late
    return _least_margin_deg(climb, gains.altitude / S * late * (1.0 + feedback) * path / (1.0 + climb))


def _pitch_loops(at: Derivatives, gains: Gains, lag_s: float) -> tuple[ComplexArray, ComplexArray]:
    """Open loops of pitch rate and of pitch; the latter has a feed-forward of the rate."""
    short_period = S * S - (at.mq + at.za) * S + at.mq * at.za - at.ma
    plant = -at.mde * (S - at.za) / short_period / (1.0 + lag_s * S)
    inner = (gains.elevator_q + gains.elevator_q_integral / S) * plant
    return inner, gains.pitch / S * (gains.elevator_q_forward * plant + inner) / (1.0 + inner)


def _attitude_as_read(latency_s: float) -> ComplexArray:
    """Transfer function of an attitude read late: the old angle, carried on to now at the present rate."""
    return np.asarray(np.exp(-S * latency_s) + S * latency_s)


def _least_margin_deg(*loops: ComplexArray) -> float:
    """Least distance of open loops' phase from -180 degrees where their gain is 1; infinite where it never is."""
    least = math.inf
    for loop in loops:
        above = np.abs(loop) >= 1.0
        phase_deg = np.degrees(np.unwrap(np.angle(loop)))
        least = min(least, 180.0 + float(phase_deg[:-1].min(where=above[1:] != above[:-1], initial=math.inf)))
    return least
