"""An ordinary day: wind, light turbulence, satellite navigation. Planning must cost no long ways there."""

import json
import math
from pathlib import Path as FilePath

import numpy as np
import pyarrow.parquet as pq
import pytest

import wayproof
from aircraft.airframes import airframe
from aircraft.envelope import performance
from aircraft.start import Atmosphere
from harness.bench.tracking import course, fly_course
from tests.closed_loop.test_hard_conditions import hard
from wayproof import Mission, Path, Plan, PlanRequest, PlanStatus

CAMPAIGNS = FilePath(__file__).parents[2] / "scenarios" / "campaigns"
CTU = FilePath(__file__).parents[3] / "shared" / "worlds" / "ctu_dubins" / "ctu-dubins-dense-14.json"


class Hold:
    """Flies into a full turn at the radius of holds, at once."""

    def __init__(self, mission: Mission) -> None:
        self.radius_m = mission.hold_radius_m

    def plan(self, request: PlanRequest) -> Plan:
        if request.flown is not None:
            return Plan(PlanStatus.KEPT, "holding")
        (east, north), (along_east, along_north) = request.position_m, request.direction
        straight = (east, north, along_east, along_north, 0.0, 300.0)
        turn = (
            *(east + 300.0 * along_east, north + 300.0 * along_north, along_east, along_north),
            *(1.0 / self.radius_m, math.tau * self.radius_m),
        )
        path = Path(np.array([straight, turn]), loiter=True)
        return Plan(PlanStatus.FOUND, "into the hold", np.array([request.position_m, turn[:2]]), path)


@pytest.mark.flights
@pytest.mark.parametrize("turbulence", [None, {"model": "tustin", "intensity": "moderate"}])
@pytest.mark.parametrize("wind_mps", [8.0, 12.0])
def test_a_hold_is_kept_within_a_metre(wind_mps: float, turbulence: dict[str, str] | None) -> None:
    air = {"wind": {"speed_mps": wind_mps, "from_deg": 300}, "turbulence": turbulence}
    keys = {"obstacles": [], "environment": air, "mission.time_limit_s": 240}
    scenario = wayproof.load_scenario("aerosonde_forest").with_(keys)
    holds: list[Hold] = []

    def make(mission: Mission) -> Hold:
        holds.append(Hold(mission))
        return holds[-1]

    track = wayproof.fly(scenario, planner=make).track.to_pandas()
    assert 100.0 < holds[0].radius_m < 210.0
    assert track.cross_track_m[track.time_s > 30.0].abs().max() < 1.0


@pytest.mark.flights
@pytest.mark.parametrize("intensity", [None, "moderate"])
@pytest.mark.parametrize(("name", "airspeed_mps", "wind_mps"), [("aerosonde", 25.0, 8.0), ("c172p", 50.0, 15.0)])
def test_turns_with_room_to_roll_are_kept_within_what_planning_allows_for(
    name: str, airspeed_mps: float, wind_mps: float, intensity: str | None
) -> None:
    frame = airframe(name)
    planned = performance(frame, airspeed_mps, wind_mps, intensity)
    air = Atmosphere(wind_mps, 0.0, "tustin" if intensity else None, intensity, 1)
    flown = fly_course(frame, airspeed_mps, air, course(1, planned.spaced_radius_m))
    assert flown.cross_track_max_m <= planned.tracking_error_m
    assert flown.bank_saturation == 0.0


@pytest.mark.flights
@pytest.mark.skipif(not CTU.exists(), reason="the shared worlds are not here")
def test_a_dense_public_world_in_wind_is_flown_with_the_turns_that_wind_allows() -> None:
    world = json.loads(CTU.read_text())
    run = wayproof.fly(hard(world, {"environment": {"wind": {"speed_mps": 8, "from_deg": 300}}}))
    assert run.metrics["outcome"] == "reached"
    assert run.metrics["clearance_violation_s"] == 0.0
    assert run.metrics["cross_track_m"]["max"] < 1.0
    assert run.metrics["flown_length_m"] < 1.3 * world["optimum_m"]  # 1.67 with turns for 30 degrees of bank


@pytest.mark.flights
def test_a_dozen_of_its_windiest_flights_are_hardly_longer_than_the_shortest_way(tmp_path: FilePath) -> None:
    shipped = (CAMPAIGNS / "ordinary_day.yaml").read_text()
    for old, new in (
        ("planners: [rolling_window, vfh_plus, tangent_bug]", "planners: [rolling_window]"),
        ("{uniform: [0, 8]}", "{uniform: [6, 8]}"),
        ("draws: 100", "draws: 12"),
    ):
        assert old in shipped
        shipped = shipped.replace(old, new)
    (tmp_path / "windy.yaml").write_text(shipped)
    wayproof.sweep(tmp_path / "windy.yaml", out=tmp_path / "out")
    runs = pq.read_table(tmp_path / "out" / "results.parquet").to_pandas()
    assert list(runs.outcome) == ["reached"] * 12
    assert runs.min_clearance_m.min() >= 50.0
    assert runs.length_ratio.mean() <= 1.05
    assert runs.length_ratio.max() <= 1.3
