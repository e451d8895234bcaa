"""Guidance laws by name."""

import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from aircraft.airframes import airframe
from aircraft.guidance.interface import UPDATE_RATE_HZ
from aircraft.interface import Route
from aircraft.start import StartConditions
from harness.scenario.kinds import guidance_kinds
from tests.point_mass import PointMass

LIMITS = airframe("aerosonde").guidance_limits()


def test_keys_reach_the_law() -> None:
    law: Any = guidance_kinds()["preview"].law(LIMITS, bandwidth_radps=0.5, damping=0.7)
    assert law._gains["bandwidth_radps"] == 0.5
    assert law._gains["damping"] == 0.7
    law = guidance_kinds()["preview"].law(LIMITS)
    assert law._gains["bandwidth_radps"] == LIMITS.bandwidth_radps


def test_the_law_of_the_readme_flies_to_its_route(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (Path(__file__).parents[2] / "aircraft" / "README.md").read_text("utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    names: dict[str, Any] = {"__name__": "readme_law"}
    monkeypatch.setitem(sys.modules, "readme_law", ModuleType("readme_law"))  # where its dataclass looks
    exec(block, names)
    law = names["LAW"].law(LIMITS)
    law.follow(Route(np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 20_000.0]])))
    model = PointMass(StartConditions(100.0, 0.0, 300.0, 0.0, 25.0))
    for _ in range(120 * UPDATE_RATE_HZ):
        output = law.update(model.state())
        model.command(output.roll_command_rad, 300.0, 25.0)
        model.advance(model.step_rate_hz // UPDATE_RATE_HZ)
    assert abs(output.cross_track_m) < 1.0
