"""Flights as environments of gymnasium."""

import math
import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import wayproof
from harness.learning.environments import STATE, ScanKeeper, state_of
from harness.mapping.scan import RangeScan
from harness.scenario.performance import mission_of
from tests.closed_loop.small import small_world as world
from tests.harness.learning.steering import flown
from tests.processes import ROOT, python
from wayproof import Scenario

ID = "wayproof/Waypoints-v0"
TREE = {"circle": {"center_m": [1500.0, 1640.0], "radius_m": 150.0}}


def near(**sections: Any) -> Scenario:
    """A flight of two minutes, with wind and a sensor that is not perfect."""
    windy = {"wind": {"speed_mps": 4.0, "from_deg": 300.0}}
    sensor = {"range_m": 1500.0, "rays": 144, "range_noise_m": 2.0, "dropout": 0.05, "latency_s": 0.3}
    mission = {"goal_m": [2700.0, 2700.0], "goal_radius_m": 100.0}
    every: dict[str, Any] = {"environment": windy, "sensor": sensor, "mission": mission} | sections
    return world(TREE, **every)


def test_gymnasium_finds_nothing_to_complain_about() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(ID, scenario=near(mission={"goal_m": [2700.0, 2700.0], "time_limit_s": 30.0}))
        check_env(env.unwrapped)


@pytest.mark.flights
@pytest.mark.parametrize("planner", [{}, {"shield": "loiter"}])
def test_an_episode_flown_again_has_the_same_digest(planner: dict[str, str]) -> None:
    env = gymnasium.make(ID, scenario=near(planner=planner))
    steps, total, info = flown(env, seed=5)
    assert info["outcome"] == "reached"
    assert info["seed"] == 5
    assert total == pytest.approx(1.0 + 1.0, abs=0.1)
    assert steps == pytest.approx(info["time_s"] - 1.0, abs=1.0)
    episode = env.unwrapped.episode  # type: ignore[attr-defined]
    again = wayproof.fly(episode.scenario, **episode.pilots)
    assert (again.outcome, again.digest) == ("reached", info["digest"])
    assert flown(env, seed=5)[2]["digest"] == info["digest"]


def test_a_collision_costs_and_ends_the_episode() -> None:
    env = gymnasium.make(ID, scenario=near())
    _, total, info = flown(env, seed=1, blind=True)
    assert info["outcome"] == "collision"
    assert total < 0.0
    _, reward, ended, cut, after = env.step(np.zeros(2, dtype=np.float32))
    assert (reward, ended, cut, after) == (0.0, True, False, info), "nothing more is flown, nor paid twice"


def test_the_time_limit_truncates() -> None:
    scenario = near(mission={"goal_m": [2700.0, 2700.0], "time_limit_s": 3.0})
    env = gymnasium.make(ID, scenario=scenario, step_s=0.5)
    env.reset()
    ends = [env.step(np.zeros(2, dtype=np.float32))[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]


def test_seeds_are_the_scenarios_own_then_the_given_then_drawn() -> None:
    env = gymnasium.make(ID, scenario=near())
    seeds = [env.reset(seed=seed)[1]["seed"] for seed in (None, None, 7, None, None, 7, None)]
    assert seeds[:3] == [1, 1, 7]
    assert len({*seeds[3:5], 7}) == 3
    assert seeds[5:] == [7, seeds[3]]


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_several_fly_at_a_time(mode: str) -> None:
    envs = gymnasium.make_vec(ID, num_envs=2, vectorization_mode=mode, scenario=near())
    try:
        observed, _ = envs.reset(seed=1)
        assert observed["scan"].shape == (2, 72)
        observed, rewards, ended, cut, _ = envs.step(np.array([[0.0, 1.0], [1.0, 0.0]], dtype=np.float32))
        assert observed["state"].shape == (2, len(STATE))
        assert rewards.shape == (2,)
        assert not ended.any()
        assert not cut.any()
    finally:
        envs.close()


def test_an_action_is_where_the_waypoint_lies() -> None:
    env: Any = gymnasium.make(ID, scenario=near()).unwrapped
    env.reset(seed=1)
    env.step(np.array([0.5, 0.0], dtype=np.float32))
    noted = env.episode.waypoints[-1]
    course = env._loop.status.believed.course_rad
    assert noted.time_s == pytest.approx(1.3)  # when the next scan has become available
    before = np.array([300.0, 300.0]) + 25.0 * np.array([np.sin(np.pi / 4), np.cos(np.pi / 4)])
    off = np.array([noted.east_m, noted.north_m]) - before
    assert float(np.hypot(*off)) == pytest.approx(750.0, rel=0.05)
    assert off[0] > 400.0
    assert off[1] < -400.0
    assert course != 0.0


def test_a_bank_is_observed_over_the_limit_in_force() -> None:
    env: Any = gymnasium.make(ID, scenario=near(aircraft={"autopilot": {"bank_limit_deg": 20}})).unwrapped
    env.reset(seed=1)
    seen = [env.step(np.array([1.0, 0.0]))[0]["state"][7] for _ in range(4)][-1]
    assert seen == pytest.approx(math.degrees(env._loop.status.believed.roll_rad) / 20.0, abs=1e-5)


def test_a_scan_is_observed_when_it_is_available() -> None:
    ranges = np.array([100.0, 50.0, np.inf, 200.0])
    keeper = ScanKeeper()
    assert keeper.ranges(0.0, 2).tolist() == [1.0, 1.0]
    scan = RangeScan(0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 1.0, np.ones(4, dtype=complex), ranges, 200.0)
    keeper.on_scan(scan, None)  # type: ignore[arg-type]
    assert keeper.ranges(0.2, 2).tolist() == [1.0, 1.0]
    assert keeper.ranges(0.3, 2).tolist() == [0.25, 1.0]
    assert keeper.ranges(0.3, 4).tolist() == [0.5, 0.25, 1.0, 1.0]


def test_the_state_is_what_it_says() -> None:
    from aircraft.interface import AircraftState

    mission = replace(mission_of(near()), bounds_m=(0.0, 0.0, 6000.0, 6000.0))
    east = AircraftState(0.0, 2700.0, 600.0, 300.0, 25.0, 0.0, 0.0, 0.0, -0.3, 0.0, 25.0, 1.0)
    values = list(dict(zip(STATE, state_of(east, mission, 0.6).tolist(), strict=True)).values())
    assert values[:3] == pytest.approx([2100.0 / np.hypot(6000.0, 6000.0), 0.0, -1.0], abs=1e-6)
    assert values[3:] == pytest.approx([0.45, 0.1, 0.0, 1.0, -0.5, 0.5], abs=1e-6)


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"step_s": 0.25}, r"step_s is 0\.25; must be a multiple of 0\.1 s"),
        ({"step_s": 0.1}, "actions would be passed over"),
        ({"step_s": 0.0}, "step_s is 0; must be a multiple"),
        ({"step_s": math.nan}, "step_s is nan; must be a multiple"),
        ({"beams": 145}, "beams is 145; must be from 1 to the 144 rays"),
        ({"scenario": "no_such_world"}, "no_such_world: no such file"),
    ],
)
def test_what_makes_no_sense_is_told(keys: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        gymnasium.make(ID, **({"scenario": near()} | keys))


@pytest.mark.parametrize("action", [[math.nan, 0.5], [0.0, math.inf], [0.0, 0.5, 0.0], 0.5, [5.0, 0.0], [0.0, -1.01]])
def test_an_action_that_is_none_is_told(action: Any) -> None:
    env: Any = gymnasium.make(ID, scenario=near(), disable_env_checker=True).unwrapped
    env.reset(seed=1)
    with pytest.raises(ValueError, match=r"action is .*; must be 2 numbers from -1 to 1"):
        env.step(np.array(action, dtype=np.float32))


def test_a_step_before_the_first_reset_is_told() -> None:
    with pytest.raises(RuntimeError, match=r"reset\(\) before step\(\)"):
        gymnasium.make(ID, scenario=near(), disable_env_checker=True).unwrapped.step(np.zeros(2))


@pytest.mark.parametrize(
    "code",
    [
        "import wayproof, gymnasium; gymnasium.spec('wayproof/Waypoints-v0')",
        "import gymnasium, wayproof; gymnasium.spec('wayproof/Waypoints-v0')",
        "import gymnasium; gymnasium.make('wayproof:wayproof/Waypoints-v0', scenario='aerosonde_forest')",
        "import wayproof, sys; assert not {'gymnasium', 'numpy'} & set(sys.modules)",
        "import sys; sys.modules['gymnasium'] = None; import wayproof; wayproof.load_scenario('aerosonde_forest')",
    ],
)
def test_the_environments_are_known_in_whatever_order_things_are_imported(code: str, tmp_path: Path) -> None:
    run = python("-W", "error::UserWarning", "-c", code, folder=tmp_path)
    assert (run.returncode, run.stderr) == (0, "")


@pytest.mark.slow
def test_the_example_of_the_readme_learns_to_get_there() -> None:
    text = (ROOT / "harness" / "learning" / "README.md").read_text("utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    exec(code, names)
    assert names["outcome"] == "reached"
    assert names["total"] == pytest.approx(1.98, abs=0.01)
