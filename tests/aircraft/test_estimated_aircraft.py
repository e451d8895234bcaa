"""FunRay and Penguin B: their derivatives anew from their geometry, and what is published of their flight."""

import math
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from aircraft.airframes import airframe
from aircraft.frames import LocalPlane
from aircraft.jsbsim_loading import load, trim
from aircraft.model_files import model_files
from aircraft.start import StartConditions

RHO, G = 1.225, 9.80665


def planform(eta: list[float], chord_m: list[float], span_m: float) -> tuple[Any, Any, float]:
    """Places on half a wing, chord there, and area of both halves, m."""
    y = np.linspace(0.0, span_m / 2, 4001)
    c = np.interp(y, np.array(eta) * span_m / 2, chord_m)
    return y, c, 2.0 * float(np.trapezoid(c, y))


FUNRAY_WING = planform([0, 0.085, 0.29, 0.475, 0.685, 0.895, 1], [0.235, 0.235, 0.228, 0.196, 0.164, 0.12, 0.09], 2.0)
FUNRAY_TAIL, FUNRAY_FIN = (planform([0, 0.74, 1], [0.135, 0.09, 0.07], 0.52)[2], 0.28 * (0.8 * 0.18 + 0.2 * 0.105))
PENGUIN_WING = planform([0, 1], [0.79 / 3.3 * 1.25, 0.79 / 3.3 * 0.75], 3.3)
PENGUIN_CHORD = 2.0 * float(np.trapezoid(PENGUIN_WING[1] ** 2, PENGUIN_WING[0])) / 0.79
GEOMETRY: dict[str, dict[str, Any]] = {
    "funray": {
        "wing": FUNRAY_WING, "b": 2.0, "section": 1.0, "cl": 0.5, "dihedral": 0.0, "eta": 1.0, "arm": 1.12 - 0.445,
        "tail": FUNRAY_TAIL, "fin": FUNRAY_FIN, "tail_ar": 0.52**2 / FUNRAY_TAIL, "fin_ar": 1.55 * 0.28**2 / FUNRAY_FIN,
        "fin_above": 0.26, "behind": 0.015, "pod": 0.0025, "pod_side": 0.2 * 0.0025 ** (2 / 3), "left": 0.5,
        "flaps": (0.36, 0.5, 0.23), "ailerons": (0.475, 0.895), "kg": 2.15, "clmax": 1.0,
    },
    "penguin_b": {
        "wing": PENGUIN_WING, "b": 3.3, "section": 0.95, "cl": 0.65, "dihedral": math.radians(3), "eta": 0.95,
        "arm": 1.15, "tail": 0.5 * 0.79 * PENGUIN_CHORD / 1.15, "fin": 0.04 * 0.79 * 3.3 / 1.15, "tail_ar": 4.0,
        "fin_ar": 2.5, "fin_above": 0.0, "behind": 0.0, "pod": 0.045, "pod_side": 2 * math.pi / 4 * 0.25**2,
        "left": 0.7, "flaps": (0.35, 0.35, 0.25), "ailerons": (0.55, 0.95), "kg": 21.5, "clmax": 1.3,
    },
}  # fmt: skip
"""What stands at the head of each model."""


def slope(aspect_ratio: float) -> float:
    """Helmbold's lift slope of a straight wing, 1/rad."""
    return math.tau * aspect_ratio / (2.0 + math.hypot(2.0, aspect_ratio))


def flap(depth: float, left: float) -> float:
    """Glauert's change of the angle of no lift with a flap's angle, times what viscosity leaves of it."""
    angle = math.acos(2.0 * depth - 1.0)
    return left * (1.0 - (angle - math.sin(angle)) / math.pi)


def estimated(name: str) -> dict[tuple[str, str], float]:
    """Derivatives by axis and property, from geometry alone (Nelson, chapters 2, 3 and 5)."""
    g = GEOMETRY[name]
    (y, c, s), b, cl = g["wing"], g["b"], g["cl"]
    mac, ar = 2.0 * np.trapezoid(c * c, y) / s, b * b / s
    wing, roll = g["section"] * slope(ar), g["section"] * slope(ar / 2)
    tail, fin = g["eta"] * slope(g["tail_ar"]), g["eta"] * slope(g["fin_ar"]) * g["fin"] / s
    volume, downwash = g["tail"] * g["arm"] / (s * mac), 2.0 * wing / (math.pi * ar)
    munk, lever = 2.0 * 0.9 * g["pod"], g["arm"] / b
    elevator, rudder, aileron = (flap(depth, g["left"]) for depth in g["flaps"])
    moved = (y >= g["ailerons"][0] * b / 2) & (y <= g["ailerons"][1] * b / 2)
    by_aileron = 2.0 * roll * aileron / (s * b) * np.trapezoid((c * y)[moved], y[moved])
    up = fin * g["fin_above"] / b
    return {
        ("Z", "alpha"): wing + tail * g["tail"] / s * (1.0 - downwash),
        ("Z", "q"): 2.0 * tail * volume,
        ("Z", "alphadot"): 2.0 * tail * volume * downwash,
        ("Z", "elevator"): tail * g["tail"] / s * elevator,
        ("PITCH", "alpha"): -tail * volume * (1.0 - downwash) + wing * g["behind"] / mac + munk / (s * mac),
        ("PITCH", "q"): -2.0 * tail * volume * g["arm"] / mac,
        ("PITCH", "alphadot"): -2.0 * tail * volume * g["arm"] / mac * downwash,
        ("PITCH", "elevator"): -tail * volume * elevator,
        ("Y", "beta"): -fin - g["pod_side"] / s,
        ("Y", "r"): 2.0 * fin * lever,
        ("Y", "rudder"): fin * rudder,
        ("ROLL", "beta"): -2.0 * roll * g["dihedral"] / (s * b) * np.trapezoid(c * y, y) - up,
        ("ROLL", "p"): -4.0 * roll / (s * b * b) * np.trapezoid(c * y * y, y),
        ("ROLL", "r"): cl / 4,
        ("ROLL", "aileron"): by_aileron,
        ("ROLL", "rudder"): up * rudder,
        ("YAW", "beta"): fin * lever - munk / (s * b),
        ("YAW", "p"): -cl / 8,
        ("YAW", "r"): -2.0 * fin * lever**2 - 0.25 * drag_at_no_lift(name) - 0.02 * cl * cl,
        ("YAW", "aileron"): -0.2 * cl * by_aileron,
        ("YAW", "rudder"): -fin * lever * rudder,
    }


def drag_at_no_lift(name: str) -> float:
    """CD0: the parts' of the FunRay; what 1864 W, 0.69 of it thrust, leave of the Penguin B's at 36 m/s."""
    if name == "funray":
        s = FUNRAY_WING[2]
        return float(0.015 * (s + FUNRAY_TAIL + FUNRAY_FIN) / s + 0.07 * 0.0025 ** (2 / 3) / s)
    pressed_n = 0.5 * RHO * 36.0**2 * 0.79
    induced = (21.5 * G / pressed_n) ** 2 / (math.pi * 0.8 * 3.3**2 / 0.79)
    return float(0.69 * 1864.0 / 36.0 / pressed_n - induced)


@pytest.mark.parametrize("name", GEOMETRY)
def test_every_derivative_follows_from_the_geometry(name: str) -> None:
    paths = {
        "q": "velocities/q-aero-rad_sec", "p": "velocities/p-aero-rad_sec", "r": "velocities/r-aero-rad_sec",
        "alpha": "aero/alpha-rad", "beta": "aero/beta-rad", "alphadot": "aero/alphadot-rad_sec",
        "elevator": "fcs/elevator-pos-rad", "aileron": "fcs/right-aileron-pos-rad", "rudder": "fcs/rudder-pos-rad",
    }  # fmt: skip
    wanted = {key: value for key, value in estimated(name).items() if abs(value) > 1e-9}
    named = {path: key for key, path in paths.items()}
    root = ElementTree.parse(model_files(name).model).getroot()
    terms: list[tuple[str | None, Any]] = [
        ("Z", each) for each in root.iterfind("aerodynamics/function[1]/sum/product")
    ]
    terms += [(axis.get("name"), each) for axis in root.iter("axis") for each in axis.iterfind(".//sum/product")]
    found = {}
    for axis, product in terms:
        first, last = product[0], product[-1]
        if first.tag == "value" and last.tag == "property" and last.text in named:
            found[axis, named[last.text]] = float(first.text or "nan")
    assert found == pytest.approx(wanted, rel=2e-3, abs=6e-5)


def at(name: str, alpha_rad: float, airspeed_mps: float) -> tuple[float, float]:
    """Lift and drag of a model at rest in angle of attack, N."""
    fdm = load(model_files(name))
    fdm["ic/h-sl-ft"], fdm["ic/vt-fps"], fdm["ic/alpha-rad"] = 0.0, airspeed_mps / 0.3048, alpha_rad
    fdm.run_ic()
    attached = fdm["aero/coefficient/CL-linear"]
    lift = fdm["aero/qbar-psf"] * fdm["metrics/Sw-sqft"] * attached * (1.0 - fdm["aero/separation"])
    return lift * 4.4482216, fdm["aero/force/drag"] * 4.4482216


@pytest.mark.parametrize("name", GEOMETRY)
def test_lift_carries_the_weight_down_to_the_stall_speed(name: str) -> None:
    """V = sqrt(2 W / (rho S CLmax)): level flight ends within 6 % above it, 300 m above the sea."""
    g = GEOMETRY[name]
    stall_mps = math.sqrt(2.0 * g["kg"] * G / (1.19 * g["wing"][2] * g["clmax"]))
    assert stall_mps <= airframe(name).airspeed_range_mps[0] <= 1.06 * stall_mps


def test_funray_glides_as_its_polar_says() -> None:
    """(L/D) max = sqrt(pi e AR / CD0) / 2."""
    expected = 0.5 * math.sqrt(math.pi * 0.85 * (4.0 / FUNRAY_WING[2]) / drag_at_no_lift("funray"))
    ratios = [lift / drag for lift, drag in (at("funray", alpha, 12.0) for alpha in np.linspace(-0.02, 0.1, 13))]
    assert max(ratios) == pytest.approx(expected, rel=0.02)


def test_penguin_b_flies_36_mps_at_full_throttle() -> None:
    """Its data sheet's highest speed of level flight."""
    fdm = load(model_files("penguin_b"))
    trim(fdm, "penguin_b", LocalPlane(45.0, 0.0), StartConditions(0.0, 0.0, 3.0, 0.0, 36.0), 0.0)
    assert fdm["fcs/throttle-cmd-norm"] == pytest.approx(1.0, abs=0.02)


def test_penguin_b_lasts_as_long_as_it_did() -> None:
    """54 h 27 min on 13 kg of 22.3 kg (FlightGlobal, Farnborough 2012); 0.45 to 0.65 kg/kWh are a two-stroke's."""
    mean_n = (22.3 - 13.0 / 2) * G
    low, high = -0.05, 0.19
    for _ in range(30):
        alpha = 0.5 * (low + high)
        low, high = (alpha, high) if at("penguin_b", alpha, 20.0)[0] < mean_n else (low, alpha)
    assert 0.45 <= 13.0 / 54.45 / (at("penguin_b", low, 20.0)[1] * 20.0 / 0.65 / 1000.0) <= 0.65
