"""A small world and planners for the front door's tests."""

import inspect
from pathlib import Path as FilePath

import numpy as np

import wayproof
from tests.scenarios import scenario_of
from wayproof import Mission, Path, Plan, PlanRequest, PlanStatus

SCENARIO = """
schema: wayproof/scenario/1
name: short
area: {bounds_m: [0, 0, 3000, 2000]}
obstacles:
  - circle: {center_m: [1000, 1700], radius_m: 100}
mission: {start_m: [300, 1000], goal_m: [1200, 1000], goal_radius_m: 60}
sensor: {range_m: 1200}
"""

IMPORTS = """
from beside import WHY
from planner.interface import Mission, Path, Plan, PlanRequest, PlanStatus
"""


class Beeline:
    """Straight to the goal, whatever is in the way."""

    def __init__(self, mission: Mission) -> None:
        self.goal_m = mission.goal_m

    def plan(self, request: PlanRequest) -> Plan:
        if request.flown is not None:
            return Plan(PlanStatus.KEPT, "still on the line")
        line = [request.position_m, self.goal_m]
        return Plan(PlanStatus.FOUND, "straight to the goal", np.array(line), Path.through(line))


def small() -> wayproof.Scenario:
    return scenario_of(SCENARIO)


def source_file(folder: FilePath) -> FilePath:
    """A file with a planner, which is called as our own package is, and one beside it that it imports."""
    (folder / "beside.py").write_text('WHY = "straight on"\n')
    path = folder / "planner.py"
    told, flown = inspect.getsource(Beeline), '"straight to the goal", np.array(line)'
    path.write_text(IMPORTS + told.replace(flown, "WHY, line"))
    return path
