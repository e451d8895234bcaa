"""The closed loop: scenario, true world, sensing, flight, record, metrics, recording; and the front door in Python.

`import wayproof` offers the same names as this package: see `harness.api`. Each is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # as of `typing`, which takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

    from aircraft.airframes import AircraftError
    from aircraft.guidance.interface import GuidanceLimits, GuidanceOutput
    from aircraft.interface import AircraftState, Route
    from harness.api.campaigns import compare, load_campaign, sweep
    from harness.api.flights import fly, load_run
    from harness.api.metrics import Metrics
    from harness.api.paths import check, replay
    from harness.api.results import CampaignResult, ComparisonResult, FlightResult
    from harness.api.stepping import SteppedFlight, make
    from harness.files.errors import PlannerError, WriteError
    from harness.files.input_file import InputError
    from harness.flight.stepped import Status
    from harness.scenario.scenario import Scenario, dump_scenario, load_scenario
    from planner.interface import MapView, Mission, Path, Plan, Planner, PlanPicture, PlanRequest, PlanStatus
    from planner.registry import PlannerKind

__all__ = [
    "AircraftError", "AircraftState", "CampaignResult", "ComparisonResult", "FlightResult", "GuidanceLimits",
    "GuidanceOutput", "InputError", "MapView", "Metrics", "Mission", "Path", "Plan", "PlanPicture",
    "PlanRequest", "PlanStatus", "Planner", "PlannerError", "PlannerKind", "Route", "Scenario", "Status",
    "SteppedFlight", "WriteError", "check", "compare", "dump_scenario", "fly", "load_campaign",
    "load_run", "load_scenario", "make", "replay", "sweep",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """A name of the front door, imported now from the module that the lines above say."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import ast

    with open(__file__, encoding="utf-8") as file:
        lines = [line for line in ast.walk(ast.parse(file.read())) if isinstance(line, ast.ImportFrom)]
    home = next(str(line.module) for line in lines if name in [each.name for each in line.names])
    globals()[name] = found = getattr(import_module(home), name)
    return found
