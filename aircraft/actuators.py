"""Servos between autopilot and control surfaces: lag, rate limit and deadband, in degrees and in commands."""

from __future__ import annotations

from dataclasses import dataclass, fields

CONTROLS = ("aileron", "elevator", "rudder", "throttle")
"""Names of the controls; the command of each is the property fcs/<control>-cmd-norm."""
THROTTLE_TRAVEL_DEG = 60.0  # travel of the servo's arm from idle to full throttle


@dataclass(frozen=True)
class Actuator:
    """One servo: time constant of its first-order lag, fastest motion, width of the band in which nothing moves."""

    lag_s: float = 0.0
    rate_limit_degps: float | None = None  # None: no limit
    deadband_deg: float = 0.0  # about the trim

    def of_command(self, travel_deg: float) -> NormActuator:
        """Returns this servo in units of the command, for a surface that moves by `travel_deg` for a command of 1."""
        rate = None if self.rate_limit_degps is None else self.rate_limit_degps / travel_deg
        return NormActuator(self.lag_s, rate, self.deadband_deg / travel_deg)


@dataclass(frozen=True)
class NormActuator:
    """A servo in units of the normalised command."""

    lag_s: float
    rate_limit_1ps: float | None  # None: no limit
    deadband: float  # about the trim


@dataclass(frozen=True)
class Actuators:
    """The servos of an aircraft; a control of None follows its command at once."""

    aileron: Actuator | None = None
    elevator: Actuator | None = None
    rudder: Actuator | None = None
    throttle: Actuator | None = None

    @staticmethod
    def alike(actuator: Actuator) -> Actuators:
        """Returns actuators with one servo at every surface and the throttle."""
        return Actuators(actuator, actuator, actuator, actuator)

    @property
    def real(self) -> dict[str, Actuator]:
        """The servos that are not ideal, by control."""
        every = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: servo for name, servo in every.items() if servo not in (None, Actuator())}
