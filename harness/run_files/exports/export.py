"""A run as the content of a file of another tool, by the name of its format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from harness.files.errors import RunFolderError
from harness.files.wording import counted
from harness.run_files.exports.exported_path import ExportedPath, path_of, scenario_of_run
from harness.run_files.exports.maps import geojson_text, kml_text
from harness.run_files.exports.missions import plan_text, waypoints_text
from harness.run_files.run_folder import Run
from harness.scenario.scenario import Scenario
from harness.scenario.sections import Origin

FORMATS: Final[dict[str, Callable[[ExportedPath, Scenario], str]]] = {
    "plan": plan_text,
    "waypoints": waypoints_text,
    "geojson": geojson_text,
    "kml": kml_text,
}
"""Writers by the name of the format."""
MISSIONS: Final = ("plan", "waypoints")
"""Formats that an autopilot flies."""


@dataclass(frozen=True)
class Exported:
    """What an exported file holds, and what its user should know.

    Attributes:
        content: of the file.
        notes: sentences about what the format cannot hold, and what does not hold of the run.
    """

    content: bytes
    notes: tuple[str, ...] = ()


def exported(run: Run, form: str, what: str, tolerance_m: float) -> Exported:
    """A run as a file of another tool.

    Args:
        run: the run.
        form: one of `FORMATS`.
        what: "flown" or "planned".
        tolerance_m: how far a point that is left out may be from the path, seen from above.

    Raises:
        RunFolderError: the run has no such path.
    """
    scenario = scenario_of_run(run)
    path = path_of(run, scenario, what, tolerance_m)
    if len(path.points_m) < 2:
        raise RunFolderError(f"the run in {run.folder} has no {what} path: it is too short")
    return Exported(FORMATS[form](path, scenario).encode(), tuple(_notes(run, scenario, form)))


def _notes(run: Run, scenario: Scenario, form: str) -> list[str]:
    """What is said of a file beside what it holds."""
    origin, outcome = scenario.area.origin, run.metrics["outcome"]
    others = sum(not obstacle.fixed for obstacle in scenario.obstacles)
    notes = []
    if form in MISSIONS and outcome != "reached":
        ended = f"{outcome.replace('_', ' ')}: {run.metrics['reason']}"
        notes.append(f"the run did not reach its goal, and its mission would not either ({ended})")
    if origin == Origin():  # nobody knows any more whether it was given
        place = f"{origin.latitude_deg:g}, {origin.longitude_deg:g}"
        notes.append(f"area.origin is the default: the file lies about {place}")
    if form == "plan" and others:
        notes.append(f"not among the plan's fences: {counted(others, 'obstacle')} that moves or appears")
    return notes
