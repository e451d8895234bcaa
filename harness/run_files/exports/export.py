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
from harness.run_files.exports.recordings import acmi_text, mcap_bytes
from harness.run_files.exports.tables import csv_text
from harness.run_files.run_folder import Run

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
RECORDINGS: Final[dict[str, Callable[[Run], str | bytes]]] = {"acmi": acmi_text, "mcap": mcap_bytes}
"""Formats of whole flights: every row of the track."""
FORMATS: Final = (*MISSIONS, *PATHS, *RECORDINGS)


@dataclass(frozen=True)
class Exported:
    """What an exported file holds, and what it leaves out.

    Attributes:
        content: of the file.
        left_out: a sentence about what the format cannot hold, or None.
    """

    content: bytes
    left_out: str | None = None


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
    if form in RECORDINGS:
        if what != "flown":
            raise RunFolderError(f"a file of the format {form} holds the whole flight; leave --what out")
        content = RECORDINGS[form](run)
        return Exported(content.encode() if isinstance(content, str) else content)
    path = path_of(run, what, tolerance_m)
    if len(path.latitude_deg) < 2:
        raise RunFolderError(f"the run in {run.folder} has no {what} path: it is too short")
    if form in PATHS:
        return Exported(PATHS[form](path).encode())
    return _mission(run, form, path, ground_m)


def _mission(run: Run, form: str, path: ExportedPath, ground_m: float | None) -> Exported:
    scenario = scenario_of_run(run)
    if ground_m is not None and not ground_m < path.held_altitude_m:
        raise RunFolderError(
            f"--ground-m is {ground_m:g} m, the run flew at {path.held_altitude_m:g} m; the ground must lie below"
        )
    if form == "waypoints":
        return Exported(waypoints_text(path, plane_of(scenario), ground_m).encode())
    others = sum(not obstacle.fixed for obstacle in scenario.obstacles)
    left_out = (
        f"not among the plan's fences: {counted(others, 'obstacle')} that moves or appears"
        if others
        else None
    )
    return Exported(plan_text(path, scenario, plane_of(scenario), ground_m).encode(), left_out)
