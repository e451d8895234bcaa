"""Own models of small aircraft, against figures published with or computed apart from them."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from aircraft.frames import LocalPlane
from aircraft.jsbsim_loading import load, trim
from aircraft.model_files import model_files
from aircraft.start import StartConditions

FIGURES = Path(__file__).parents[2].parent / "shared" / "flown" / "ultrastick25e.json"
needs_figures = pytest.mark.skipif(not FIGURES.is_file(), reason="no shared/flown beside the checkout")
STEP_RATE_HZ = 200


def trimmed(airspeed_mps: float) -> Any:
    fdm = load(model_files("ultrastick25e"), STEP_RATE_HZ)
    start = StartConditions(0.0, 0.0, 309.0, 0.0, airspeed_mps)
    trim(fdm, "ultrastick25e", LocalPlane(45.0, 0.0), start, 0.0)
    return fdm


@needs_figures
def test_ultrastick25e_trims_as_another_model_from_the_same_figures() -> None:
    for row in json.loads(FIGURES.read_text())["checks"]["level_trim"]:
        fdm = trimmed(row["tas_mps"])
        assert math.degrees(fdm["aero/alpha-rad"]) == pytest.approx(row["alpha_deg"], abs=0.002)
        assert math.degrees(fdm["fcs/elevator-pos-rad"]) == pytest.approx(row["elevator_deg"], abs=0.002)
        assert fdm["motor/thrust-lbs"] * 4.4482216 == pytest.approx(row["thrust_N"], abs=0.002)
        assert fdm["fcs/throttle-cmd-norm"] == pytest.approx(row["throttle_by_motor_polynomials"], abs=0.01)


@needs_figures
@pytest.mark.parametrize(
    ("steps", "control", "degrees"),
    [
        ("aileron_right_minus5_left_plus5_deg", "aileron", 5.0),
        ("elevator_plus1_deg", "elevator", 1.0),
        ("rudder_plus5_deg", "rudder", 5.0),
    ],
)
def test_ultrastick25e_answers_a_step_as_another_model(steps: str, control: str, degrees: float) -> None:
    """Within 2 % of the largest figure of the column: the other model has another integrator and a constant thrust."""
    fdm, done = trimmed(17.34), 0
    fdm[f"fcs/{control}-cmd-norm"] += degrees / 25.0
    rows = json.loads(FIGURES.read_text())["checks"]["steps_from_trim_at_17_34_mps"][steps]
    for seconds in ("0.2", "0.5", "1.0"):
        while done < round(float(seconds) * STEP_RATE_HZ):
            fdm.run()
            done += 1
        for name, path in (
            ("p_degps", "velocities/p-rad_sec"),
            ("q_degps", "velocities/q-rad_sec"),
            ("r_degps", "velocities/r-rad_sec"),
            ("roll_deg", "attitude/phi-rad"),
            ("alpha_deg", "aero/alpha-rad"),
        ):
            largest = max(abs(rows[each][name]) for each in ("0.2", "0.5", "1.0"))
            near = pytest.approx(rows[seconds][name], abs=max(0.02 * largest, 0.15))
            assert math.degrees(fdm[path]) == near


def test_x8_trims_where_its_authors_have_it() -> None:
    """K. Gryte's simulator of the same coefficients: 18 m/s at sea level, elevator 0.0370 rad, throttle 0.1219."""
    fdm = load(model_files("x8"))
    trim(fdm, "x8", LocalPlane(45.0, 0.0), StartConditions(0.0, 0.0, 3.0, 0.0, 18.0), 0.0)
    assert fdm["aero/alpha-rad"] == pytest.approx(0.0308, abs=2e-4)
    assert fdm["fcs/elevator-pos-rad"] == pytest.approx(0.0370, abs=2e-4)
    assert fdm["fcs/throttle-cmd-norm"] == pytest.approx(0.1219, abs=2e-4)


def test_elevons_mix_pitch_and_roll() -> None:
    fdm = load(model_files("x8"))
    fdm.run_ic()
    fdm["fcs/elevator-cmd-norm"], fdm["fcs/aileron-cmd-norm"] = 0.5, 0.25
    fdm.run()
    left, right = fdm["fcs/left-elevon-norm"], fdm["fcs/right-elevon-norm"]
    assert (left, right) == pytest.approx((0.75, 0.25))
    assert math.degrees(fdm["fcs/elevator-pos-rad"]) == pytest.approx(15.0, abs=0.01)
    assert math.degrees(fdm["fcs/left-aileron-pos-rad"]) == pytest.approx(7.5, abs=0.01)
