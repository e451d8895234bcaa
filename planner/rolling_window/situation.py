"""The states of the planner, and its situation at a request."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from planner.geometry.course import Course
from planner.interface import PlanRequest
from planner.shield.committed_plan import CommittedPlan


class PlanningState(Enum):
    """The state of planning: what is being done about the plan in effect."""

    FOLLOWING = "following"  # the committed plan leads on; the window rolls as it is due
    LOITERING = "loitering"  # in the turn that the committed plan ends with, the search for a way on goes on
    ESCAPING = "escaping"  # without a certified plan, or with a broken one, what keeps clear is flown
    GIVING_UP = "giving up"  # a search was in vain: a place is given up, or such places are tried again
    PROVING = "proving"  # the edge points seen leave no way, or none with room to turn, which ends the flight


class NoRoomToTurn(RuntimeError):
    """Every way that is left leads through a gap in which no full turn has been seen to be free."""

    def __init__(self, gap_m: float) -> None:
        super().__init__(
            "no way with room to turn is left: of the gaps between obstacles that part the aircraft from the "
            f"goal, none is {gap_m:.0f} m wide or was seen to lead to room for a turn. "
            "That does not prove the goal unreachable"
        )


class NoWayFound(RuntimeError):
    """Gaps are left that may be wide enough for a vehicle at the clearance, but none that is seen to be."""

    def __init__(self, gap_m: float, edge_error_m: float) -> None:
        super().__init__(
            "no way is found: of the gaps between obstacles that part the aircraft from the goal, none looks wider "
            f"than {gap_m:.0f} m, and seen from afar a gap may look narrower than it is by {2.0 * edge_error_m:.0f} m. "
            "That does not prove the goal unreachable"
        )


@dataclass(frozen=True, eq=False)
class Situation:
    """A request, the plan in effect, and the arc length (m) of the aircraft on it, whole turns taken off."""

    request: PlanRequest
    plan: CommittedPlan | None
    here_m: float = 0.0

    @property
    def ahead(self) -> Course | None:
        """The rest of the course in effect; None without one, and in the loiter, which has left it."""
        if self.plan is None or self.plan.holds(self.here_m):
            return None
        return self.plan.course.ahead(self.here_m)
