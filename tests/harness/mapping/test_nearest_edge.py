import numpy as np
import pytest

import wayproof
from planner.interface import FloatArray
from wayproof import Mission, Path, Plan, PlanRequest, PlanStatus

PROBES = np.random.default_rng(1).uniform(0.0, 4000.0, (200, 2))


class Asking:
    """Flies straight, and keeps what the map answered beside what it holds."""

    asked: list[tuple[FloatArray, FloatArray]] = []  # noqa: RUF012

    def __init__(self, mission: Mission) -> None:
        self.goal_m = mission.goal_m

    def plan(self, request: PlanRequest) -> Plan:
        moving = [each.points_m for each in request.seen.moving]
        points = np.concatenate([request.seen.edges_since(-1), *moving])
        self.asked.append((points, request.seen.distance_m(PROBES)))
        if request.flown is not None:
            return Plan(PlanStatus.KEPT, "on the line")
        line = np.array([request.position_m, self.goal_m])
        return Plan(PlanStatus.FOUND, "straight", line, Path.through(line))


def test_a_planner_asks_for_the_nearest_edge() -> None:
    """Against the distances to all points."""
    Asking.asked.clear()
    scenario = wayproof.load_scenario("aerosonde_forest").with_({"mission.time_limit_s": 40})
    wayproof.fly(scenario, planner=Asking)
    assert np.isinf(Asking.asked[0][1]).all() or len(Asking.asked[0][0])
    seen = [(points, found) for points, found in Asking.asked if len(points)]
    assert len(seen) > 20
    for points, found in seen[:: len(seen) // 5]:
        every = np.hypot(*(PROBES[:, None] - points[None]).transpose(2, 0, 1)).min(axis=1)
        assert found == pytest.approx(every)
