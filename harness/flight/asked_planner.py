"""Asks a planner, which is code of others: whatever it does, the flight goes on or ends with a sentence."""

from __future__ import annotations

import math
import time

from harness.files.crash import sentence, trace
from harness.files.printing import PrintingAside
from harness.mapping.read_only_map import ReadOnlyMap
from planner.interface import MapView, Mission, Plan, Planner, PlanRequest
from planner.plan_checks import WrongAnswerError, checked_plan


class PlannerFailedError(RuntimeError):
    """A planner raised, or its answer cannot be flown.

    Attributes:
        trace: the traceback.
    """

    def __init__(self, said: str, trace: str) -> None:
        super().__init__(said)
        self.trace = trace


class AskedPlanner:
    """A planner as the loop asks it.

    The planner reads the map but cannot change it, gets its own answers back as `PlanRequest.flown`, and prints to
    standard error. What it answers has been checked (`planner.plan_checks`) when the loop gets it.

    Args:
        planner: the planner.
        mission: of the flight.
        seen: the map.
    """

    def __init__(self, planner: Planner, mission: Mission, seen: MapView) -> None:
        self._planner, self._mission, self._seen = planner, mission, ReadOnlyMap(seen)
        self._answers: dict[int, tuple[Plan, Plan]] = {}
        """The plan in effect and the one on its way, by identity: as checked, and as the planner gave them."""
        self.compute_ms = math.nan
        """Wall-clock time that the last answer took the planner."""

    def plan(self, request: PlanRequest) -> Plan:
        """The checked answer to a request; `request.flown` is one that was given before.

        Raises:
            PlannerFailedError: the planner raised, or its answer cannot be flown.
            KeyboardInterrupt: as ever.
        """
        flown = request.flown
        own = self._answers.get(id(flown), (flown, flown))[1]
        asked = PlanRequest(*request[:3], self._seen, own, *request[5:])
        begun = time.perf_counter()
        try:
            with PrintingAside():
                answer = self._planner.plan(asked)
                self.compute_ms = 1e3 * (time.perf_counter() - begun)
                plan = checked_plan(answer, request.position_m, self._mission)
        except KeyboardInterrupt:
            raise
        except WrongAnswerError as error:
            raise PlannerFailedError(str(error), trace(error)) from None
        except BaseException as error:  # whatever it is, it is no more than a plan that failed
            with PrintingAside():
                raise PlannerFailedError(f"the planner raised {sentence(error)}", trace(error)) from None
        if plan is not answer:
            kept = self._answers.get(id(flown))
            self._answers = {id(plan): (plan, answer)} | ({id(flown): kept} if kept else {})
        return plan
