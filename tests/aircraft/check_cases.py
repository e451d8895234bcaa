"""Check cases of the NASA Engineering and Safety Center, flown by JSBSim as wayproof loads it.

E. B. Jackson and others, "Check-Cases for Verification of 6-Degree-of-Freedom Flight Vehicle Simulations",
NASA/TM-2015-218675: bodies that fall or are thrown over a turning ellipsoid for 30 s. The figures of its simulations at
the end are those of nasa/simupy-flight at 70754e6, NESC_data; `python -m tests.aircraft.check_cases` prints the table
of aircraft/VALIDATION.md.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from aircraft.interface import FOOT_M as FOOT_M
from aircraft.jsbsim_loading import load
from aircraft.model_files import model_files

SECONDS = 30.0
EARTH_DEGPS = 0.004178073
"""Roll rate over the ground of a body that heads north at the equator and does not turn."""

BRICK = (0.22222, 0.33333, 0.66667, 0.00189422, 0.006211019, 0.007194665, 0.155404754)
SPHERE = (0.1963495, 1.0, 1.0, 3.6, 3.6, 3.6, 1.0)
"""Area ft2, span, chord ft, moments of inertia slug ft2, mass slug."""

ALTITUDE, LONGITUDE, LATITUDE = "position/h-sl-ft", "position/long-gc-deg", "position/lat-geod-deg"
ANGLES = ("attitude/phi-deg", "attitude/theta-deg", "attitude/psi-deg")

NAMES = {ALTITUDE: "altitude, ft", LONGITUDE: "longitude, deg", LATITUDE: "latitude, deg"} | dict(
    zip(ANGLES, ("roll, deg", "pitch, deg", "yaw, deg"), strict=True)
)


@dataclass(frozen=True)
class Case:
    """A case and where NASA's simulations end.

    Attributes:
        name: what flies.
        body: as `SPHERE`.
        ends: lowest and highest figure of NASA's simulations at 30 s, by property; attitude of case 2 without that
            of its SIM 02, which is 4 degrees off.
        drag: coefficient.
        damping: roll, pitch and yaw moment by their own rate.
        turning_degps: body rates at the start, in inertial space.
        thrown_fps: velocity north, east and down at the start; if any, from the sea's level, else 30,000 ft.
    """

    name: str
    body: tuple[float, ...]
    ends: dict[str, tuple[float, float]]
    drag: float = 0.0
    damping: float = 0.0
    turning_degps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    thrown_fps: tuple[float, float, float] = (0.0, 0.0, 0.0)


CASES = {
    1: Case("sphere without drag", SPHERE, {ALTITUDE: (15598.9038, 15598.9060), LONGITUDE: (5.740e-5, 5.746e-5)}),
    2: Case("tumbling brick", BRICK,
        dict(zip(ANGLES, ((-56.1514, -56.1503), (-3.8220, -3.8196), (-4.2894, -4.2881)), strict=True)),
        turning_degps=(10.0, 20.0, 30.0)),
    3: Case("tumbling brick, damped", BRICK,
        dict(zip(ANGLES, ((-5.153, -5.083), (-39.351, -38.699), (-111.670, -111.355)), strict=True)),
        damping=-1.0, turning_degps=(10.0, 20.0, 30.0)),
    6: Case("sphere with drag", SPHERE, {ALTITUDE: (16284.44, 16284.73), LONGITUDE: (5.337e-5, 5.341e-5)}, drag=0.1),
    9: Case("cannonball to the east", SPHERE, {ALTITUDE: (10156.83, 10160.99), LONGITUDE: (0.061635, 0.061648)},
        drag=0.1, thrown_fps=(0.0, 1000.0, -1000.0)),
    10: Case("cannonball to the north", SPHERE, {ALTITUDE: (10110.65, 10114.81), LATITUDE: (0.061715, 0.062136)},
        drag=0.1, thrown_fps=(1000.0, 0.0, -1000.0)),
}  # fmt: skip

INTEGRATORS = {
    "rectangle rule (JSBSim's own)": (1, 1),
    "Adams-Bashforth 2 (wayproof's)": (3, 3),
    "Adams-Bashforth 4": (5, 5),
}
"""JSBSim's numbers of the methods for rotational rate and attitude."""


def model_xml(case: Case) -> str:
    area, span, chord, ixx, iyy, izz, slug = case.body
    here = "<x>0</x><y>0</y><z>0</z>"
    places = "".join(f'<location name="{each}" unit="FT">{here}</location>' for each in ("AERORP", "EYEPOINT", "VRP"))
    damped = "".join(
        f'<axis name="{axis}"><function name="aero/{axis}"><product><property>aero/qbar-psf</property>'
        f"<property>metrics/Sw-sqft</property><property>metrics/{arm}</property><property>aero/{per}2vel</property>"
        f"<property>velocities/{rate}-aero-rad_sec</property><value>{case.damping}</value></product></function></axis>"
        for axis, arm, per, rate in (
            ("ROLL", "bw-ft", "bi", "p"), ("PITCH", "cbarw-ft", "ci", "q"), ("YAW", "bw-ft", "bi", "r")
        )
    )  # fmt: skip
    return (
        f'<?xml version="1.0"?><fdm_config name="body" version="2.0"><metrics><wingarea unit="FT2">{area}</wingarea>'
        f'<wingspan unit="FT">{span}</wingspan><chord unit="FT">{chord}</chord>{places}</metrics><mass_balance>'
        f'<ixx unit="SLUG*FT2">{ixx}</ixx><iyy unit="SLUG*FT2">{iyy}</iyy><izz unit="SLUG*FT2">{izz}</izz>'
        f'<emptywt unit="LBS">{slug * 32.17404855643}</emptywt><location name="CG" unit="FT">{here}</location>'
        '</mass_balance><ground_reactions/><propulsion/><flight_control name="none"/><aerodynamics><axis name="DRAG">'
        '<function name="aero/drag"><product><property>aero/qbar-psf</property><property>metrics/Sw-sqft</property>'
        f"<value>{case.drag}</value></product></function></axis>{damped}</aerodynamics></fdm_config>"
    )


def flown(case: Case, rate_hz: int = 120, methods: tuple[int, int] | None = None) -> dict[str, float]:
    """Where a case ends: ft, degrees, inertial rates in deg/s; `methods` as `INTEGRATORS`, None: wayproof's."""
    with TemporaryDirectory() as folder:
        (Path(folder) / "body.xml").write_text(model_xml(case), encoding="utf-8")
        fdm = load(model_files(folder), rate_hz)
    if methods is not None:
        for motion, method in zip(("rate", "position"), methods, strict=True):
            fdm[f"simulation/integrator/{motion}/rotational"] = method
    fdm["ic/h-sl-ft"] = 0.0 if any(case.thrown_fps) else 30000.0
    fdm["ic/psi-true-rad"] = math.atan2(case.thrown_fps[1], case.thrown_fps[0])
    still = 0.0 if any(case.thrown_fps) else EARTH_DEGPS  # a thrown ball does not turn over the ground
    p, q, r = case.turning_degps
    for axis, velocity, body, rate in zip("ned", case.thrown_fps, "pqr", (p - still, q, r), strict=True):
        fdm[f"ic/v{axis}-fps"] = velocity
        fdm[f"ic/{body}-rad_sec"] = math.radians(rate)
    fdm.run_ic()
    for _ in range(round(SECONDS * rate_hz)):
        fdm.run()
    ended = {path: fdm[path] for path in (ALTITUDE, LONGITUDE, LATITUDE, *ANGLES)}
    ended[ANGLES[2]] = math.remainder(ended[ANGLES[2]], 360.0)
    return ended | {axis: math.degrees(fdm[f"velocities/{axis}i-rad_sec"]) for axis in "pqr"}


def rows() -> list[str]:
    """The tables of aircraft/VALIDATION.md: ends beside NASA's, then attitude by integrator."""
    told = ["| case | at the end | NASA's simulations | JSBSim as wayproof loads it |", "| --- | --- | --- | --- |"]
    for number, case in CASES.items():
        ended = flown(case)
        for path, (low, high) in case.ends.items():
            told.append(f"| {number}, {case.name} | {NAMES[path]} | {low:.9g} to {high:.9g} | {ended[path]:.8g} |")
    told += ["", "| case 2, integrator of the rotation | 60 steps a second | 120 | 480 |", "| --- | --- | --- | --- |"]
    for name, methods in INTEGRATORS.items():
        every = [flown(CASES[2], rate_hz, methods) for rate_hz in (60, 120, 480)]
        off = [max(abs(each[path] - sum(CASES[2].ends[path]) / 2.0) for path in ANGLES) for each in every]
        told.append(f"| {name} | {' | '.join(f'{each:.4f}' for each in off)} |")
    return told


if __name__ == "__main__":
    print("\n".join(rows()))
