from pathlib import Path

import pytest

from harness.run.scenario_flight import fly_to_folder
from wayproof import load_scenario

FOREST = Path(__file__).parents[2] / "scenarios" / "aerosonde_forest.yaml"


@pytest.fixture(scope="session")
def a_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a complete run of 15 s; nobody may change it."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    fly_to_folder(load_scenario(FOREST, [("mission.time_limit_s", "15")]), folder, recording=True)
    return folder
