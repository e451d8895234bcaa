"""A run as the content of a file, by the name of its format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from harness.files.errors import RunFolderError
from harness.files.wording import counted
from harness.run_files.exports.exported_path import ExportedPath, path_of, plane_of, scenario_of_run
from harness.run_files.exports.maps import geojson_text, gpx_text, kml_text
from harness.run_files.exports.missions import plan_text, waypoints_text
from harness.run_files.exports.recordings import mcap_bytes
from harness.run_files.exports.tables import csv_text
from harness.run_files.run_folder import Run
from harness.scenario.scenario import Scenario
from harness.scenario.sections import Origin

TOLERANCE_M: Final = 0.25
"""How far a point that is left out may be from the path, seen from above."""

MISSIONS: Final = ("plan", "waypoints")
"""Formats of missions."""
PATHS: Final[dict[str, Callable[[ExportedPath], str]]] = {
    "geojson": geojson_text,
    "kml": kml_text,
    "gpx": gpx_text,
    "csv": csv_text,
}
"""Formats of paths."""
RECORDING: Final = "mcap"
"""Format of whole flights: every row of the track."""
FORMATS: Final = (*MISSIONS, *PATHS, RECORDING)


@dataclass(frozen=True)
class Exported:
    """What an exported file holds, and what its user should know.

    Attributes:
        content: of the file.
        notes: sentences about what the format cannot hold, and what does not hold of the run.
    """

    content: bytes
    notes: tuple[str, ...] = ()


def exported(
    run: Run, form: str, what: str, tolerance_m: float = TOLERANCE_M, ground_m: float | None = None
) -> Exported:
    """A run as a file of another tool.

    Args:
        run: the run.
        form: one of `FORMATS`.
        what: "flown" or "planned".
        tolerance_m: how far a point that is left out may be from the path, seen from above; formats of whole flights
            have every row of the track.
        ground_m: altitude of the ground at both ends, for a mission with takeoff and landing.

    Raises:
        RunFolderError: the run has no such path, or a mission has no such ground.
    """
    if ground_m is not None and form not in MISSIONS:
        raise RunFolderError(
            f"--ground-m adds takeoff and landing to a mission ({', '.join(MISSIONS)}), not to {form}"
        )
    if form == RECORDING:
        if what != "flown":
            raise RunFolderError(f"a file of the format {form} holds the whole flight; leave --what out")
        return Exported(mcap_bytes(run), _place_note(scenario_of_run(run)))
    path = path_of(run, what, tolerance_m)
    if len(path.latitude_deg) < 2:
        raise RunFolderError(f"the run in {run.folder} has no {what} path: it is too short")
    scenario = scenario_of_run(run)
    note = () if form == "csv" else _place_note(scenario)  # a table has the metres of the plane, too
    if form in PATHS:
        return Exported(PATHS[form](path).encode(), note)
    mission = _mission(run, scenario, form, path, ground_m)
    return Exported(mission.content, (*_outcome_note(run), *note, *mission.notes))


def _place_note(scenario: Scenario) -> tuple[str, ...]:
    """Said of a file that lies where the default origin is: of a run nobody knows any more whether it was given."""
    origin = scenario.area.origin
    if origin != Origin():
        return ()
    return (
        f"area.origin is the default: the file lies about {origin.latitude_deg:g}, {origin.longitude_deg:g}",
    )


def _outcome_note(run: Run) -> tuple[str, ...]:
    """Said of a mission, which somebody may fly."""
    if run.metrics["outcome"] == "reached":
        return ()
    ended = f"{run.metrics['outcome'].replace('_', ' ')}: {run.metrics['reason']}"
    return (f"the run did not reach its goal, and its mission would not either ({ended})",)


def _mission(run: Run, scenario: Scenario, form: str, path: ExportedPath, ground_m: float | None) -> Exported:
    if ground_m is not None and not ground_m < path.held_altitude_m:
        raise RunFolderError(
            f"--ground-m is {ground_m:g} m, the run flew at {path.held_altitude_m:g} m; the ground must lie below"
        )
    if form == "waypoints":
        return Exported(waypoints_text(path, plane_of(scenario), ground_m).encode())
    others = sum(not obstacle.fixed for obstacle in scenario.obstacles)
    left_out = (f"not among the plan's fences: {counted(others, 'obstacle')} that moves or appears",)
    return Exported(
        plan_text(path, scenario, plane_of(scenario), ground_m).encode(), left_out if others else ()
    )
