from __future__ import annotations

import pytest

import aircraft.guidance.registry
import planner.registry


@pytest.fixture(autouse=True)
def nothing_stays_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(planner.registry, "_registered", {})
    monkeypatch.setattr(aircraft.guidance.registry, "_registered", {})
