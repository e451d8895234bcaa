"""A flight that was steered from outside, so that it can be flown again without whoever steered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aircraft.guidance.interface import GuidanceLimits
from harness.learning.pilots import LinePilot, Roll, RollPilot, Waypoint, WaypointPilot
from harness.scenario.scenario import Scenario
from planner.interface import Mission

Waypoints = tuple[Waypoint, ...]
Rolls = tuple[Roll, ...]


def waypoint_planner(noted: Waypoints) -> Callable[[Mission], WaypointPilot]:
    """Makes the planner that gives the waypoints of an episode once more."""

    def planner(mission: Mission) -> WaypointPilot:
        return WaypointPilot(mission, noted)

    return planner


def roll_law(goal_m: tuple[float, float], noted: Rolls) -> Callable[[GuidanceLimits], RollPilot]:
    """Makes the guidance law that commands the rolls of an episode once more."""

    def law(limits: GuidanceLimits) -> RollPilot:
        return RollPilot(limits, goal_m, noted)

    return law


def line_planner(mission: Mission) -> LinePilot:
    """The planner beside `roll_law`: the line to the goal."""
    return LinePilot(mission)


@dataclass(frozen=True)
class Episode:
    """What was flown, and what it was told.

    `wayproof.fly(episode.scenario, **episode.pilots)` flies it again, to the same digest.

    Attributes:
        scenario: with the seed that was flown.
        waypoints: that the planner gave.
        rolls: that the guidance law commanded; None where it was steered by waypoints.
    """

    scenario: Scenario
    waypoints: Waypoints = ()
    rolls: Rolls | None = None

    @property
    def pilots(self) -> dict[str, Any]:
        """`planner`, and `guidance` where rolls were commanded, as `wayproof.fly` takes them."""
        if self.rolls is None:
            return {"planner": waypoint_planner(self.waypoints)}
        return {"planner": line_planner, "guidance": roll_law(self.scenario.mission.goal_m, self.rolls)}

    def save(self, path: str | Path) -> Path:
        """Writes a Python file whose `planner` (and `law`) fly the episode again, also from the command line.

        For example: wayproof fly aerosonde_forest --seed 3 --planner episode.py:planner

        Args:
            path: the file, ending in .py.

        Raises:
            ValueError: it does not end so.
        """
        file = Path(path)
        if file.suffix != ".py":
            raise ValueError(f"{file}: must end in .py; it is a Python file with the planner of the episode")
        flown = f"--seed {self.scenario.seed} --planner {file.name}:planner"
        if self.rolls is None:
            body = (
                f"from harness.learning.episode import Waypoint, waypoint_planner\n\n"
                f"planner = waypoint_planner({_listed(self.waypoints)})\n"
            )
        else:
            flown += f" --guidance {file.name}:law"
            goal_m = tuple(self.scenario.mission.goal_m)
            body = (
                f"from harness.learning.episode import Roll, line_planner as planner, roll_law\n\n"
                f"law = roll_law({goal_m!r}, {_listed(self.rolls)})\n"
            )
        title = f'"""An episode of {self.scenario.name}: wayproof fly SCENARIO {flown}"""\n'
        file.write_text(f"{title}\n{body}", encoding="utf-8")
        return file


def _listed(noted: Waypoints | Rolls) -> str:
    """As Python writes it, every bit of a float kept."""
    return "(" + "".join(f"\n    {type(each).__name__}{tuple(each)!r}," for each in noted) + "\n)"
