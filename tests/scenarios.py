"""Scenarios as people give them: a file that wayproof reads."""

from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory

from wayproof import Scenario, load_scenario

LEAST = """\
schema: wayproof/scenario/1
name: least
area: {bounds_m: [0, 0, 40000, 40000]}
mission: {start_m: [1000, 1000], goal_m: [31000, 1000]}
"""


def scenario_of(text: str, name: str = "scenario.yaml") -> Scenario:
    """Reads a scenario file with this text, which faults call by its `name`."""
    with TemporaryDirectory() as folder, chdir(folder):
        Path(name).write_text(text, encoding="utf-8")
        return load_scenario(name)
