"""The JSBSim properties that the flight model reads and writes: name, unit and sign.

JSBSim writes the unit into the name: fps is ft/s; angles are rad. Its wind blows *towards* north and east.
"""

FOOT_M = 0.3048
SLUG_KG = 14.59390

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
"""Read for `AircraftState`, in this order."""

COMMAND_PROPERTIES = ("wayproof/roll-cmd-rad", "wayproof/altitude-cmd-ft", "wayproof/airspeed-cmd-fps")
"""Written for a command, in this order."""

WIND_PROPERTIES = ("atmosphere/wind-east-fps", "atmosphere/wind-north-fps")

CONTROLS = ("aileron", "elevator", "rudder", "throttle")
"""The command of each is fcs/<control>-cmd-norm."""

TURBULENCE_TYPE = {"milspec": 3, "tustin": 4}
TURBULENCE_SEVERITY = {"light": 3, "moderate": 4, "severe": 6}
TURBULENCE_W20_FPS = {"light": 25.0, "moderate": 50.0, "severe": 75.0}
"""Wind at 20 ft of MIL-F-8785C: 15, 30 and 45 knots."""
