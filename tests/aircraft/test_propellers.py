"""Propellers on electric engines, too light for JSBSim's trim, against the tables of such a propeller."""

import math
import re
import shutil
import xml.etree.ElementTree as ElementTree
from dataclasses import astuple, replace
from pathlib import Path

import jsbsim
import numpy as np
import pytest

from aircraft.airframes import airframe
from aircraft.deviation import Deviation
from aircraft.frames import LocalPlane
from aircraft.jsbsim_loading import linearised, trimmed
from aircraft.jsbsim_model import JsbsimModel
from aircraft.model_files import OWN_FOLDER, model_files
from aircraft.start import StartConditions
from aircraft.survey import derivatives_at

ENGINES = Path(jsbsim.__path__[0], "engine")
LBF_N, DIAMETER_M, POWER_W = 4.448222, 18 * 0.0254, 2207.27
AIRSPEED_MPS = 25.0


@pytest.fixture
def electric(tmp_path: Path) -> str:
    """The aerosonde with an engine of 2,207 W and a propeller of 18 x 8 inches, as the Rascal has them."""
    made = shutil.copytree(OWN_FOLDER / "aerosonde", tmp_path / "electric")
    text = (made / "aerosonde.xml").read_text()
    (made / "aerosonde.xml").unlink()
    of_motor = "unpowered_engine(.*)unpowered_thruster(.*)<system file=.motor./>(.*)<force .*</moment>"
    (made / "electric.xml").write_text(re.sub(of_motor, r"Zenoah_G-26A\1APC_18x8E\2\3", text, flags=re.DOTALL))
    return str(made)


def table(name: str, key: float) -> float:
    """A table of the propeller, interpolated."""
    found = ElementTree.parse(ENGINES / "APC_18x8E.xml").findtext(f"table[@name='{name}']/tableData", "")
    return float(np.interp(key, *np.array(found.split(), dtype=float).reshape(-1, 2).T))


def test_a_light_propeller_is_trimmed_at_the_speed_that_takes_the_power_of_its_engine(electric: str) -> None:
    fdm = trimmed(model_files(electric), AIRSPEED_MPS)
    rpm, along = fdm["propulsion/engine/propeller-rpm"], math.cos(fdm["aero/alpha-rad"])
    density_kgpm3, turns_1ps = 515.378818 * fdm["atmosphere/rho-slugs_ft3"], rpm / 60.0
    advance = along * AIRSPEED_MPS / (turns_1ps * DIAMETER_M)
    power, thrust = (table(f"C_{kind}", advance) * table(f"C{kind[0]}_RPM_FACTOR", rpm) for kind in ("POWER", "THRUST"))
    taken_w = power * density_kgpm3 * turns_1ps**3 * DIAMETER_M**5
    assert fdm["fcs/throttle-cmd-norm"] * POWER_W == pytest.approx(taken_w, rel=1e-3)
    pull_n = thrust * density_kgpm3 * turns_1ps**2 * DIAMETER_M**4
    assert pull_n * along == pytest.approx(fdm["forces/fwx-aero-lbs"] * LBF_N, rel=1e-3)


def test_it_begins_a_flight_at_that_speed_with_its_own_inertia(electric: str) -> None:
    start = StartConditions(0.0, 0.0, 300.0, 0.0, AIRSPEED_MPS)
    model = JsbsimModel(airframe(electric), start, LocalPlane(45.0, 0.0))
    fdm, rpm = model._fdm, "propulsion/engine/propeller-rpm"
    steady = trimmed(model_files(electric), AIRSPEED_MPS)[rpm]
    assert fdm[rpm] == pytest.approx(steady, rel=1e-4)
    model.advance(240)
    assert fdm[rpm] == pytest.approx(steady, rel=1e-3)
    model.engage(False)
    fdm["fcs/throttle-cmd-norm"] += 0.1
    before = fdm[rpm]
    model.advance(1)
    # I W dW/dt = P: a tenth of the power, on 72.9 g over 18 inches, in one step.
    speed_radps, inertia_kgm2 = before * math.tau / 60.0, 72.9e-3 * DIAMETER_M**2 / 12.0
    gained_radps = 0.1 * POWER_W / (speed_radps * inertia_kgm2) / model.step_rate_hz
    assert (fdm[rpm] - before) * math.tau / 60.0 == pytest.approx(gained_radps, rel=0.02)


def test_an_engine_without_a_propeller_beside_it_changes_no_derivative(electric: str) -> None:
    model = Path(electric, "electric.xml")
    alone = linearised(trimmed(model_files(electric), AIRSPEED_MPS))
    dummy = '<engine file="unpowered_engine"><thruster file="unpowered_thruster"/></engine></propulsion>'
    model.write_text(model.read_text().replace("</propulsion>", dummy))
    both = linearised(trimmed(model_files(electric), AIRSPEED_MPS))
    assert astuple(both) == pytest.approx(astuple(alone), rel=1e-3)


def test_more_thrust_has_more_moments_about_the_centre_of_gravity(electric: str) -> None:
    """The propeller is 0.15 m to the right of the origin of the structural frame, the centre of gravity 0.05 above."""
    model = Path(electric, "electric.xml")
    aside = re.sub(r"(<thruster .*?<y>)0(</y>)", r"\g<1>0.15\2", model.read_text(), flags=re.DOTALL)
    model.write_text(re.sub(r'(name="CG".*?<z>)0(</z>)', r"\g<1>0.05\2", aside))
    fdm = trimmed(replace(model_files(electric), deviation=Deviation(thrust=0.1)), AIRSPEED_MPS)
    more_lbf = 0.1 * fdm["forces/fbx-prop-lbs"]
    assert fdm["forces/fbx-external-lbs"] == pytest.approx(more_lbf) != 0.0
    moments_lbsft = [fdm[f"moments/{axis}-external-lbsft"] for axis in "lmn"]
    assert moments_lbsft == pytest.approx([0.0, more_lbf * 0.05 / 0.3048, -more_lbf * 0.15 / 0.3048], rel=0.02)


def test_a_light_propeller_turned_aside_couples_roll_and_yaw_by_no_more_than_its_own_spin(electric: str) -> None:
    """Turned by 3 degrees it has sin(3 degrees) of its spin across: some 0.03 kg m2/s of 72.9 g, on 0.8 kg m2."""
    model = Path(electric, "electric.xml")
    along = derivatives_at(model_files(electric), AIRSPEED_MPS)
    turned = r"\1<orient unit='DEG'><roll>0</roll><pitch>0</pitch><yaw>3</yaw></orient>\2"
    model.write_text(re.sub(r"(<thruster .*?)(</thruster>)", turned, model.read_text(), flags=re.DOTALL))
    aside = derivatives_at(model_files(electric), AIRSPEED_MPS)
    assert (aside.lr, aside.np) == pytest.approx((along.lr, along.np), abs=0.1)
