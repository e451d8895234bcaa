"""Loads a JSBSim model with the autopilot inside, trims it, linearises it. Feet and slugs end here."""

from __future__ import annotations

import ctypes
import math
import xml.etree.ElementTree as ElementTree
from collections import deque
from functools import lru_cache
from typing import Any

import jsbsim
import numpy as np

from aircraft.actuators import CONTROLS, THROTTLE_TRAVEL_DEG
from aircraft.autopilot import Derivatives, derivatives
from aircraft.frames import LocalPlane
from aircraft.injection import heavier, with_autopilot
from aircraft.interface import FOOT_M, STEP_RATE_HZ, FloatArray
from aircraft.model_files import AircraftError, ModelFiles, TrimError, whole_model
from aircraft.start import StartConditions

SLUG_KG = 14.59390
REFERENCE_ALTITUDE_M = 300.0  # surveys and trials are flown at this altitude above mean sea level
RICH_TO_FT, RICH_TO_PSF = 1000.0 / FOOT_M, 1877.07
"""Piston engines are fully rich up to this altitude and pressure (ISA), and leaned in proportion to it above."""
LONGITUDINAL_TRIM, FULL_TRIM = 0, 1  # JSBSim's numbers of two modes of trim
NO_TRIM = "JSBSim finds no trim"
UNBALANCED = {
    "udot": "no throttle makes its thrust as large as its drag",
    "wdot": "at no angle of attack it lifts its weight",
    "qdot": "fcs/pitch-trim-cmd-norm, by which JSBSim trims, does not hold its pitch",
}
"""What it means that JSBSim cannot bring an acceleration to zero, by its name."""
SURFACE_POSITIONS = {
    "aileron": ("fcs/left-aileron-pos-rad", "fcs/right-aileron-pos-rad"),
    "elevator": ("fcs/elevator-pos-rad",),
    "rudder": ("fcs/rudder-pos-rad",),
}
"""Properties of the angle of each surface, rad, by control."""
MOST_ALPHA_DEG, ALPHA_STEP_DEG = 40.0, 0.5
"""The most lift is sought up to the first angle of attack, in steps of the second."""
ALPHAS_DEG = (15.0, 10.0)
"""Where JSBSim finds no trim up to a model's <alphalimits>, by default 20 degrees, it searches up to these."""
KEPT = {
    "ic/theta-rad": "attitude/theta-rad",
    "ic/phi-rad": "attitude/phi-rad",
    "ic/psi-true-rad": "attitude/psi-rad",
    **{f"ic/v{each[0]}-fps": f"velocities/v-{each}-fps" for each in ("north", "east", "down")},
    **{f"fcs/{each}-norm": f"fcs/{each}-norm" for each in ("elevator-cmd", "aileron-cmd", "rudder-cmd")},
    **{f"fcs/{each}-trim-cmd-norm": f"fcs/{each}-trim-cmd-norm" for each in ("pitch", "roll", "yaw")},
}
"""Properties with which a placed model begins as another is trimmed, but for throttles, with those of the other."""
INERTIA_FACTORS, SAME_SHARE = [10.0 ** (0.5 * each) for each in range(13)], 0.01
"""Propellers on electric engines are trimmed with so many times their moment of inertia, which changes neither steady
speed nor thrust: the first of the factors with which JSBSim's trim finds the same speed, but for this share, as with
the next. It takes Euler steps of 0.5 s (FGPropulsion::GetSteadyState): about the steady speed W (rad/s) of a power P
they converge for a moment of inertia above 0.75 s P / W^2, from rest for some hundred times that. Its linear model
settles speeds to the last bit: that may take minutes, but not with larger factors. Propellers on piston engines are as
heavy. The light one is then spun up where the trim has put the aircraft, by the steps of flight."""
FIRST_STEP_S, FIRST_STEPS = 1e-4, 2000
"""From rest a propeller is turned by steps so short: there JSBSim takes its power for its torque at 1 rad/s."""
STEADY_SHARE, LONGEST_S = 1e-7, 60.0
"""A propeller turns steadily if its speed changes by at most this share in a step; it has so long to become so."""
INTEGRATORS = [
    f"simulation/integrator/{of}/{kind}al" for of in ("rate", "position") for kind in ("rotation", "translation")
]
OF_BURNING = ("AFR", "n1")  # each piston or turbine has one; an electric engine is never said to be running
LEAST_TRAVEL_DEG = 0.5  # a surface that moves by less than this is taken not to follow its command
ADAMS_BASHFORTH_2 = 3
"""JSBSim's number of the integrator of both rotational states. Its own choice, the rectangle rule, is of first order:
with 60 steps a second the Aerosonde's track on 14 turns is 0.045 m from that with 480, and 0.025 m with this one."""


class _Silence(jsbsim.FGLogger):
    """Takes JSBSim's log, keeps its last errors, and prints nothing."""

    def __init__(self) -> None:
        super().__init__()
        self.errors: deque[str] = deque(maxlen=4)
        self._is_error = False

    def set_level(self, level: Any) -> None:
        """Keeps the messages that follow if they are errors."""
        super().set_level(level)
        self._is_error = int(level) >= ERROR_LEVEL

    def message(self, message: str) -> None:
        """Keeps the message of an error."""
        if self._is_error and (text := " ".join(message.split())) and text != HARMLESS_ERROR:
            self.errors.append(text.partition(' in file Path "')[0])

    def file_location(self, filename: str, line: int) -> None:
        """Drops a location."""


ERROR_LEVEL = 4  # JSBSim's LogLevel::ERROR
HARMLESS_ERROR = "No filename given."  # JSBSim logs this as an error of every model
_LOGGER = _Silence()
"""JSBSim's only logger, kept for ever: JSBSim drops its own reference without Python's lock when a thread ends."""


def node(fdm: Any, path: str) -> Any:
    """The node of a property; AircraftError if there is none: JSBSim would make a new one of a misspelt name."""
    if (found := fdm.get_property_manager().get_node(path)) is None:
        raise AircraftError(f"the model has no property {path!r}")
    return found


def load(files: ModelFiles, step_rate_hz: int = STEP_RATE_HZ) -> Any:
    """A fresh jsbsim.FGFDMExec with the model and the autopilot; AircraftError if it cannot be loaded."""
    jsbsim.set_logger(_LOGGER)
    _LOGGER.errors.clear()
    fdm = jsbsim.FGFDMExec(jsbsim.__path__[0])  # JSBSim itself would look into the site folders alone
    fdm.set_debug_level(0)
    # Before the model: its filters and integrators take their step when they are loaded.
    fdm.set_dt(1.0 / step_rate_hz)
    late = files.latency_s, round(files.latency_s * step_rate_hz)
    linked = given = str(files.model.parent)
    try:
        with with_autopilot(files.model, files.actuators, files.deviation, late, files.engines) as derived:
            linked = str(derived / files.name)  # where JSBSim finds the model's other files
            fdm.set_aircraft_path(str(derived))
            fdm.set_engine_path(str(derived))
            fdm.set_systems_path(str(files.systems))
            loaded = fdm.load_model(files.name)
    except (OSError, ValueError, jsbsim.BaseError) as error:
        reason = " ".join(str(error).split()).replace(linked, given)
        raise AircraftError(f"{files.name}: the model cannot be loaded: {reason}") from error
    if not loaded:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(fdm))  # kept for ever: JSBSim's destructor may crash after this
        errors = "; ".join(_LOGGER.errors).replace(linked, given)
        raise AircraftError(f"{files.name}: JSBSim refuses the model{errors and f': {errors}'}")
    _check_properties(fdm, files)
    fdm.disable_output()
    for motion in ("rate", "position"):
        fdm[f"simulation/integrator/{motion}/rotational"] = ADAMS_BASHFORTH_2
    return fdm


def _check_properties(fdm: Any, files: ModelFiles) -> None:
    """Raises AircraftError if a function of the model reads a property that does not exist.

    The property is made first, for the destructor of the model reads it too and would end the process.
    """
    roots = (whole_model(files.model), *(ElementTree.parse(file).getroot() for _, file in files.engines))
    within = (each for root in roots for function in root.iter("function") for each in function.iter())
    read = (each.text for each in within if each.tag in ("property", "p", "independentVar") and each.text)
    names = {text.strip().lstrip("-").replace("#", "0") for text in read}
    missing = sorted(name for name in names if not fdm.get_property_manager().get_node(name))
    for name in missing:
        fdm[name] = 0.0
    if missing:
        reads = f"its functions read the property {missing[0]}"
        raise AircraftError(f"{files.name}: {reads}, which does not exist")


def trim(fdm: Any, name: str, plane: LocalPlane, start: StartConditions, heading_rad: float) -> None:
    """Trims for straight level flight in calm air, engines running, heading from true north.

    TrimError says that there is no such flight, AircraftError that the model cannot be started.
    """
    _place(fdm, plane, start, heading_rad)
    fault = _trim(fdm, FULL_TRIM)
    given = fdm["aero/alpha-min-rad"], fdm["aero/alpha-max-rad"]
    least, most = given if given[0] < given[1] else (math.radians(-5.0), math.inf)
    for most_deg in ALPHAS_DEG:
        if fault == "" and "wdot" in "; ".join(_LOGGER.errors):
            fdm["aero/alpha-min-rad"], fdm["aero/alpha-max-rad"] = least, min(most, math.radians(most_deg))
            fault = _trim(fdm, FULL_TRIM)
            fdm["aero/alpha-min-rad"], fdm["aero/alpha-max-rad"] = given
    if fault:
        raise AircraftError(f"{name}: the model cannot be started: {fault}")
    if fault is not None:
        if not _LOGGER.errors:  # of a full trim JSBSim seldom says what it cannot balance
            _trim(fdm, LONGITUDINAL_TRIM)
        raise TrimError(
            f"{name} cannot be trimmed for level flight at {start.airspeed_mps:g} m/s, "
            f"{start.altitude_m:g} m above sea level: {_trim_fault_text(fdm)}"
        )


def _place(fdm: Any, plane: LocalPlane, start: StartConditions, heading_rad: float) -> None:
    """Sets initial conditions of level flight, and what a trim leaves as it is."""
    fdm["ic/lat-geod-deg"], fdm["ic/long-gc-deg"] = plane.geodetic(start.east_m, start.north_m)
    fdm["ic/h-sl-ft"] = start.altitude_m / FOOT_M
    fdm["ic/psi-true-rad"] = heading_rad % math.tau
    fdm["ic/vt-fps"] = start.airspeed_mps / FOOT_M
    fdm["gear/gear-cmd-norm"] = 0.0
    for engine in range(fdm.get_propulsion().get_num_engines()):
        fdm[f"fcs/advance-cmd-norm[{engine}]"] = 1.0
    fdm["propulsion/fuel_freeze"] = 1.0  # mass and balance stay as they are trimmed


def _trim(fdm: Any, mode: int) -> str | None:
    """Trims a model. Returns None, or "" where there is no trim, or JSBSim's message where it cannot be started.

    No exception of JSBSim's leaves this function: one that outlives its model ends the process.
    """
    _LOGGER.errors.clear()
    altitude_ft = fdm["ic/h-sl-ft"]
    leaned = has_pistons(fdm) and altitude_ft > RICH_TO_FT
    try:
        if leaned:
            fdm["ic/h-sl-ft"] = RICH_TO_FT
        fdm.run_ic()
        fdm["propulsion/set-running"] = -1.0  # makes the mixture full rich
        if leaned:
            fdm["ic/h-sl-ft"] = altitude_ft
            fdm.run_ic()
            lean(fdm)
        fdm.do_trim(mode)
    except jsbsim.TrimFailureError:
        # JSBSim's message for an aircraft without a rudder, which is then trimmed in its plane of symmetry.
        rudder = mode == FULL_TRIM and "rdot doesn't appear to be trimmable" in "; ".join(_LOGGER.errors)
        return _trim(fdm, LONGITUDINAL_TRIM) if rudder else ""
    except jsbsim.BaseError as error:
        return " ".join(str(error).split()) or "JSBSim does not say why"
    return None


def has_pistons(fdm: Any) -> bool:
    """Whether a loaded model has a piston engine."""
    return fdm.get_property_manager().get_node("propulsion/engine/AFR") is not None


def mixture_of(fdm: Any) -> float:
    """Mixture of piston engines at the pressure where the aircraft is; 1 is fully rich."""
    return min(1.0, float(fdm["atmosphere/P-psf"]) / RICH_TO_PSF)


def given_mixture(fdm: Any) -> float | None:
    """Mixture that `trim` has given piston engines; None where there are none, or their model leans them itself."""
    given = float(fdm["fcs/mixture-cmd-norm"])
    return given if has_pistons(fdm) and abs(given - mixture_of(fdm)) <= 1e-6 else None


def lean(fdm: Any) -> float:
    """Sets the mixture of all engines to that of the pressure, and returns it."""
    mixture = mixture_of(fdm)
    for engine in range(fdm.get_propulsion().get_num_engines()):
        fdm[f"fcs/mixture-cmd-norm[{engine}]"] = mixture
    return mixture


def _trim_fault_text(fdm: Any) -> str:
    """Says why a model has no trim: its thrust or engines, what JSBSim cannot balance, or its own message."""
    engines = [f"propulsion/engine[{each}]" for each in range(fdm.get_propulsion().get_num_engines())]
    if not all(math.isfinite(fdm[f"{each}/thrust-lbs"]) for each in engines):
        return "the thrust of its propeller or engine is not a number"
    has = fdm.get_property_manager().get_node
    burning = [each for each in engines if any(has(f"{each}/{name}") for name in OF_BURNING)]
    if burning and not any(fdm[f"{each}/set-running"] for each in burning):
        return "none of its engines runs after JSBSim's propulsion/set-running"
    told = "; ".join(_LOGGER.errors)
    return next((meaning for name, meaning in UNBALANCED.items() if name in told), told or NO_TRIM)


def _rpms(fdm: Any) -> list[float]:
    """Speeds of the propellers of a model, revolutions a minute."""
    paths = [f"propulsion/engine[{each}]/propeller-rpm" for each in range(fdm.get_propulsion().get_num_engines())]
    return [float(fdm[path]) for path in paths if fdm.get_property_manager().get_node(path)]


def _spin_up(fdm: Any) -> bool:
    """Turns the propellers of a model that stays at its initial conditions; tells whether they become steady."""
    integrators, step_s = {path: fdm[path] for path in INTEGRATORS}, fdm["simulation/dt"]
    fdm.run_ic()
    for path in INTEGRATORS:
        fdm[path] = 0.0  # JSBSim's number of none: the state stays
    fdm.set_dt(FIRST_STEP_S)
    for _ in range(FIRST_STEPS):
        fdm.run()
    fdm.set_dt(step_s)
    steady, now = False, _rpms(fdm)
    for _ in range(round(LONGEST_S / step_s)):
        fdm.run()
        before, now = now, _rpms(fdm)
        if steady := all(abs(b - a) <= STEADY_SHARE * b for a, b in zip(before, now, strict=True)):
            break
    for path, integrator in integrators.items():
        fdm[path] = integrator
    fdm.set_sim_time(0.0)
    fdm.run_ic()
    return steady


@lru_cache(maxsize=64)
def inertia_factor(files: ModelFiles) -> float:
    """Factor of `INERTIA_FACTORS` that a model's propellers need, from rest to full throttle; 1 if none will do."""
    found = list[float]()
    for index, factor in enumerate(INERTIA_FACTORS if files.has_electric_propeller else ()):
        before = found
        with heavier(files, factor) as heavy:
            fdm = load(heavy)
        fdm.run_ic()
        fdm["propulsion/set-running"] = -1.0  # at full throttle, by FGPropulsion::GetSteadyState
        found = _rpms(fdm)
        if before and all(before) and np.allclose(found, before, rtol=SAME_SHARE):
            return float(INERTIA_FACTORS[index - 1])
    return 1.0


def load_trimmed(
    files: ModelFiles,
    plane: LocalPlane,
    start: StartConditions,
    heading_rad: float,
    step_rate_hz: int = STEP_RATE_HZ,
    factor: float | None = None,
) -> Any:
    """A fresh jsbsim.FGFDMExec, trimmed as by `trim`, its propellers heavier by a factor, else as that needs."""
    with heavier(files, factor or inertia_factor(files)) as heavy:
        fdm = load(heavy, step_rate_hz)
    trim(fdm, files.name, plane, start, heading_rad)
    return fdm


def load_for_flight(
    files: ModelFiles, plane: LocalPlane, start: StartConditions, heading_rad: float, step_rate_hz: int
) -> Any:
    """As `load_trimmed`, but with the model's own propellers; AircraftError if they never turn steadily."""
    steady = load_trimmed(files, plane, start, heading_rad, step_rate_hz)
    if inertia_factor(files) == 1.0:
        return steady
    fdm = load(files, step_rate_hz)
    _place(fdm, plane, start, heading_rad)
    fdm.run_ic()
    fdm["propulsion/set-running"] = -1.0
    throttles = [f"fcs/throttle-cmd-norm[{each}]" for each in range(fdm.get_propulsion().get_num_engines())]
    for path, other in {**KEPT, **dict(zip(throttles, throttles, strict=True))}.items():
        fdm[path] = steady[other]
    if not _spin_up(fdm):
        never = f"steps of 1/{step_rate_hz} s never bring its propeller to a steady speed"
        raise AircraftError(f"{files.name}: {never}; its <ixx> must be larger")
    return fdm


def trimmed(files: ModelFiles, airspeed_mps: float, factor: float | None = None) -> Any:
    """As `load_trimmed`, in level flight northwards, 300 m up, in calm air; AircraftError if there is none."""
    start = StartConditions(0.0, 0.0, REFERENCE_ALTITUDE_M, 0.0, airspeed_mps)
    return load_trimmed(files, LocalPlane(45.0, 0.0), start, heading_rad=0.0, factor=factor)


def mass_kg(fdm: Any) -> float:
    """Mass of a loaded and trimmed aircraft."""
    return float(fdm["inertia/mass-slugs"]) * SLUG_KG


def lift_limit(files: ModelFiles, airspeed_mps: float, side: float) -> tuple[float | None, FloatArray]:
    """Angle of attack (deg) up to which (`side` 1) lift rises, or down to which (-1) it falls; None: it never stops.

    Controls are as trimmed at the airspeed. With it the (k, 2) angles tried, from the trim's on, and lift over weight.
    """
    fdm = trimmed(files, airspeed_mps)
    start_deg, weight_lbf = math.degrees(fdm["aero/alpha-rad"]), float(fdm["inertia/weight-lbs"])
    tried = list[tuple[float, float]]()
    for alpha_deg in np.arange(start_deg, side * MOST_ALPHA_DEG, side * ALPHA_STEP_DEG).tolist():
        fdm["ic/vt-fps"] = airspeed_mps / FOOT_M
        fdm["ic/alpha-deg"] = alpha_deg
        fdm.run_ic()
        lift = fdm["forces/fwz-aero-lbs"] / weight_lbf  # up, other than the axis
        if tried and side * lift <= side * tried[-1][1]:
            return tried[-1][0], np.array(tried)
        tried.append((alpha_deg, lift))
    return None, np.array(tried)


def linearised(fdm: Any) -> Derivatives:
    """Derivatives of a trimmed jsbsim.FGFDMExec, by JSBSim's FGLinearization; AircraftError if it cannot."""
    try:
        linear = jsbsim.FGLinearization(fdm)
    except jsbsim.BaseError as error:
        raise AircraftError(f"the model cannot be linearised: {' '.join(str(error).split())}") from None
    return derivatives(
        list(linear.x_names),
        list(linear.u_names),
        np.asarray(linear.system_matrix),
        np.asarray(linear.input_matrix),
        airspeed_fps=fdm["velocities/vtrue-fps"],
        alpha_rad=fdm["aero/alpha-rad"],
        qbar_psf=fdm["aero/qbar-psf"],
    )


def surface_travel_deg(files: ModelFiles) -> dict[str, float]:
    """Degrees that each surface moves for a command of 1, by control; 0 where the model does not show it."""
    travel = {"throttle": THROTTLE_TRAVEL_DEG}
    for control, properties in SURFACE_POSITIONS.items():
        ends = []
        for command in (-1.0, 1.0):
            fdm = load(files)
            fdm.run_ic()
            for _ in range(120):
                fdm[f"fcs/{control}-cmd-norm"] = command
                fdm.run()
            ends.append([float(fdm[path]) for path in properties])
        moved = max(abs(after - before) for before, after in zip(*ends, strict=True))
        travel[control] = 0.5 * math.degrees(moved) if math.degrees(moved) >= LEAST_TRAVEL_DEG else 0.0
    return {control: round(travel[control], 3) for control in CONTROLS}
