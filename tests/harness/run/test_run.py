"""From a scenario to the parts of its flight."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aircraft.interface import FlightModel
from harness.run import scenario_flight as run
from harness.run.scenario_flight import atmosphere, fly_to_folder, make_loop
from harness.run_files.run_folder import load_run
from harness.scenario.performance import start_conditions
from harness.scenario.shipped import scenario_path
from wayproof import AircraftError, Scenario, load_scenario


def shipped(name: str, **overrides: str) -> Scenario:
    return load_scenario(scenario_path(name), [(key.replace("__", "."), v) for key, v in overrides.items()])


@pytest.mark.parametrize(
    ("from_deg", "east", "north"), [(0.0, 0.0, -6.0), (90.0, -6.0, 0.0), (180.0, 0.0, 6.0), (270.0, 6.0, 0.0)]
)
def test_wind_comes_from_where_the_scenario_says(from_deg: float, east: float, north: float) -> None:
    air = atmosphere(shipped("polygon_town", environment__wind__from_deg=str(from_deg)))
    assert (air.wind_east_mps, air.wind_north_mps) == pytest.approx((east, north), abs=1e-9)
    first, again, other = (atmosphere(shipped("polygon_town", seed=seed)).seed for seed in ("1", "1", "2"))
    assert first == again != other, "turbulence is that of the seed"


def test_flight_starts_as_the_scenario_says() -> None:
    start = start_conditions(shipped("one_of_everything"))
    assert (start.east_m, start.north_m, start.altitude_m, start.airspeed_mps) == (2000, 6000, 400, 26)
    assert math.degrees(start.course_rad) == pytest.approx(80.0)
    model = make_loop(shipped("one_of_everything")).model
    assert isinstance(model.state().time_s, float)
    assert math.degrees(model.state().course_rad) == pytest.approx(80.0, abs=0.1)
    assert model.state().up_m == pytest.approx(400.0, abs=0.1)
    assert model.state().airspeed_mps == pytest.approx(26.0, abs=0.1)


def fly_for(seconds: float, folder: Path, *, recording: bool = False, **overrides: str) -> dict[str, Any]:
    scenario = shipped("aerosonde_forest", mission__time_limit_s=str(seconds), **overrides)
    return fly_to_folder(scenario, folder, recording)


def test_the_folder_holds_the_run_that_is_returned(tmp_path: Path) -> None:
    metrics = fly_for(30.0, tmp_path / "run", recording=True)
    run_read = load_run(tmp_path / "run")
    assert run_read.metrics == metrics
    assert metrics["outcome"] == "timeout"
    files = "events.csv flight.rrd manifest.json metrics.json plans.parquet scenario.yaml track.parquet"
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == files.split()
    # One row a tenth of a second, both ends included.
    assert run_read.track.time_s == pytest.approx(np.arange(301) / 10.0)
    assert run_read.track.plan_index[0] == -1 or run_read.plans[0].time_s == 0.0


def test_progress_is_told(tmp_path: Path) -> None:
    told: list[tuple[float, float, str]] = []
    scenario = shipped("aerosonde_forest", mission__time_limit_s="12")
    fly_to_folder(scenario, tmp_path / "run", False, lambda *report: told.append(report))
    assert [time_s for time_s, _, _ in told] == [0.0, 5.0, 10.0, 12.0]
    assert [word for _, _, word in told][-2:] == ["following", "timeout"]
    assert all(later[1] < earlier[1] for earlier, later in pairwise(told))
    assert not (tmp_path / "run" / "flight.rrd").exists()


def test_an_aircraft_that_is_not_made_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> FlightModel:
        raise AircraftError("aerosonde cannot be trimmed")

    monkeypatch.setattr(run, "jsbsim_aircraft", refuse)
    with pytest.raises(AircraftError, match="cannot be trimmed"):
        fly_for(5.0, tmp_path / "run")
    assert list(tmp_path.iterdir()) == []
