"""A point mass in coordinated turns: the flight model for fast tests."""

import math

from aircraft.interface import GRAVITY_MPS2, AircraftState
from aircraft.start import Atmosphere, StartConditions

LONGEST_STEP_S = 0.1


class PointMass:
    """Coordinated turns with first-order roll in a steady wind. Implements `FlightModel`.

    phi_dot = (phi_command - phi) / roll_lag, psi_dot = g tan(phi) / Va, position by the air velocity plus
    wind; airspeed and altitude take their commanded values at once. Roll is integrated exactly, heading by
    Simpson's rule and position along the chord of the turn, in strides of at most 0.1 s.
    """

    def __init__(
        self,
        start: StartConditions,
        atmosphere: Atmosphere | None = None,
        roll_lag_s: float = 0.25,
        step_rate_hz: int = 120,
    ) -> None:
        """Starts level, along the course; a ValueError says that it cannot be held, or of turbulence."""
        if (atmosphere := atmosphere or Atmosphere()).turbulence is not None:
            raise ValueError("the point mass does not model turbulence or gusts")
        self._step_rate_hz = step_rate_hz
        self._roll_lag_s = roll_lag_s
        self._wind_east, self._wind_north = atmosphere.wind_east_mps, atmosphere.wind_north_mps
        self._step = 0
        self._east, self._north = start.east_m, start.north_m
        self._heading = start.heading_rad(atmosphere)
        self._roll = 0.0
        self.command(0.0, start.altitude_m, start.airspeed_mps)

    @property
    def step_rate_hz(self) -> int:
        return self._step_rate_hz

    def state(self) -> AircraftState:
        airspeed = self._airspeed
        return AircraftState(
            time_s=self._step / self._step_rate_hz,
            east_m=self._east,
            north_m=self._north,
            up_m=self._altitude,
            velocity_east_mps=airspeed * math.sin(self._heading) + self._wind_east,
            velocity_north_mps=airspeed * math.cos(self._heading) + self._wind_north,
            velocity_up_mps=0.0,
            heading_rad=self._heading % math.tau,
            roll_rad=self._roll,
            pitch_rad=0.0,
            airspeed_mps=airspeed,
            load_factor=1.0 / math.cos(self._roll),
        )

    def command(self, roll_rad: float, altitude_m: float, airspeed_mps: float) -> None:
        """Sets roll, altitude and airspeed; the last two hold at once."""
        self._roll_command, self._altitude, self._airspeed = roll_rad, altitude_m, airspeed_mps

    def advance(self, steps: int) -> None:
        duration = steps / self._step_rate_hz
        strides = max(math.ceil(duration / LONGEST_STEP_S - 1e-9), 1)
        dt = duration / strides
        airspeed, target = self._airspeed, self._roll_command
        half_decay = math.exp(-0.5 * dt / self._roll_lag_s)
        for _ in range(strides):
            begin = self._roll
            middle = target + (begin - target) * half_decay
            end = target + (middle - target) * half_decay
            turn = math.tan(begin) + 4.0 * math.tan(middle) + math.tan(end)
            turn *= GRAVITY_MPS2 / airspeed * dt / 6.0
            half = 0.5 * turn
            chord = airspeed * dt * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
            self._east += chord * math.sin(self._heading + half) + self._wind_east * dt
            self._north += chord * math.cos(self._heading + half) + self._wind_north * dt
            self._heading += turn
            self._roll = end
        self._step += steps

    def fault(self) -> str | None:
        """A sentence if the state is not finite or the ground is reached, else None."""
        if not math.isfinite(self._east + self._north + self._heading + self._roll):
            return "the state is not finite"
        if self._altitude <= 0.0:
            return f"the aircraft is at the ground ({self._altitude:.1f} m above sea level)"
        return None
