"""The shipped scenarios on JSBSim, held against what a user is promised and against an independent judge."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.run.scenario_flight import fly_to_folder
from harness.run_files.run_folder import Run, load_run
from harness.scenario.shipped import scenario_path
from tests.longer import longer
from tests.scenarios import scenario_of
from wayproof import Scenario, load_scenario

TOOLS = Path(__file__).parents[2].parent / "shared" / "tools"
OPTIMUM_M = 94_318.0  # shortest path through paper_circles at its clearance, for one who knows the world
needs_the_judge = pytest.mark.skipif(not TOOLS.is_dir(), reason="the independent judge is not here")

Flown = Callable[..., Run]


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """Flies a shipped scenario with some keys replaced; each only once."""
    runs: dict[tuple[str, ...], Run] = {}

    def fly(name: str, *overrides: tuple[str, str]) -> Run:
        if (case := (name, *(f"{key}={value}" for key, value in overrides))) not in runs:
            folder = tmp_path_factory.mktemp(name) / "run"
            fly_to_folder(load_scenario(scenario_path(name), overrides), folder, recording=False)
            runs[case] = load_run(folder)
        return runs[case]

    return fly


def judged(run: Run) -> list[str]:
    judge = [sys.executable, str(TOOLS / "referee.py"), "--json", str(run.folder)]
    said = subprocess.run(judge, capture_output=True, text=True, timeout=120, check=False)
    faults: list[str] = json.loads(said.stdout)["faults"]
    return faults


def optimum_m(scenario: Scenario, folder: Path) -> float:
    """Shortest path that keeps the clearance, by the independent exact method."""
    circles = [o.circle for o in scenario.obstacles if o.circle]
    assert len(circles) == len(scenario.obstacles)
    mission, round_ones = scenario.mission, [[*circle.center_m, circle.radius_m] for circle in circles]
    world = {"name": scenario.name, "bounds": scenario.area.bounds_m, "circles": round_ones, "polygons": []}
    world |= {"start": mission.start_m, "goal": mission.goal_m}
    (folder / "world.json").write_text(json.dumps(world))
    solve = [sys.executable, str(TOOLS / "optimal.py"), str(folder / "world.json")]
    solve += ["--clearance", str(scenario.planner.clearance_m)]
    said = subprocess.run(solve, capture_output=True, text=True, timeout=120, check=True)
    length: float = json.loads(said.stdout)["length"]
    return length


@pytest.mark.flights
def test_the_papers_world_is_flown_as_promised(flown: Flown) -> None:
    metrics = flown("paper_circles").metrics
    assert metrics["outcome"] == "reached"
    assert metrics["clearance_violation_s"] == 0.0
    assert metrics["min_clearance_m"] >= 300.0
    assert metrics["trackable"] is True
    assert metrics["cross_track_m"]["p95"] <= 0.3
    assert metrics["cross_track_m"]["max"] <= 1.0
    assert metrics["altitude_error_m"]["p95"] <= 0.3
    assert metrics["flown_length_m"] <= 1.03 * OPTIMUM_M


@needs_the_judge
@pytest.mark.flights
def test_the_papers_world_is_near_its_optimum(flown: Flown, tmp_path: Path) -> None:
    run = flown("paper_circles")
    optimum = optimum_m(scenario_of(run.scenario_yaml), tmp_path)
    assert optimum == pytest.approx(OPTIMUM_M, abs=1.0)
    assert run.metrics["flown_length_m"] <= 1.03 * optimum


@needs_the_judge
@pytest.mark.parametrize(
    "name",
    [
        "aerosonde_forest",
        *longer(["paper_circles", "polygon_town", "one_of_everything", "jacksboro_terrain"]),
    ],
)
def test_the_judge_finds_no_fault(name: str, flown: Flown) -> None:
    assert judged(flown(name)) == []


@pytest.mark.parametrize(
    ("name", "share_of_clearance", "cross_track_p95_m"),
    [
        ("aerosonde_forest", 1.0, 0.3),
        # In polygon_town there are corners that the map blurs, and gusts.
        *longer([("polygon_town", 1.0, 0.5), ("one_of_everything", 1.0, 0.5), ("jacksboro_terrain", 1.0, 0.3)]),
    ],
)
def test_is_reached_with_the_clearance(
    name: str, share_of_clearance: float, cross_track_p95_m: float, flown: Flown
) -> None:
    run = flown(name)
    wanted_m = scenario_of(run.scenario_yaml).planner.clearance_m
    assert run.metrics["outcome"] == "reached", run.metrics["reason"]
    assert run.metrics["min_clearance_m"] >= share_of_clearance * wanted_m
    assert run.metrics["cross_track_m"]["p95"] <= cross_track_p95_m
    assert run.metrics["trackable"] is True


@pytest.mark.flights
def test_real_terrain_is_never_touched(flown: Flown) -> None:
    run = flown("jacksboro_terrain")
    assert run.metrics["min_altitude_above_ground_m"] > 10.0
    (source,) = run.manifest["sources"]
    assert source["path"].endswith("jacksboro_fault_dem.npz")


@pytest.mark.parametrize("side_m", [100_000, 200_000])
def test_a_forest_is_flown_through_as_well_where_it_lies_in_a_large_area(flown: Flown, side_m: int) -> None:
    own = flown("aerosonde_forest").metrics
    large = flown("aerosonde_forest", ("area.bounds_m", f"[0, 0, {side_m}, {side_m}]")).metrics
    assert large["outcome"] == "reached"
    assert large["clearance_violation_s"] == 0.0
    assert large["flown_length_m"] < 1.02 * own["flown_length_m"]
