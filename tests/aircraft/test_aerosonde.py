"""The Aerosonde model against the published figures of Beard and McLain."""

import math
from typing import Any

import jsbsim
import numpy as np
import pytest

import aircraft
from aircraft.airframes import airframe
from aircraft.autopilot import Derivatives
from aircraft.frames import LocalPlane
from aircraft.jsbsim_loading import linearised
from aircraft.jsbsim_model import JsbsimModel
from aircraft.start import StartConditions

FOLDER = aircraft.__path__[0]
FOOT = 0.3048
NEWTON_PER_LBF = 4.4482216
KGPM3_PER_SLUGPFT3 = 515.378818


@pytest.fixture
def fdm() -> Any:
    """The model alone, no autopilot, at rho 1.2683 and 25 m/s, before trim."""
    model = jsbsim.FGFDMExec(None)
    model.set_debug_level(0)
    model.set_aircraft_path(FOLDER)
    model.set_engine_path(f"{FOLDER}/aerosonde")
    assert model.load_model("aerosonde")
    model.set_dt(1.0 / 120.0)
    model["atmosphere/override/density"] = 1.2683 / KGPM3_PER_SLUGPFT3
    model["ic/lat-geod-deg"] = 47.0
    model["ic/h-sl-ft"] = 1000.0
    model["ic/vt-fps"] = 25.0 / FOOT
    model.run_ic()
    model["propulsion/set-running"] = -1
    return model


def test_propeller_at_the_published_check_point(fdm: Any) -> None:
    fdm["atmosphere/override/density"] = 1.2682 / KGPM3_PER_SLUGPFT3
    fdm["fcs/throttle-cmd-norm"] = 0.5
    fdm.suspend_integration()
    for _ in range(3):
        fdm.run()
    assert fdm["motor/thrust-lbs"] * NEWTON_PER_LBF == pytest.approx(-12.43073, abs=2e-4)
    assert fdm["motor/torque-lbsft"] * NEWTON_PER_LBF * FOOT == pytest.approx(-0.498796, abs=1e-5)
    assert fdm["external_reactions/propeller-thrust/magnitude"] == fdm["motor/thrust-lbs"]
    assert fdm["external_reactions/propeller-torque/magnitude-lbsft"] == fdm["motor/torque-lbsft"]


def test_mass_properties(fdm: Any) -> None:
    assert fdm["inertia/mass-slugs"] * 14.59390 == pytest.approx(11.0, rel=1e-4)
    for axis, value in {"ixx": 0.8244, "iyy": 1.135, "izz": 1.759, "ixz": -0.1204}.items():
        assert fdm[f"inertia/{axis}-slugs_ft2"] * 14.59390 * FOOT**2 == pytest.approx(value, rel=1e-4)


def test_trim_is_the_published_one(fdm: Any) -> None:
    fdm.do_trim(1)
    assert fdm["aero/alpha-rad"] == pytest.approx(0.0497, abs=1e-4)
    assert fdm["fcs/elevator-pos-rad"] == pytest.approx(-0.1238, abs=1e-4)
    assert fdm["fcs/throttle-cmd-norm"] == pytest.approx(0.7737, abs=5e-4)


def test_linear_model_is_the_published_one(fdm: Any) -> None:
    fdm.do_trim(1)
    at: Derivatives = linearised(fdm)
    assert at.lp == pytest.approx(-22.63, rel=1e-3)
    assert at.nb == pytest.approx(19.58, rel=1e-3)
    assert at.ma == pytest.approx(-99.96, rel=1e-3)
    assert at.mde / math.radians(25.0) == pytest.approx(-36.12, rel=1e-3)


def test_lift_and_drag_follow_the_published_coefficients(fdm: Any) -> None:
    area = 0.55
    fdm["ic/alpha-rad"] = 0.1
    fdm["ic/vt-fps"] = 25.0 / FOOT
    fdm.run_ic()
    qbar = fdm["aero/qbar-psf"] * NEWTON_PER_LBF / FOOT**2
    lift_coefficient = 0.23 + 5.61 * 0.1
    drag_coefficient = 0.043 + lift_coefficient**2 / (math.pi * 0.9 * 2.8956**2 / 0.55)
    assert fdm["aero/alpha-rad"] == pytest.approx(0.1, abs=1e-6)
    lift = -fdm["forces/fwz-aero-lbs"] * NEWTON_PER_LBF
    assert abs(lift) == pytest.approx(qbar * area * lift_coefficient, rel=2e-3)
    drag = fdm["forces/fwx-aero-lbs"] * NEWTON_PER_LBF
    assert abs(drag) == pytest.approx(qbar * area * drag_coefficient, rel=2e-3)


def test_level_flight_range() -> None:
    """Published: level from 17.3 to 32.4 m/s; what the autopilot holds in a gentle bank is a little less."""
    assert airframe("aerosonde").airspeed_range_mps == pytest.approx((17.3, 32.4), abs=0.35)
    plane = LocalPlane(47.0, 8.0)
    for airspeed, elevator, throttle in ((17.6, 0.9, 0.55), (32.3, 0.1, 1.0)):
        fdm = JsbsimModel(airframe("aerosonde"), StartConditions(0.0, 0.0, 50.0, 0.0, airspeed), plane)._fdm
        assert -fdm["fcs/elevator-pos-rad"] / math.radians(25.0) == pytest.approx(elevator, abs=0.06)
        assert fdm["fcs/throttle-cmd-norm"] == pytest.approx(throttle, abs=0.06)


def test_stays_finite_in_a_deep_stall(fdm: Any) -> None:
    fdm["fcs/elevator-cmd-norm"] = -1.0
    for _ in range(1200):
        fdm.run()
        assert np.isfinite(fdm["aero/alpha-rad"])
