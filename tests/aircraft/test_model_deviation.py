"""Aircraft that deviate from their model, and air that depends on the height over ground, held against physics."""

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from aircraft.airframes import airframe
from aircraft.deviation import Deviation, deviate
from aircraft.frames import LocalPlane
from aircraft.jsbsim_loading import load, trim
from aircraft.jsbsim_model import JsbsimModel
from aircraft.model_files import model_files
from aircraft.start import Atmosphere, DrydenGusts, StartConditions, VerticalGusts

READ = ("inertia/weight-lbs", "fcs/elevator-pos-rad", "aero/alpha-deg", "forces/fwx-aero-lbs")
PLANE = LocalPlane(45.0, 0.0)


def trimmed(name: str, airspeed_mps: float, **shares: float) -> dict[str, float]:
    fdm = load(replace(model_files(name), deviation=Deviation(**shares)))
    trim(fdm, name, PLANE, StartConditions(0.0, 0.0, 300.0, 0.0, airspeed_mps), heading_rad=0.0)
    values = {each: fdm[each] for each in (*READ, "inertia/cg-x-in", "fcs/throttle-cmd-norm")}
    values["thrust"] = fdm["forces/fbx-prop-lbs"] + fdm["forces/fbx-external-lbs"]
    fdm["fcs/aileron-cmd-norm"] += 0.1
    rolled = -fdm["moments/l-aero-lbsft"]
    fdm.run()
    return values | {"roll": rolled + fdm["moments/l-aero-lbsft"]}


@pytest.mark.parametrize(("name", "airspeed_mps"), [("aerosonde", 25.0), ("f16", 150.0)])
def test_a_trim_moves_as_physics_has_it(name: str, airspeed_mps: float) -> None:
    nominal = trimmed(name, airspeed_mps)
    # The same moment with a tenth more effect takes the elevator a tenth less far.
    stronger = trimmed(name, airspeed_mps, elevator=0.1)
    assert stronger["fcs/elevator-pos-rad"] == pytest.approx(nominal["fcs/elevator-pos-rad"] / 1.1, rel=1e-3)
    # Thrust is as large as drag, whatever the engine's effect; it takes less throttle.
    more = trimmed(name, airspeed_mps, thrust=0.1)
    assert more["thrust"] == pytest.approx(nominal["thrust"], rel=1e-3)
    assert more["fcs/throttle-cmd-norm"] < nominal["fcs/throttle-cmd-norm"]
    draggy = trimmed(name, airspeed_mps, drag=0.1)
    assert draggy["forces/fwx-aero-lbs"] == pytest.approx(1.1 * nominal["forces/fwx-aero-lbs"], rel=2e-3)
    assert draggy["thrust"] == pytest.approx(1.1 * nominal["thrust"], rel=2e-3)
    aft = trimmed(name, airspeed_mps, centre_of_gravity_m=0.01)
    assert 0.3 < aft["inertia/cg-x-in"] - nominal["inertia/cg-x-in"] <= 0.3938


@pytest.mark.flights
@pytest.mark.parametrize("name", ["aerosonde", "DHC6", "F4N", "J3Cub"])
def test_an_aileron_rolls_by_its_share_more(name: str) -> None:
    """Also where the model names only a left or right aileron, its commands being in a system's file."""
    nominal, more = (trimmed(name, airframe(name).cruise_mps, aileron=share)["roll"] for share in (0.0, 0.3))
    assert more == pytest.approx(1.3 * nominal, rel=1e-3)


def test_mass_and_lift_slope_of_the_book_set_the_angle_of_attack() -> None:
    # CL = 0.23 + 5.61 alpha (Beard and McLain): alpha + 0.23 / 5.61 goes with the weight and against the slope.
    def lift_angle(**shares: float) -> float:
        values = trimmed("aerosonde", 25.0, **shares)
        elevator = 0.13 * values["fcs/elevator-pos-rad"]
        slope = 5.61 * (1.0 + shares.get("lift_slope", 0.0))
        return 0.23 + slope * math.radians(values["aero/alpha-deg"]) + elevator

    assert lift_angle(mass=0.1) == pytest.approx(1.1 * lift_angle(), rel=5e-3)
    assert lift_angle(lift_slope=0.1) == pytest.approx(lift_angle(), rel=5e-3)


def test_a_model_that_does_not_show_what_differs_is_refused() -> None:
    bare = ElementTree.fromstring("<f><mass_balance/><aerodynamics/><fcs>fcs/rudder-cmd-norm</fcs></f>")
    with pytest.raises(ValueError, match=r"effect of its rudder; uncertainty\.rudder: 0 leaves it"):
        deviate(bare, Deviation(rudder=0.1))
    with pytest.raises(ValueError, match="place of the centre of gravity"):
        deviate(bare, Deviation(centre_of_gravity_m=0.1))


def test_wind_and_turbulence_are_those_of_the_height_over_the_true_ground() -> None:
    def start(ground_m: float) -> JsbsimModel:
        air = Atmosphere(5.0, 0.0, measured_at_m=10.0)
        begin = StartConditions(0.0, 0.0, 400.0, 0.0, 25.0)
        return JsbsimModel(airframe("aerosonde"), begin, PLANE, air, ground=lambda _e, _n: ground_m)

    for ground_m in (300.0, 380.0):
        model = start(ground_m)
        height_m = 400.0 - ground_m
        expected = 5.0 * math.log(height_m / 0.04572) / math.log(10.0 / 0.04572)
        model.state()
        model.command(0.0, 400.0, 25.0)
        model.advance(1)
        state = model.state()
        drift = state.velocity_east_mps - state.airspeed_mps * math.sin(state.heading_rad)
        assert drift == pytest.approx(expected, abs=0.05)
        assert model._fdm["position/h-agl-ft"] * 0.3048 == pytest.approx(height_m, abs=0.5)


def test_vertical_gusts_rise_and_sink_in_turn_as_one_minus_cosine() -> None:
    gusts = VerticalGusts(speed_mps=3.0, duration_s=4.0, every_s=10.0, start_s=5.0)
    time_s = np.array([0.0, 5.0, 9.0, 19.5, 7.0, 6.0, 17.0])
    assert gusts.up_mps(time_s) == pytest.approx([0.0, 0.0, 0.0, 0.0, 3.0, 1.5, -3.0])
    air = Atmosphere(vertical_gusts=VerticalGusts(2.0, 0.5, 100.0))
    model = JsbsimModel(airframe("aerosonde"), StartConditions(0.0, 0.0, 300.0, 0.0, 25.0), PLANE, air)
    loads = []
    for _ in range(30):
        model.advance(2)
        loads.append(model.state().load_factor)
    # At most rho V CLa S w / 2 m g, less what the aircraft gives way, nose down and upwards.
    assert 1.2 < max(loads) < 1.0 + 1.19 * 25.0 * 5.61 * 0.55 * 2.0 / (2 * 11.0 * 9.81)


@pytest.mark.parametrize("height_m", [30.0, 150.0])
def test_turbulence_over_ground_has_the_sizes_and_spectra_of_mil_f_8785c(height_m: float) -> None:
    # Low altitude, moderate: sigma_w = 0.1 W20, W20 = 50 ft/s; lengths and sigma_u by height in feet (figure 10).
    shape = 0.177 + 0.000823 * (height_m / 0.3048)
    sigma_w, sigma_u = 0.1 * 50 * 0.3048, 0.1 * 50 * 0.3048 / shape**0.4
    length_u, length_w = height_m / shape**1.2, height_m
    gusts, airspeed, seconds = DrydenGusts("moderate", 4), 25.0, 1.0 / 60.0
    series = np.array([gusts.step(height_m, airspeed, seconds) for _ in range(240_000)])
    assert series.std(axis=0) == pytest.approx([sigma_u, sigma_u, sigma_w], rel=0.06)
    # Power in bands against Dryden's spectra (one-sided, rad/s), integrated by hand over each band.
    power = np.abs(np.fft.rfft(series, axis=0)) ** 2 * 2.0 / len(series) ** 2
    omega = 2.0 * math.pi * np.fft.rfftfreq(len(series), seconds)
    fine = np.linspace(0.0, 12.0, 12_001)

    def ahead(w: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        t = length_u / airspeed
        return np.asarray(sigma_u**2 * 2.0 * t / math.pi / (1.0 + (t * w) ** 2))

    def down(w: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        t = length_w / airspeed
        return np.asarray(sigma_w**2 * t / math.pi * (1.0 + 3.0 * (t * w) ** 2) / (1.0 + (t * w) ** 2) ** 2)

    for axis, spectrum in ((0, ahead), (2, down)):
        for low, high in ((0.1, 0.5), (0.5, 2.0), (2.0, 8.0)):
            expected = float(spectrum(fine[(fine >= low) & (fine < high)]).sum() * (fine[1] - fine[0]))
            found = float(power[(omega >= low) & (omega < high), axis].sum())
            assert found == pytest.approx(expected, rel=0.2), (axis, low)


def test_turbulence_is_that_of_the_height_over_the_true_ground() -> None:
    def spread(ground_m: float) -> float:
        air = Atmosphere(turbulence="tustin", intensity="moderate", seed=3)
        begin = StartConditions(0.0, 0.0, 400.0, 0.0, 25.0)
        model = JsbsimModel(airframe("aerosonde"), begin, PLANE, air, ground=lambda _e, _n: ground_m)
        winds = []
        for _ in range(1200):
            model.state()
            model.command(0.0, 400.0, 25.0)
            model.advance(6)
            winds.append(model._fdm["atmosphere/total-wind-north-fps"] * 0.3048)
        return float(np.std(winds))

    # sigma_u at 150 and 30 m over ground: 1.524 / (0.177 + 0.000823 h)^0.4 = 1.88 and 2.58 m/s
    assert spread(250.0) == pytest.approx(1.88, rel=0.25)
    assert spread(370.0) == pytest.approx(2.58, rel=0.2)
