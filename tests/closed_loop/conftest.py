from collections.abc import Callable

import pytest

from harness.scenario.kinds import PLANNER
from planner.rolling_window.config import RollingWindowConfig
from wayproof import Mission, Plan, PlannerKind, PlanRequest

Answer = Callable[[Mission, PlanRequest], Plan]


@pytest.fixture
def answering(monkeypatch: pytest.MonkeyPatch) -> Callable[[Answer], None]:
    """Makes `planner.kind: stand_in` a planner that gives the answers of a function."""

    def install(answer: Answer) -> None:
        class StandIn:
            def __init__(self, _: object, mission: Mission) -> None:
                self.mission = mission

            def plan(self, request: PlanRequest) -> Plan:
                return answer(self.mission, request)

        kind = PlannerKind("stand_in", "answers as a test tells it to", RollingWindowConfig, StandIn)
        monkeypatch.setattr(PLANNER, "built_in", (*PLANNER.built_in, kind))

    return install
