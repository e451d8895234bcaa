"""A JSBSim aircraft in flight, its inner loops closed. Feet and slugs end here."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from aircraft.actuators import CONTROLS
from aircraft.airframe import Airframe
from aircraft.frames import LocalPlane, PatchedPlane
from aircraft.interface import FOOT_M, STEP_RATE_HZ, AircraftState
from aircraft.jsbsim_loading import given_mixture, lean, load_for_flight, node
from aircraft.model_files import AircraftError
from aircraft.start import TURBULENCE_W20_FPS, Atmosphere, DrydenGusts, StartConditions

STATE_PROPERTIES = (
    "position/lat-geod-rad",  # geodetic; lat-gc is up to 21 km off
    "position/long-gc-rad",
    "position/h-sl-ft",
    "velocities/v-north-fps",
    "velocities/v-east-fps",
    "velocities/h-dot-fps",
    "attitude/psi-rad",  # from true north, clockwise
    "attitude/phi-rad",  # right wing down
    "attitude/theta-rad",  # nose up
    "velocities/vtrue-fps",
    "accelerations/Nz",  # 1 in level flight
    "fcs/throttle-cmd-norm",
    "fcs/elevator-cmd-norm",
    "fcs/pitch-trim-cmd-norm",
    "fcs/aileron-cmd-norm",
    "fcs/roll-trim-cmd-norm",
    "fcs/rudder-cmd-norm",
    "fcs/yaw-trim-cmd-norm",
    "aero/alpha-rad",
)
"""Properties of JSBSim that `AircraftState` is made of, in this order. The names end in the unit: fps is ft/s."""
COMMAND_PROPERTIES = ("wayproof/roll-cmd-rad", "wayproof/altitude-cmd-ft", "wayproof/airspeed-cmd-fps")
WIND_PROPERTIES = ("atmosphere/wind-east-fps", "atmosphere/wind-north-fps", "atmosphere/wind-down-fps")
"""Velocity of the wind, in the direction that it blows towards."""
TURBULENCE_TYPE = {"milspec": 3.0, "tustin": 4.0}  # JSBSim's numbers
TURBULENCE_SEVERITY = {"light": 3.0, "moderate": 4.0, "severe": 6.0}  # JSBSim's numbers
GROUND_FT = 2.0 / FOOT_M
"""An aircraft at or below this altitude above the sea counts as at the ground: its centre of gravity is above that."""
MAX_ROLL_RAD = math.radians(75.0)  # an aircraft that rolls further than this to either side has lost control
STEEPEST_SINK_SHARE = 0.3
"""Where energy is short, the autopilot lets the aircraft sink by at most this share of its airspeed."""
SETTLING_STEP_S = 1e-9  # duration of the steps that replace what the integrators remember
AIR_STEPS = 600  # the wind is worked out for this many steps at once
TERRAIN_BELOW_FT = 10.0 / FOOT_M
"""The flight model's ground is at least this far below the aircraft: contact is judged by the true world."""
INTEGRATOR_MEMORY_STEPS = 6
"""After this many steps an integrator of JSBSim has replaced every derivative that it remembers."""


def _writers(fdm: Any, paths: Sequence[str]) -> tuple[Callable[[float], None], ...]:
    return tuple(node(fdm, path).set_double_value for path in paths)


class JsbsimModel:
    """Flight model for one flight of one airframe, which starts trimmed in the wind. Implements `FlightModel`."""

    def __init__(
        self,
        frame: Airframe,
        start: StartConditions,
        plane: LocalPlane,
        atmosphere: Atmosphere | None = None,
        step_rate_hz: int = STEP_RATE_HZ,
        climb_limit_mps: float | None = None,
        ground: Callable[[float, float], float] | None = None,
    ) -> None:
        """Loads, trims and starts the aircraft, in calm air by default.

        `climb_limit_mps` is the fastest climb or descent that the altitude loop asks for; None: its own, for flight at
        one altitude. `ground` gives the height of the ground at an east and north (m), NaN where it is not known; None:
        sea level. Turbulence and the profile of the wind depend on the height over it.

        AircraftError for an airspeed out of range or too low for the wind, or a model that does not load or trim.
        """
        frame.check_airspeed(start.airspeed_mps)
        self.airframe, self.step_rate_hz = frame, step_rate_hz
        self._step, self._read_at_step = 0, -1
        self._judged = 4 * (math.nan,)  # roll, airspeed, altitude and angle of attack, as read
        atmosphere = atmosphere or Atmosphere()
        self._ground, self._terrain_ft = ground, 0.0
        height_m = start.altitude_m - self._ground_m(start.east_m, start.north_m)
        try:
            heading_rad = start.heading_rad(Atmosphere(*atmosphere.start_wind(height_m)))
        except ValueError as error:
            raise AircraftError(f"{frame.name}: {error}") from None
        self._stall_rad = math.radians(frame.stall_angle_deg)
        self._plane = PatchedPlane(plane, *map(math.radians, plane.geodetic(start.east_m, start.north_m)))
        convergence_rad = plane.convergence_rad(start.east_m, start.north_m)
        self._cosine, self._sine = math.cos(convergence_rad), math.sin(convergence_rad)
        """Cosine and sine of the meridian convergence where the state was last read."""
        self._turbulence: DrydenGusts | None = None  # over true ground
        self._windy, self._atmosphere = atmosphere.wind_mps > 0.0, atmosphere
        self._air: list[list[float]] = []  # east, north and up of the wind (m/s), by step
        self._air_from = 0  # step at which these begin
        self._place = (start.east_m, start.north_m, start.altitude_m / FOOT_M)

        fdm = self._fdm = load_for_flight(frame.files, plane, start, heading_rad + convergence_rad, step_rate_hz)
        self._mixture = given_mixture(fdm)
        read = [node(fdm, path).get_double_value for path in STATE_PROPERTIES]
        self._read = read[:6], read[6:12], read[12:]
        self._write, self._write_wind = _writers(fdm, COMMAND_PROPERTIES), _writers(fdm, WIND_PROPERTIES)
        self._write_terrain = node(fdm, "position/terrain-elevation-asl-ft").set_double_value
        self._enable, self._hold = _writers(fdm, ("wayproof/enable", "wayproof/hold"))
        servos = [name for name, servo in frame.files.actuators if servo.rate_limit_1ps is not None]
        self._limited, self._vertical_limited = (
            tuple(node(fdm, f"wayproof/{name}-limited").get_double_value for name in names)
            for names in (servos, [name for name in servos if name in ("elevator", "throttle")])
        )
        self._set_up_autopilot(climb_limit_mps)
        self.command(roll_rad=0.0, altitude_m=start.altitude_m, airspeed_mps=start.airspeed_mps)
        if self._windy:
            self._move_with_wind()
        self._settle()
        self._start_gusts(atmosphere)
        self.engage()

    def state(self) -> AircraftState:
        """The state now, in the local plane."""
        # The functions that read them: to collect what they return first takes half as long again.
        place, motion, controls = self._read
        latitude_rad, longitude_rad, read_up_ft, read_north_fps, read_east_fps, climb_fps = place
        true_heading_rad, read_roll_rad, pitch_rad, read_airspeed_fps, load_factor, throttle = motion
        read_elevator, pitch_trim, read_aileron, roll_trim, read_rudder, yaw_trim, read_alpha_rad = controls
        up_ft, north_fps, east_fps = read_up_ft(), read_north_fps(), read_east_fps()
        roll_rad, airspeed_fps, alpha_rad = read_roll_rad(), read_airspeed_fps(), read_alpha_rad()
        elevator, aileron = read_elevator() + pitch_trim(), read_aileron() + roll_trim()
        rudder = read_rudder() + yaw_trim()
        east_m, north_m, convergence_rad = self._plane.project(latitude_rad(), longitude_rad())
        self._place, self._read_at_step = (east_m, north_m, up_ft), self._step
        self._judged = roll_rad, airspeed_fps, up_ft, alpha_rad
        self._cosine, self._sine = math.cos(convergence_rad), math.sin(convergence_rad)
        cosine_m, sine_m = FOOT_M * self._cosine, FOOT_M * self._sine
        values = (
            self._step / self.step_rate_hz,
            east_m,
            north_m,
            up_ft * FOOT_M,
            east_fps * cosine_m - north_fps * sine_m,
            east_fps * sine_m + north_fps * cosine_m,
            climb_fps() * FOOT_M,
            (true_heading_rad() - convergence_rad) % math.tau,
            roll_rad,
            pitch_rad(),
            airspeed_fps * FOOT_M,
            load_factor(),
            throttle(),
            sum([read() for read in self._limited]) / self.step_rate_hz if self._limited else 0.0,
            sum([read() for read in self._vertical_limited]) / self.step_rate_hz if self._limited else 0.0,
            elevator if -1.0 <= elevator <= 1.0 else max(-1.0, min(elevator, 1.0)),
            aileron if -1.0 <= aileron <= 1.0 else max(-1.0, min(aileron, 1.0)),
            rudder if -1.0 <= rudder <= 1.0 else max(-1.0, min(rudder, 1.0)),
            alpha_rad,
        )
        return tuple.__new__(AircraftState, values)  # three times as fast as by name

    def command(self, roll_rad: float, altitude_m: float, airspeed_mps: float) -> None:
        """Sets what the inner loops hold, the wind's direction, steady in the local plane, and the mixture."""
        roll, altitude, airspeed = self._write
        roll(roll_rad)
        altitude(altitude_m / FOOT_M)
        airspeed(airspeed_mps / FOOT_M)
        if self._mixture is not None and self._mixture == self._fdm["fcs/mixture-cmd-norm"]:
            self._mixture = lean(self._fdm)
        if self._ground is not None:
            self._place_ground()
        if self._windy and not self._gusty:
            self._apply_wind()

    def advance(self, steps: int) -> None:
        """Integrates `steps` steps of 1 / step_rate_hz."""
        run = self._fdm.run
        if self._gusty:
            write_east, write_north, write_down = self._write_wind
            for east_fps, north_fps, down_fps in self._winds(steps):
                write_east(east_fps)
                write_north(north_fps)
                write_down(down_fps)
                run()
                self._step += 1
            return
        for _ in range(steps):
            run()
        self._step += steps

    def fault(self) -> str | None:
        """A sentence if control is lost: not finite, at the ground, stalled or rolled over; else None."""
        if self._read_at_step != self._step:
            self.state()
        roll, airspeed, altitude, alpha = self._judged
        if not math.isfinite(roll + airspeed + altitude + alpha):
            return "the state is not finite"
        if altitude <= GROUND_FT:
            return f"the aircraft is at the ground ({altitude * FOOT_M:.1f} m above sea level)"
        if abs(alpha) > self._stall_rad:
            limit_deg = self.airframe.stall_angle_deg
            return f"stalled: angle of attack {math.degrees(alpha):.1f} deg, beyond the limit of {limit_deg:g} deg"
        if abs(roll) <= MAX_ROLL_RAD:
            return None
        return f"rolled over: roll {math.degrees(roll):.0f} deg, limit {math.degrees(MAX_ROLL_RAD):.0f} deg"

    def engage(self, on: bool = True) -> None:
        """Switches the inner loops on, or off: the controls then stay where they are."""
        self._enable(1.0 if on else 0.0)
        self._hold(0.0 if on else -1.0)

    def _set_up_autopilot(self, climb_limit_mps: float | None) -> None:
        """Gives the autopilot its gains and limits, and the trim at which they hold."""
        fdm, frame = self._fdm, self.airframe
        values = frame.gains.properties()
        if climb_limit_mps is not None:
            values["wayproof/gain/climb-limit-fps"] = climb_limit_mps / FOOT_M
        for control in CONTROLS:
            values[f"wayproof/trim/{control}-norm"] = fdm[f"fcs/{control}-cmd-norm"]
        values["wayproof/trim/pitch-rad"] = fdm["attitude/theta-rad"]
        least_deg, most_deg = frame.autopilot.pitch_limits_deg
        values["wayproof/limit/least-pitch-rad"] = math.radians(least_deg)
        values["wayproof/limit/most-pitch-rad"] = math.radians(most_deg)
        values["wayproof/limit/most-lift"] = frame.most_lift
        values["wayproof/limit/least-lift"] = frame.least_lift
        values["wayproof/limit/least-airspeed-fps"] = frame.least_airspeed_mps / FOOT_M
        values["wayproof/limit/most-sink-fps"] = max(
            STEEPEST_SINK_SHARE * fdm["velocities/vtrue-fps"], values["wayproof/gain/climb-limit-fps"]
        )
        for path, value in values.items():
            node(fdm, path).set_double_value(value)

    def _move_with_wind(self) -> None:
        """Adds the wind to the velocity of the trimmed aircraft, then sets the wind, which initial conditions reset.

        The engine must not be started again: that would put the propeller to the speed of full throttle.
        """
        fdm = self._fdm
        east_fps, north_fps, _ = next(self._winds(1))
        attitude = fdm["attitude/theta-rad"], fdm["attitude/phi-rad"], fdm["attitude/psi-rad"]
        north, east, down = (fdm[f"velocities/v-{axis}-fps"] for axis in ("north", "east", "down"))
        fdm["ic/theta-rad"], fdm["ic/phi-rad"], fdm["ic/psi-true-rad"] = attitude
        fdm["ic/vn-fps"], fdm["ic/ve-fps"], fdm["ic/vd-fps"] = north + north_fps, east + east_fps, down
        fdm.run_ic()
        self._apply_wind()

    def _settle(self) -> None:
        """Takes steps of almost no duration, so that integrators forget the derivatives of other air and commands."""
        self._fdm.set_dt(SETTLING_STEP_S)
        for _ in range(INTEGRATOR_MEMORY_STEPS):
            self._fdm.run()
        self._fdm.set_dt(1.0 / self.step_rate_hz)

    @property
    def _gusty(self) -> bool:
        """Whether the wind is another at every step."""
        return self._turbulence is not None or self._atmosphere.vertical_gusts is not None

    def _winds(self, steps: int) -> Iterator[tuple[float, float, float]]:
        """The wind at each of the next steps, taken before it: towards true east and north, and down, ft/s."""
        if (first := self._step - self._air_from) + steps > len(self._air):
            time_s = np.arange(self._step, self._step + max(steps, AIR_STEPS)) / self.step_rate_hz
            self._air, self._air_from, first = self._atmosphere.winds(time_s).tolist(), self._step, 0
        height_m = (self._place[2] - self._terrain_ft) * FOOT_M
        share, cosine, sine = self._atmosphere.share_at(height_m), self._cosine, self._sine
        for east_mps, north_mps, up_mps in self._air[first : first + steps]:
            east, north = share * east_mps / FOOT_M, share * north_mps / FOOT_M
            wind = east * cosine + north * sine, north * cosine - east * sine, 0.0 - up_mps / FOOT_M
            yield wind if self._turbulence is None else self._add_gusts(*wind, self._turbulence, height_m)

    def _add_gusts(
        self, east_fps: float, north_fps: float, down_fps: float, turbulence: DrydenGusts, height_m: float
    ) -> tuple[float, float, float]:
        heading, airspeed_fps = self._read[1][0](), self._read[1][3]()
        gusts = turbulence.step(height_m, airspeed_fps * FOOT_M, 1.0 / self.step_rate_hz)
        ahead, right, down = (gust / FOOT_M for gust in gusts)
        return (
            east_fps + (ahead * math.sin(heading) + right * math.cos(heading)),
            north_fps + (ahead * math.cos(heading) - right * math.sin(heading)),
            down_fps + down,
        )

    def _apply_wind(self) -> None:
        """Writes the present wind to JSBSim, which has no vertical one where there are no gusts."""
        for write, speed_fps in zip(self._write_wind[:2], next(self._winds(1)), strict=False):
            write(speed_fps)

    def _ground_m(self, east_m: float, north_m: float) -> float:
        """Height of the ground (m) at a place; where it is unknown, the last known one."""
        height_m = math.nan if self._ground is None else self._ground(east_m, north_m)
        return self._terrain_ft * FOOT_M if math.isnan(height_m) else height_m

    def _place_ground(self) -> None:
        """Puts the flight model's ground below the aircraft where it was when its state was last read."""
        east_m, north_m, up_ft = self._place
        self._terrain_ft = self._ground_m(east_m, north_m) / FOOT_M
        self._write_terrain(min(self._terrain_ft, up_ft - TERRAIN_BELOW_FT))

    def _start_gusts(self, atmosphere: Atmosphere) -> None:
        """Starts discrete gusts and turbulence after MIL-F-8785C; over the sea the turbulence is JSBSim's own."""
        model, intensity = atmosphere.turbulence, atmosphere.intensity
        if model is None or intensity is None:
            return
        if self._ground is not None:
            self._turbulence = DrydenGusts(intensity, atmosphere.seed)
            return
        values = {
            "atmosphere/randomseed": float(atmosphere.seed),
            "atmosphere/turb-type": TURBULENCE_TYPE[model],
            "atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps": TURBULENCE_W20_FPS[intensity],
            "atmosphere/turbulence/milspec/severity": TURBULENCE_SEVERITY[intensity],
        }
        for path, value in values.items():
            node(self._fdm, path).set_double_value(value)
