"""Scenarios as people give them: a file that wayproof reads."""

from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory

from wayproof import Scenario, load_scenario


def scenario_of(text: str, name: str = "scenario.yaml") -> Scenario:
    """Reads a scenario file with this text, which faults call by its `name`."""
    with TemporaryDirectory() as folder, chdir(folder):
        Path(name).write_text(text, encoding="utf-8")
        return load_scenario(name)
