"""Calls a planner, which is foreign code: whatever it does, the flight goes on or ends with a sentence."""

from __future__ import annotations

import gc
import math
import sys
import time
from contextlib import nullcontext
from pathlib import Path
from traceback import walk_tb
from typing import Final

from harness.files.errors import printing_aside, sentence, trace
from planner.interface import Mission, Plan, Planner, PlanRequest, PlanStatus
from planner.plan_checks import WrongAnswerError, checked_plan
from planner.shield.intervention_log import ShieldReport

OWN_PACKAGES: Final = ("harness.", "planner.")
"""Where a planner raised, lines of code in these packages, wayproof's own, are not named to its author."""
AS_IT_IS: Final = nullcontext()  # in `fly` what is printed goes to standard error during the whole flight


class PlannerFailedError(RuntimeError):
    """A planner raised, or its answer cannot be flown.

    Attributes:
        trace: the traceback.
    """

    def __init__(self, message: str, trace: str) -> None:
        super().__init__(message)
        self.trace = trace


class GuardedPlanner:
    """A planner as the loop calls it.

    The planner reads the map but cannot change it. What it answers has been checked (`planner.plan_checks`) when the
    loop gets it. Garbage of the whole process is collected between its calls.
    """

    def __init__(self, planner: Planner, mission: Mission) -> None:
        self._planner, self._mission = planner, mission
        self.shielded = self.shield is not None  # whether there is a shield around the planner
        self.compute_ms = math.nan
        """Processor time of the planner's thread for the last answer that was not to keep the plan in effect."""
        self.wall_ms = math.nan  # wall-clock time for the same

    @property
    def shield(self) -> ShieldReport | None:
        """Record of what the planner's shield did so far; None without one."""
        report = getattr(self._planner, "report", None)
        return report if isinstance(report, ShieldReport) else None

    @property
    def backup(self) -> str:
        """Reason why the shield flies its backup; empty while it flies the planner's path, and without a shield."""
        return str(getattr(self._planner, "backup", "")) if self.shielded else ""

    def plan(self, request: PlanRequest) -> tuple[Plan, Plan]:
        """Returns the answer to a request, checked, and the object that the planner itself returned.

        The latter of the answer in effect is `PlanRequest.flown`. Raises PlannerFailedError where the planner raised,
        or its answer cannot be flown.
        """
        collects = gc.isenabled()
        gc.disable()
        begun, began = time.thread_time(), time.perf_counter()
        try:
            with printing_aside() if sys.stdout is not sys.stderr else AS_IT_IS:
                own = self._planner.plan(request)
                if type(own) is not Plan or own.status is not PlanStatus.KEPT:  # else nobody asks how long
                    self.compute_ms = 1e3 * (time.thread_time() - begun)
                    self.wall_ms = 1e3 * (time.perf_counter() - began)
                return checked_plan(own, request.position_m, self._mission), own
        except KeyboardInterrupt:
            raise
        except WrongAnswerError as error:
            raise PlannerFailedError(str(error), trace(error)) from None
        except BaseException as error:  # whatever it is, it is no more than a plan that failed
            message = f"the planner raised {sentence(error)}{_location(error)}"
            raise PlannerFailedError(message, trace(error)) from None
        finally:
            if collects:
                gc.enable()


def _location(error: BaseException) -> str:
    """Returns file and line of the innermost call in the planner's own file, as ` (bug.py:5)`; empty if unknown."""
    calls = [
        (frame.f_code.co_filename, line)
        for frame, line in walk_tb(error.__traceback__)
        if not frame.f_globals.get("__name__", "").startswith(OWN_PACKAGES)
    ]
    lines = [line for file, line in calls if file == calls[0][0]]
    return f" ({Path(calls[0][0]).name}:{lines[-1]})" if lines else ""
