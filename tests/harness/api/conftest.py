import pytest

from harness.scenario.kinds import GUIDANCE, PLANNER


@pytest.fixture(autouse=True)
def nothing_stays_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PLANNER, "registered", {})
    monkeypatch.setattr(GUIDANCE, "registered", {})
