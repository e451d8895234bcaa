"""Servos between autopilot and control surfaces: lag, rate limit and deadband, in degrees and in commands."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

CONTROLS = ("aileron", "elevator", "rudder", "throttle")

THROTTLE_TRAVEL_DEG = 60.0
"""Travel of the servo's arm from idle to full throttle."""


@dataclass(frozen=True)
class Actuator:
    """One servo.

    Attributes:
        lag_s: time constant of the first-order lag of the surface behind its command.
        rate_limit_degps: fastest motion of the surface; None: no limit.
        deadband_deg: width of the band about the trim in which a command moves nothing.
    """

    lag_s: float = 0.0
    rate_limit_degps: float | None = None
    deadband_deg: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.lag_s <= 10.0:
            raise ValueError(f"lag_s is {self.lag_s!r}; must be from 0 to 10")
        if self.rate_limit_degps is not None and not 0.0 < self.rate_limit_degps < math.inf:
            raise ValueError(f"rate_limit_degps is {self.rate_limit_degps!r}; must be greater than 0")
        if not 0.0 <= self.deadband_deg <= 90.0:
            raise ValueError(f"deadband_deg is {self.deadband_deg!r}; must be from 0 to 90")

    @property
    def ideal(self) -> bool:
        """Whether it does whatever it is told at once."""
        return not self.lag_s and self.rate_limit_degps is None and not self.deadband_deg

    def of_command(self, travel_deg: float) -> NormActuator:
        """The same in units of the command, for a surface that moves by so much for a command of 1."""
        rate = self.rate_limit_degps
        return NormActuator(
            self.lag_s, None if rate is None else rate / travel_deg, self.deadband_deg / travel_deg
        )


@dataclass(frozen=True)
class NormActuator:
    """A servo in units of the normalised command.

    Attributes:
        lag_s: time constant.
        rate_limit_1ps: fastest change of the command, 1/s; None: no limit.
        deadband: width of the band about the trim.
    """

    lag_s: float
    rate_limit_1ps: float | None
    deadband: float


@dataclass(frozen=True)
class Actuators:
    """The servos of an aircraft; None: the control does what it is told at once."""

    aileron: Actuator | None = None
    elevator: Actuator | None = None
    rudder: Actuator | None = None
    throttle: Actuator | None = None

    @staticmethod
    def alike(actuator: Actuator) -> Actuators:
        """The same servo at every surface and the throttle."""
        return Actuators(actuator, actuator, actuator, actuator)

    @property
    def real(self) -> dict[str, Actuator]:
        """Those that are not ideal, by control."""
        every = ((each.name, getattr(self, each.name)) for each in fields(self))
        return {name: actuator for name, actuator in every if actuator and not actuator.ideal}
