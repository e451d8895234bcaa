"""Gains from derivatives, and the system that is given to a model."""

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import pytest

from aircraft.airframes import airframe
from aircraft.autopilot import Derivatives, gains
from aircraft.injection import with_autopilot
from aircraft.jsbsim_loading import INTEGRATORS, linearised, trimmed
from aircraft.model_files import model_files

AEROSONDE = Derivatives(
    airspeed_fps=82.02, alpha_rad=0.0497, qbar_psf=8.28, lp=-22.63, lr=10.91, lda=57.11, ldr=-0.784,
    np=-0.115, nr=-1.228, nb=19.58, yb=-0.777, nda=2.187, ndr=-10.86, za=-4.48, ma=-99.96, mq=-5.30,
    mde=-15.76, xa=8.76, xdt=31.07,
)  # fmt: skip


def test_feed_forwards_cancel_the_moments_of_a_steady_turn() -> None:
    at, placed = AEROSONDE, gains(AEROSONDE)
    rolling = at.lr + at.lda * placed.aileron_r_forward + at.ldr * placed.rudder_r_forward
    yawing = at.nr + at.nda * placed.aileron_r_forward + at.ndr * placed.rudder_r_forward
    assert rolling == pytest.approx(0.0, abs=1e-9)
    assert yawing == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (replace(AEROSONDE, lda=0.0), "aileron has no authority"),
        (replace(AEROSONDE, mde=3.0), "elevator acts the wrong way"),
        (replace(AEROSONDE, ndr=math.nan), "rudder has no authority"),
        (replace(AEROSONDE, xdt=-1.0), "throttle acts the wrong way"),
        (replace(AEROSONDE, ma=200.0), "unstable in pitch"),
    ],
)
def test_an_aircraft_that_cannot_be_held_is_refused(broken: Derivatives, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        gains(broken)


def test_the_throttle_s_effect_is_that_of_settled_propellers() -> None:
    """The DHC6's two: the thrust found after 60 s at either side of the trim, the aircraft held where it is."""
    thrusts_lbf = []
    for change in (-0.02, 0.02):
        fdm = trimmed(model_files("DHC6"), 55.0)
        for path in INTEGRATORS:
            fdm[path] = 0.0
        for engine in range(2):
            fdm[f"fcs/throttle-cmd-norm[{engine}]"] += change
        for _ in range(60 * 120):
            fdm.run()
        thrusts_lbf.append(fdm["forces/fbx-prop-lbs"])
    gained = (thrusts_lbf[1] - thrusts_lbf[0]) / 0.04 / fdm["inertia/mass-slugs"]
    assert linearised(trimmed(model_files("DHC6"), 55.0)).xdt == pytest.approx(gained, rel=0.01)


def test_gains_follow_from_the_model_at_cruise() -> None:
    frame = airframe("aerosonde")
    assert frame.gains == gains(linearised(trimmed(model_files("aerosonde"), frame.cruise_mps))).rounded(5)
    assert frame.gains.elevator_q == pytest.approx(0.724, rel=0.01)


def model_file(folder: Path, text: str) -> Path:
    home = folder / "toy"
    home.mkdir()
    (home / "engine.xml").write_text("<engine/>", encoding="utf-8")
    path = home / "toy.xml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("apart", [False, True])
def test_injection_puts_the_system_first_and_drives_every_throttle(tmp_path: Path, apart: bool) -> None:
    """A model writes no files of its own: its output goes. Its engines may stand in a file of their own."""
    engines = "<propulsion><engine/><engine/></propulsion>"
    given = '<propulsion file="engines"/>' if apart else engines
    path = model_file(tmp_path, f"<fdm_config><output/><input/><system/>{given}</fdm_config>")
    (path.parent / "engines.xml").write_text(engines)
    with with_autopilot(path) as folder:
        root = ElementTree.parse(folder / "toy" / "toy.xml").getroot()
        assert (folder / "toy" / "engine.xml").read_text(encoding="utf-8") == "<engine/>"
    assert root[0].get("name") == "wayproof-autopilot"
    assert root.find("propulsion/engine") is not None
    outputs = [node.text for node in root[0].iter("output")]
    assert [outputs.count(f"fcs/throttle-cmd-norm{each}") for each in ("", "[1]")] == [1, 1]
    assert (root.find("output"), root.find("input")) == (None, None)
    assert not folder.exists()
    assert "wayproof" not in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(("text", "message"), [("<fdm_config>", "not well-formed"), ("<a/>", "root element is <a>")])
def test_injection_refuses_what_is_no_model(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message), with_autopilot(model_file(tmp_path, text)):
        pass
