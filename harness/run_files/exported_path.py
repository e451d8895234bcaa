"""The path of a run for other tools: what was flown, or what was planned while it was, on the ellipsoid."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

import numpy as np

from aircraft.frames import LocalPlane
from harness.flight.record import FloatArray, IntArray
from harness.run_files.run_folder import Run
from harness.run_files.run_tables import PlanRow
from harness.scenario.scenario import Scenario, parse_scenario

FORWARD_M: Final = 0.5
"""A planned point closer than this to the one before is left out; where a plan takes over, progress restarts."""
DIGITS: Final = 9
"""Decimal places of degrees in files: a tenth of a millimetre."""


@dataclass(frozen=True, eq=False)
class ExportedPath:
    """A path on the WGS84 ellipsoid. All arrays are equally long.

    Attributes:
        name: of the run's scenario.
        what: "flown" or "planned".
        degrees: (n, 2) geodetic latitude and longitude, rounded for a file.
        altitude_m: (n,) above mean sea level.
        time_s: (n,) simulated time at which the aircraft was there, or followed the plan there.
        started: date and time of `time_s` 0.
    """

    name: str
    what: str
    degrees: FloatArray
    altitude_m: FloatArray
    time_s: FloatArray
    started: datetime

    @property
    def dates(self) -> list[str]:
        """Date and time of every point, ISO 8601 in UTC, to a millisecond."""
        every = (self.started + timedelta(seconds=time) for time in self.time_s.tolist())
        return [each.isoformat(timespec="milliseconds").replace("+00:00", "Z") for each in every]


def scenario_of_run(run: Run) -> Scenario:
    """The scenario that a run flew."""
    return parse_scenario(run.scenario_yaml, str(run.folder / "scenario.yaml"), as_flown=True)


def path_of(run: Run, scenario: Scenario, what: str, tolerance_m: float) -> ExportedPath:
    """The path of a run with no more points than it takes.

    Args:
        run: the run.
        scenario: that it flew.
        what: "flown": the track; "planned": of every plan the part that was in effect.
        tolerance_m: how far a point that is left out may be from the path, seen from above.
    """
    track = run.track
    if what == "planned":
        points, rows = planned_points(run)
        places = np.column_stack((points, np.full(len(points), scenario.mission.altitude_m)))
    else:
        places = np.column_stack((track.east_m, track.north_m, track.up_m))
        rows = np.arange(len(track))
    kept = _simplified(places, tolerance_m)
    return ExportedPath(
        name=scenario.name,
        what=what,
        degrees=geodetic(scenario, places[kept, :2]),
        altitude_m=places[kept, 2].round(3),
        time_s=track.time_s[rows[kept]],
        started=datetime.fromisoformat(str(run.manifest["started_utc"])),
    )


def geodetic(scenario: Scenario, points_m: FloatArray) -> FloatArray:
    """(n, 2) latitude and longitude, rounded for a file, of (n, 2) points in a scenario's plane."""
    plane = LocalPlane(scenario.area.origin.latitude_deg, scenario.area.origin.longitude_deg)
    degrees = [plane.geodetic(east, north) for east, north in points_m.tolist()]
    return np.array(degrees).reshape(-1, 2).round(DIGITS)


def planned_points(run: Run) -> tuple[FloatArray, IntArray]:
    """The plan in effect, row by row of the track.

    Returns:
        (n, 2) east and north, and the (n,) rows of the track that they go with; both empty where nothing was planned.
    """
    track = run.track
    points = np.full((len(track), 2), np.nan)
    for plan in run.plans:
        rows = np.flatnonzero(track.plan_index == plan.plan_index)
        points[rows] = _on_plan(plan, track.arc_length_m[rows])
    course = np.radians(track.course_deg)
    ahead = np.column_stack((np.sin(course), np.cos(course)))
    kept: list[int] = []
    for row in np.flatnonzero(np.isfinite(points[:, 0])).tolist():
        if not kept or (points[row] - points[kept[-1]]) @ ahead[row] > FORWARD_M:
            kept.append(row)
    return points[kept], np.array(kept, dtype=np.int64)


def _on_plan(plan: PlanRow, arc_length_m: FloatArray) -> FloatArray:
    """(k, 2) points of a plan at (k,) arc lengths, clamped to its ends."""
    chord = np.append(0.0, np.cumsum(np.hypot(*np.diff(plan.path_m, axis=0).T)))
    # The chords are a little shorter than the arcs that arc length is counted along.
    along = chord * (plan.length_m / chord[-1])
    return np.column_stack([np.interp(arc_length_m, along, plan.path_m[:, axis]) for axis in (0, 1)])


def _simplified(places_m: FloatArray, tolerance_m: float) -> IntArray:
    """(k,) those of (n, 3) places that a line within a tolerance needs (Douglas and Peucker, 1973), in order."""
    import shapely

    if len(places_m) < 2:
        return np.arange(len(places_m))
    numbered = shapely.LineString(np.column_stack((places_m[:, :2], np.arange(len(places_m)))))
    simple = shapely.simplify(numbered, tolerance_m, preserve_topology=False)
    kept: IntArray = shapely.get_coordinates(simple, include_z=True)[:, 2].astype(np.int64)
    return kept
