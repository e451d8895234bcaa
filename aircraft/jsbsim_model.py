"""A JSBSim aircraft in flight, its inner loops closed. Feet and slugs end here."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from aircraft import guidance_law as law
from aircraft.airframes import AircraftError, Airframe, airframe
from aircraft.frames import LocalPlane
from aircraft.guidance import PathFollower
from aircraft.interface import STEP_RATE_HZ, AircraftState, FloatArray
from aircraft.jsbsim_loading import load, node, trim
from aircraft.properties import (
    COMMAND_PROPERTIES,
    CONTROLS,
    FOOT_M,
    STATE_PROPERTIES,
    TURBULENCE_SEVERITY,
    TURBULENCE_TYPE,
    TURBULENCE_W20_FPS,
    WIND_PROPERTIES,
)
from aircraft.start import Atmosphere, Gust, StartConditions

GROUND_FT = 2.0 / FOOT_M
"""Altitude at which an aircraft is at the ground, its centre of gravity still above it."""

MAX_ROLL_RAD = math.radians(75.0)
STALL_SPEED_SHARE = 0.8
"""Share of the lowest level-flight airspeed below which the aircraft counts as stalled."""

SETTLING_STEP_S = 1e-9
INTEGRATOR_MEMORY = 6
"""Steps that replace every derivative an integrator of JSBSim remembers."""

Update = Callable[[FloatArray, FloatArray, FloatArray, int, int, float], float]
NO_ROUTE, NO_MEMORY = np.zeros((0, 9)), np.zeros(law.MEMORY)
NO_ROUTE.setflags(write=False)


class JsbsimModel:
    """Flight model for one flight of one airframe. Implements `FlightModel`.

    The aircraft starts trimmed, in straight level flight along the given course, moving with the wind.
    """

    def __init__(
        self,
        aircraft: str | Airframe,
        start: StartConditions,
        plane: LocalPlane,
        atmosphere: Atmosphere | None = None,
        step_rate_hz: int = STEP_RATE_HZ,
    ) -> None:
        """Loads, trims and starts the aircraft.

        Args:
            aircraft: a name or folder that `airframe` knows, or an airframe.
            start: where and how fast it starts.
            plane: the local plane that all positions refer to.
            atmosphere: steady wind, gust and turbulence; default: calm.
            step_rate_hz: integration steps per second.

        Raises:
            AircraftError: if the name is unknown, the airspeed out of range or too low for the wind, or the
                model cannot be loaded, trimmed or held.
        """
        self.airframe = airframe(aircraft) if isinstance(aircraft, str) else aircraft
        self.airframe.check_airspeed(start.airspeed_mps)
        self._plane = plane
        self._step_rate_hz = step_rate_hz
        self._step = 0
        self._sound_at = -1  # the last step at which the aircraft was seen to be under control
        atmosphere = atmosphere or Atmosphere()
        try:
            heading_rad = start.heading_rad(atmosphere)
        except ValueError as error:
            raise AircraftError(f"{self.airframe.name}: {error}") from None
        self._stall_rad = math.radians(self.airframe.stall_angle_deg)
        self._stall_fps = STALL_SPEED_SHARE * self.airframe.airspeed_range_mps[0] / FOOT_M
        self._sheet, self._here = np.zeros(law.SHEET), np.zeros((1, len(AircraftState._fields)))
        self._sheet[law.PATCH : law.LIMITS] = plane.patch(
            *map(math.radians, plane.geodetic(start.east_m, start.north_m))
        )
        self._sheet[law.LIMITS : law.LEANS] = self._stall_rad, self._stall_fps, GROUND_FT, MAX_ROLL_RAD
        self._sheet[law.LEANS] = convergence_rad = plane.convergence_rad(start.east_m, start.north_m)
        self._gust: Gust | None = None
        self._windy = atmosphere.wind_mps > 0.0
        self._wind = (atmosphere.wind_east_mps / FOOT_M, atmosphere.wind_north_mps / FOOT_M)

        fdm = self._fdm = load(self.airframe.files, step_rate_hz)
        trim(fdm, self.airframe.name, plane, start, heading_rad + convergence_rad)
        self._readings = tuple(node(fdm, path).get_double_value for path in STATE_PROPERTIES)
        self._write = tuple(node(fdm, path).set_double_value for path in COMMAND_PROPERTIES)
        self._write_wind = tuple(node(fdm, path).set_double_value for path in WIND_PROPERTIES)
        self._alpha = node(fdm, "aero/alpha-rad").get_double_value
        self._take = _taker(self._sheet, self._readings, self._alpha)
        self._enable = node(fdm, "wayproof/enable").set_double_value
        self._roll, self._airspeed, self._altitude = (
            node(fdm, path).get_double_value
            for path in ("attitude/phi-rad", "velocities/vtrue-fps", "position/h-sl-ft")
        )
        self._set_up_autopilot()
        self.command(roll_rad=0.0, altitude_m=start.altitude_m, airspeed_mps=start.airspeed_mps)
        if self._windy:
            self._move_with_wind()
        self._settle()
        if atmosphere.turbulence is not None and atmosphere.intensity is not None:
            self._stir(atmosphere.turbulence, atmosphere.intensity, atmosphere.seed)
        self._gust = atmosphere.gust
        self.engage()

    @property
    def step_rate_hz(self) -> int:
        """Integration steps per simulated second."""
        return self._step_rate_hz

    def state(self) -> AircraftState:
        """The state now, in the local plane."""
        values = self._read_here()
        if values[1] != values[1]:  # on to the next patch
            latitude_rad, longitude_rad, *_ = self._readings
            self._sheet[law.PATCH : law.LIMITS] = self._plane.patch(latitude_rad(), longitude_rad())
            values = self._read_here()
        # At once: the constructor of a NamedTuple takes twice as long.
        return tuple.__new__(AircraftState, values)

    def _read_here(self) -> list[float]:
        command = self._take(NO_MEMORY, NO_ROUTE, self._here, 0, -1, self._step / self._step_rate_hz)
        self._sound_at = self._step if command == 0.0 else -1
        return self._here.tolist()[0]

    def command(self, roll_rad: float, altitude_m: float, airspeed_mps: float) -> None:
        """Sets what the inner loops hold.

        Keeps the wind's direction steady in the local plane, with the convergence of the last `state`.
        """
        roll, altitude, airspeed = self._write
        roll(roll_rad)
        altitude(altitude_m / FOOT_M)
        airspeed(airspeed_mps / FOOT_M)
        if self._windy:
            self._blow()

    def advance(self, steps: int) -> None:
        """Integrates `steps` steps of 1 / step_rate_hz."""
        run = self._fdm.run
        if self._gust is not None:
            for _ in range(steps):
                self._blow()
                run()
                self._step += 1
            return
        for _ in range(steps):
            run()
        self._step += steps

    def fly_on(
        self,
        follower: PathFollower,
        track: FloatArray,
        row: int,
        plan_index: int,
        updates: int,
        steps: int,
        until_s: float,
    ) -> int:
        """Flies updates of guidance in a row, as if they were asked for one by one, to the last bit, but sooner.

        It flies none in a gust front, or with guidance that is not just `PathFollower`; and stops where a new patch of
        the plane begins, which is for `state` to make.
        """
        if self._gust is not None or type(follower) is not PathFollower or follower.route is None:
            return 0
        memory, route = follower.memory, follower.route
        take, run, rate, windy = self._take, self._fdm.run, self._step_rate_hz, self._windy
        roll_command, _, _ = self._write
        for flown in range(updates):
            time_s = self._step / rate
            if time_s >= until_s:
                return flown
            command = take(memory, route, track, row + flown, plan_index, time_s)
            if command != command:  # out of control, or off the patch
                return flown
            roll_command(command)
            if windy:
                self._blow()
            for _ in range(steps):
                run()
            self._step += steps
        return updates

    def fault(self) -> str | None:
        """A sentence if control is lost: not finite, at the ground, stalled or rolled over; else None."""
        if self._sound_at == self._step:
            return None
        roll, airspeed, altitude, alpha = self._roll(), self._airspeed(), self._altitude(), self._alpha()
        if law.in_control(self._sheet, alpha, airspeed, altitude, roll):
            return None
        if not math.isfinite(roll + airspeed + altitude + alpha):
            return "the state is not finite"
        if altitude <= GROUND_FT:
            return f"the aircraft is at the ground ({altitude * FOOT_M:.1f} m above sea level)"
        if abs(alpha) > self._stall_rad:
            limit_deg = self.airframe.stall_angle_deg
            return f"stalled: angle of attack {math.degrees(alpha):.1f} deg, limit {limit_deg:g} deg"
        if airspeed < self._stall_fps:
            return f"stalled: airspeed {airspeed * FOOT_M:.1f} m/s, below {self._stall_fps * FOOT_M:.1f} m/s"
        return f"rolled over: roll {math.degrees(roll):.0f} deg, limit {math.degrees(MAX_ROLL_RAD):.0f} deg"

    def engage(self, on: bool = True) -> None:
        """Switches the inner loops on, or off: the controls then stay where they are."""
        self._enable(1.0 if on else 0.0)

    def _set_up_autopilot(self) -> None:
        """Gives the autopilot its gains and the trim that they hold for."""
        fdm = self._fdm
        values = self.airframe.gains.properties()
        for control in CONTROLS:
            values[f"wayproof/trim/{control}-norm"] = fdm[f"fcs/{control}-cmd-norm"]
        values["wayproof/trim/pitch-rad"] = fdm["attitude/theta-rad"]
        for path, value in values.items():
            node(fdm, path).set_double_value(value)

    def _move_with_wind(self) -> None:
        """Gives the trimmed aircraft the velocity of the wind, and then the air.

        In this order because initial conditions reset the wind. The engine must not be started again: that
        would put the propeller to the speed of full throttle.
        """
        fdm = self._fdm
        east_fps, north_fps = self._wind_true()
        values = {
            "ic/theta-rad": fdm["attitude/theta-rad"],
            "ic/phi-rad": fdm["attitude/phi-rad"],
            "ic/psi-true-rad": fdm["attitude/psi-rad"],
            "ic/vn-fps": fdm["velocities/v-north-fps"] + north_fps,
            "ic/ve-fps": fdm["velocities/v-east-fps"] + east_fps,
            "ic/vd-fps": fdm["velocities/v-down-fps"],
        }
        for path, value in values.items():
            fdm[path] = value
        fdm.run_ic()
        self._blow()

    def _settle(self) -> None:
        """Takes steps of next to no duration.

        Integrators, of the motion and of the autopilot, go on from derivatives that they remember, and those
        of the last initial conditions belong to other air and other commands.
        """
        self._fdm.set_dt(SETTLING_STEP_S)
        for _ in range(INTEGRATOR_MEMORY):
            self._fdm.run()
        self._fdm.set_dt(1.0 / self._step_rate_hz)

    def _wind_true(self) -> tuple[float, float]:
        """The wind towards true east and north where the aircraft is now, ft/s, the gust included."""
        east, north = self._wind
        if self._gust is not None:
            share = self._gust.share(self._step / self._step_rate_hz) / FOOT_M
            east, north = east + share * self._gust.east_mps, north + share * self._gust.north_mps
        leans = self._sheet.item(law.LEANS)
        sine, cosine = math.sin(leans), math.cos(leans)
        return east * cosine + north * sine, north * cosine - east * sine

    def _blow(self) -> None:
        for write, value in zip(self._write_wind, self._wind_true(), strict=True):
            write(value)

    def _stir(self, model: str, intensity: str, seed: int) -> None:
        """Starts turbulence after MIL-F-8785C."""
        values = {
            "atmosphere/randomseed": float(seed),
            "atmosphere/turb-type": float(TURBULENCE_TYPE[model]),
            "atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps": TURBULENCE_W20_FPS[intensity],
            "atmosphere/turbulence/milspec/severity": float(TURBULENCE_SEVERITY[intensity]),
        }
        for path, value in values.items():
            node(self._fdm, path).set_double_value(value)


def _taker(
    sheet: FloatArray, readings: tuple[Callable[[], float], ...], alpha: Callable[[], float]
) -> Update:
    """`law.update` with all that JSBSim tells: compiled, if it is by now."""
    update = law.update
    latitude, longitude, up, north, east, climb, heading, roll, pitch, airspeed, load_factor, throttle = (
        readings
    )

    def take(
        memory: FloatArray, route: FloatArray, track: FloatArray, row: int, plan_index: int, time_s: float
    ) -> float:
        return update(
            sheet,
            memory,
            route,
            track,
            row,
            plan_index,
            time_s,
            latitude(),
            longitude(),
            up(),
            north(),
            east(),
            climb(),
            heading(),
            roll(),
            pitch(),
            airspeed(),
            load_factor(),
            throttle(),
            alpha(),
        )

    return take
