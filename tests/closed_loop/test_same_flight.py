"""Same scenario and seed, same track: in any process, and from the run folder's own scenario."""

import json
from pathlib import Path
from typing import Any

import pytest

from harness.flight.closed_loop import ClosedLoop, fly
from harness.run.scenario_flight import fly_to_folder, make_loop
from harness.scenario.shipped import scenario_path
from planner.rolling_window.planner import RollingWindow
from tests.closed_loop.small import small_world
from tests.longer import longer
from tests.point_mass import PointMass
from tests.processes import python
from wayproof import PlanRequest, load_scenario

ROOT = Path(__file__).parents[2]


def digest_of(folder: Path, scenario: str, *options: str, hash_seed: int = 0, status: int = 0) -> str:
    words = ("-m", "harness", "fly", scenario, "--out", str(folder), "--quiet", *options)
    run = python(*words, folder=folder.parent, environment={"PYTHONHASHSEED": str(hash_seed)})
    assert run.returncode == status, run.stderr
    digest: str = json.loads((folder / "metrics.json").read_text())["digest"]
    return digest


@pytest.mark.parametrize(
    ("scenario", "seconds"),
    [
        *longer([("aerosonde_forest", None), ("one_of_everything", 150)]),
        pytest.param("one_of_everything", None, marks=pytest.mark.slow),
    ],
)
def test_three_processes_and_the_run_folder_agree(scenario: str, seconds: int | None, tmp_path: Path) -> None:
    """Whole flights, and the first seconds of one that everything random takes part in."""
    short = () if seconds is None else ("--set", f"mission.time_limit_s={seconds}")
    status = 0 if seconds is None else 1
    first = digest_of(tmp_path / "a", scenario, *short, "--no-recording", hash_seed=1, status=status)
    observed = digest_of(tmp_path / "b", scenario, *short, hash_seed=2, status=status)
    assert observed == first, "an observer changes the flight"
    own = str(tmp_path / "a" / "scenario.yaml")
    assert digest_of(tmp_path / "c", own, "--no-recording", hash_seed=3, status=status) == first
    assert (tmp_path / "c" / "scenario.yaml").read_text() == (tmp_path / "a" / "scenario.yaml").read_text()


@pytest.mark.flights
@pytest.mark.parametrize(("scenario", "random"), [("one_of_everything", True), ("aerosonde_forest", False)])
def test_the_seed_counts_where_something_is_random(scenario: str, random: bool, tmp_path: Path) -> None:
    def flown(seed: str) -> Any:
        keys = [("mission.time_limit_s", "20"), ("seed", seed)]
        return fly_to_folder(load_scenario(scenario_path(scenario), keys), tmp_path / seed, recording=False)

    one, two = flown("1"), flown("2")
    assert (one["digest"] != two["digest"]) is random


@pytest.mark.parametrize("scenario", ["aerosonde_forest", "one_of_everything"])
def test_a_plan_that_still_serves_is_kept_as_if_all_had_been_looked_at(
    scenario: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The early answer is left out in the second flight; it was given in the first."""
    loaded, early = load_scenario(scenario_path(scenario), [("mission.time_limit_s", "100")]), []
    asked = RollingWindow._still_serves

    def serves_on(planner: RollingWindow, request: PlanRequest) -> bool:
        early.append(asked(planner, request))
        return early[-1]

    monkeypatch.setattr(RollingWindow, "_still_serves", serves_on)
    first = fly_to_folder(loaded, tmp_path / "a", recording=False)["digest"]
    assert any(early)
    monkeypatch.setattr(RollingWindow, "_still_serves", lambda _planner, _request: False)
    assert fly_to_folder(loaded, tmp_path / "b", recording=False)["digest"] == first


def test_a_loop_is_flown_once() -> None:
    loop = make_loop(small_world(mission={"time_limit_s": 1.0}), PointMass)
    fly(loop)
    for again in (fly, ClosedLoop):
        with pytest.raises(RuntimeError, match="has been flown for 1 s already; every flight needs a loop"):
            again(loop)
