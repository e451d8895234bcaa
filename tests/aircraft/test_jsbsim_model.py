"""JSBSim aircraft: start, air, faults, determinism, silence."""

import gc
import math
import weakref
from pathlib import Path

import jsbsim
import numpy as np
import pytest

from aircraft.airframes import AircraftError, airframe
from aircraft.frames import LocalPlane
from aircraft.interface import FOOT_M, AircraftState
from aircraft.jsbsim_model import JsbsimModel
from aircraft.start import Atmosphere, StartConditions
from harness.scenario.environment import Turbulence
from tests.processes import python

PLANE = LocalPlane(47.0, 8.0)
SECOND = 60
VERIFIED = ("aerosonde", "c172p", "T38")
WINDS = [(0.0, 0.0), (7.0, -5.0), (-12.0, 3.0)]


def model_of(
    name: str, course: float = 1.0, atmosphere: Atmosphere | None = None, at: tuple[float, float] = (60e3, 70e3)
) -> JsbsimModel:
    frame = airframe(name)
    return JsbsimModel(frame, StartConditions(*at, 300.0, course, frame.cruise_mps), PLANE, atmosphere)


def test_a_model_that_is_not_used_any_more_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The thread that loaded it does not hold it."""

    class Watched(jsbsim.FGFDMExec):
        """Of JSBSim's own it cannot be told whether it is gone."""

    monkeypatch.setattr(jsbsim, "FGFDMExec", Watched)
    model = model_of("aerosonde")
    gone = weakref.ref(model._fdm)
    assert isinstance(gone(), Watched)
    del model
    gc.collect()
    assert gone() is None


def test_a_model_loads_where_jsbsim_lies_outside_the_site_folders(monkeypatch: pytest.MonkeyPatch) -> None:
    """As after pip install --target, and in an environment that uv lays over another."""
    monkeypatch.setattr("site.getsitepackages", list)
    assert Path(model_of("aerosonde")._fdm.get_root_dir()) == Path(jsbsim.__file__).parent


@pytest.mark.flights
def test_threads_that_end_fly_too() -> None:
    """They have loggers of their own, of which JSBSim lets go after them, and compile what is to be compiled."""
    code = (
        "import sys\n"
        "from concurrent.futures import ThreadPoolExecutor\n"
        "from harness.run.scenario_flight import make_loop\n"
        "from wayproof import load_scenario\n"
        "sys.setswitchinterval(1e-6)\n"
        "scenario = load_scenario('aerosonde_forest')\n"
        "for _ in range(3):\n"
        "    with ThreadPoolExecutor(8) as threads:\n"
        "        loops = list(threads.map(make_loop, [scenario] * 8))\n"
        "    assert len({loop.model.state() for loop in loops}) == 1\n"
        "assert sys.stdout is sys.__stdout__\n"
    )
    run = python("-c", code)
    assert (run.returncode, run.stdout + run.stderr) == (0, ""), run.stderr


def test_a_forked_process_loads_models_too() -> None:
    """There, no thread but the one that forked goes on."""
    code = (
        "import os\n"
        "from tests.aircraft.test_jsbsim_model import model_of\n"
        "model_of('aerosonde')\n"
        "child = os.fork()\n"
        "if not child:\n"
        "    model_of('aerosonde')\n"
        "    os._exit(7)\n"
        "assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7\n"
    )
    python("-c", code, check=True)


@pytest.mark.parametrize("wind", WINDS)
@pytest.mark.parametrize("name", VERIFIED)
def test_starts_trimmed_without_transient(name: str, wind: tuple[float, float]) -> None:
    """Before this the wind kicked the aircraft by centimetres a second; 2 mm is what separates the two.

    JSBSim trims a jet less finely: the T-38 climbs by centimetres before the loops have it.
    """
    model = model_of(name, atmosphere=Atmosphere(*wind))
    cruise = airframe(name).cruise_mps
    first = model.state()
    assert (first.east_m, first.north_m, first.up_m) == pytest.approx((60e3, 70e3, 300.0), abs=1e-4)
    assert first.course_rad == pytest.approx(1.0, abs=2e-4)
    assert first.airspeed_mps == pytest.approx(cruise, abs=1e-6)
    air_east = first.airspeed_mps * math.sin(first.heading_rad)
    assert first.velocity_east_mps - wind[0] == pytest.approx(air_east, abs=0.1)
    for _ in range(5 * SECOND):
        model.advance(1)
        state = model.state()
        assert abs(state.up_m - 300.0) < (0.03 if name == "T38" else 0.002)
        assert abs(state.airspeed_mps - cruise) < 0.005
        assert abs(state.load_factor - first.load_factor) < 0.001
    assert state.time_s == 5.0


@pytest.mark.parametrize("wind", WINDS)
def test_a_piston_engine_is_leaned_high_up(wind: tuple[float, float]) -> None:
    """A Cessna 172P climbs to 13,000 ft; full rich its engine died at 2,750 m. Leaned by the ISA."""
    start = StartConditions(0.0, 0.0, 3900.0, 1.0, 50.0)
    model = JsbsimModel(airframe("c172p"), start, LocalPlane(45.0, 0.0), Atmosphere(*wind))
    model.advance(20 * SECOND)
    state = model.state()
    assert (state.up_m, state.airspeed_mps) == pytest.approx((3900.0, 50.0), abs=0.05)
    for _ in range(100):  # 4 m/s down
        model.command(0.0, 900.0, 50.0)
        model.advance(SECOND)
    share = ((1 - 2.25577e-5 * model.state().up_m) / (1 - 2.25577e-5 * 1000)) ** 5.25588
    assert model._fdm["fcs/mixture-cmd-norm"] == pytest.approx(share, abs=0.003)
    assert model.state().up_m < 3600.0


def test_wind_keeps_its_direction_in_the_plane() -> None:
    """At 70 degrees true north leans by half a degree over the 20 km of this flight; the wind must not."""
    start = StartConditions(50e3, 0.0, 300.0, math.pi / 2, 25.0)
    model = JsbsimModel(airframe("aerosonde"), start, LocalPlane(70.0, 8.0), Atmosphere(wind_east_mps=10.0))
    for _ in range(600):
        model.command(0.0, 300.0, 25.0)
        model.advance(SECOND)
        state = model.state()
    horizontal = state.airspeed_mps * math.cos(state.velocity_up_mps / state.airspeed_mps)
    assert state.velocity_east_mps - horizontal * math.sin(state.heading_rad) == pytest.approx(10.0, abs=0.02)
    assert state.velocity_north_mps - horizontal * math.cos(state.heading_rad) == pytest.approx(0.0, abs=0.02)


def test_position_is_the_integral_of_velocity() -> None:
    model = model_of("aerosonde", course=0.7, atmosphere=Atmosphere(4.0, -3.0))
    before = model.state()
    east = north = 0.0
    for _ in range(20 * SECOND):
        model.advance(1)
        state = model.state()
        east += state.velocity_east_mps / SECOND
        north += state.velocity_north_mps / SECOND
    assert state.east_m - before.east_m == pytest.approx(east, abs=0.1)
    assert state.north_m - before.north_m == pytest.approx(north, abs=0.1)


@pytest.mark.parametrize("name", VERIFIED)
def test_inner_loops_hold_what_they_are_told(name: str) -> None:
    model = model_of(name)
    cruise = airframe(name).cruise_mps
    model.command(0.5, 310.0, 1.05 * cruise)
    model.advance(40 * SECOND)
    state = model.state()
    assert state.roll_rad == pytest.approx(0.5, abs=0.01)
    assert state.up_m == pytest.approx(310.0, abs=0.004 * cruise)
    assert state.airspeed_mps == pytest.approx(1.05 * cruise, abs=0.3)
    assert state.load_factor == pytest.approx(1.0 / math.cos(0.5), rel=0.02)


def test_gusts_are_no_mean_wind() -> None:
    """Their mean over 1,000 s is within 3 standard errors of 0, by the lengths of MIL-F-8785C at 100 m (328 ft)."""
    air = Atmosphere(2.0, -3.0, Turbulence().model, "moderate", seed=5)
    model = JsbsimModel(airframe("ultrastick25e"), StartConditions(0.0, 0.0, 100.0, 0.0, 17.0), PLANE, air)
    east_mps = []
    for _ in range(1000):
        model.command(0.0, 100.0, 17.0)
        model.advance(SECOND)
        east_mps.append(FOOT_M * model._fdm["atmosphere/turb-east-fps"])
    shape = 0.177 + 0.000823 * 328.0
    sigma_mps, length_m = 0.1 * 50.0 * FOOT_M / shape**0.4, 100.0 / shape**1.2
    assert abs(np.mean(east_mps)) < 3.0 * sigma_mps * math.sqrt(2.0 * length_m / (17.0 * 1000.0))


@pytest.mark.parametrize("turbulence", ["tustin", "milspec"])
def test_turbulence_is_seeded_and_grows_with_intensity(turbulence: str) -> None:
    def rolls(intensity: str, seed: int) -> list[float]:
        model = model_of("aerosonde", atmosphere=Atmosphere(0.0, 0.0, turbulence, intensity, seed))
        flown = []
        for _ in range(600):
            model.advance(SECOND // 20)
            flown.append(model.state().roll_rad)
        return flown

    light, severe = rolls("light", 7), rolls("severe", 7)
    assert rolls("severe", 7) == severe
    assert rolls("severe", 8) != severe
    assert 1e-4 < np.std(light) < np.std(severe)


def test_faults_name_the_cause() -> None:
    model = model_of("aerosonde")
    assert model.fault() is None
    model.command(math.nan, 300.0, 25.0)
    model.advance(SECOND // 10)
    assert model.fault() == "the state is not finite"

    sinking = model_of("aerosonde")
    sinking.command(0.0, -500.0, 25.0)
    for _ in range(20 * 400):
        sinking.advance(SECOND // 20)
        if sinking.fault():
            break
    assert (sinking.fault() or "").startswith("the aircraft is at the ground (")

    rolling = model_of("aerosonde")
    rolling.engage(False)
    rolling._fdm["fcs/aileron-cmd-norm"] = 1.0
    rolling.advance(SECOND)
    assert (rolling.fault() or "").startswith("rolled over: roll ")

    stalling = model_of("ultrastick25e")
    stalling.engage(False)
    stalling._fdm["fcs/elevator-cmd-norm"] = -1.0
    for _ in range(20 * 20):
        stalling.advance(SECOND // 20)
        if stalling.fault():
            break
    assert (stalling.fault() or "").startswith("stalled: ")


@pytest.mark.parametrize(
    ("name", "start", "atmosphere", "message"),
    [
        ("nope", StartConditions(0, 0, 300, 0, 25), None, "unknown aircraft 'nope'"),
        ("aerosonde", StartConditions(0, 0, 300, 0, 50), None, "cannot hold 50 m/s"),
        ("aerosonde", StartConditions(0, 0, 300, 0, 25), Atmosphere(30.0, 0.0), "cannot be held at 25 m/s"),
        ("aerosonde", StartConditions(0, 0, 9000, 0, 25), None, "cannot be trimmed for level flight at 25 m/s"),
    ],
)  # fmt: skip
def test_what_cannot_fly_is_refused(
    name: str, start: StartConditions, atmosphere: Atmosphere | None, message: str
) -> None:
    with pytest.raises(AircraftError, match=message):
        JsbsimModel(airframe(name), start, PLANE, atmosphere)


FLIGHT = """
from aircraft.airframes import airframe
from aircraft.frames import LocalPlane
from aircraft.jsbsim_model import JsbsimModel
from aircraft.start import Atmosphere, StartConditions
from harness.scenario.environment import Turbulence
air = Atmosphere(5.0, -2.0, "tustin", "moderate", 3)
model = JsbsimModel(airframe({name!r}), StartConditions(1e3, 2e3, 300.0, 0.3, {airspeed}), LocalPlane(47.0, 8.0), air)
for tick in range(600):
    model.command(0.4 if tick % 200 < 100 else -0.4, 300.0, {airspeed})
    model.advance(3)
open({out!r}, "w").write(" ".join(value.hex() for value in model.state()))
"""


@pytest.mark.flights
@pytest.mark.parametrize("name", VERIFIED)
def test_two_processes_fly_the_same_bits_in_silence(name: str, tmp_path: Path) -> None:
    results = []
    for run in ("first", "second"):
        work, out = tmp_path / f"{run}-work", tmp_path / run
        work.mkdir()
        code = FLIGHT.format(name=name, airspeed=airframe(name).cruise_mps, out=str(out))
        done = python("-c", code, folder=work, check=True)
        assert (done.stdout, done.stderr) == ("", "")
        assert list(work.iterdir()) == []
        results.append(out.read_text(encoding="utf-8"))
    assert results[0] == results[1]
    assert len(results[0].split()) == len(AircraftState._fields)
