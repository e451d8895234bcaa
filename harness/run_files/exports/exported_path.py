"""The path of a run for other tools: what was flown, or what was planned while it was, on the ellipsoid."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from aircraft.frames import LocalPlane
from harness.flight.record import FloatArray, IntArray
from harness.run_files.plans_table import PlanRow
from harness.run_files.run_folder import Run
from harness.scenario.scenario import Scenario, parse_scenario

FORWARD_M = 0.5
"""A planned point closer than this to the one before is left out; where a plan takes over, progress restarts."""

ATTRIBUTES = (
    "course_deg",
    "heading_deg",
    "roll_deg",
    "pitch_deg",
    "airspeed_mps",
    "groundspeed_mps",
    "cross_track_m",
    "clearance_m",
    "plan_index",
)
"""Columns of the track that go with every point of a flown path."""


@dataclass(frozen=True, eq=False)
class ExportedPath:
    """A path on the WGS84 ellipsoid. All arrays are equally long.

    Attributes:
        name: of the run's scenario.
        what: "flown" or "planned".
        latitude_deg: (n,) geodetic.
        longitude_deg: (n,).
        altitude_m: (n,) above mean sea level.
        points_m: (n, 2) east, north in the local plane.
        plane: the local plane.
        time_s: (n,) simulated time at which the aircraft was there, or followed the plan there.
        started: date and time of `time_s` 0.
        attributes: columns of the track by name, (n,) each; empty for a planned path.
        held_altitude_m: the altitude to be held.
        airspeed_mps: the true airspeed to be held.
        turn_radius_m: of the tightest turn of the run's plans; infinite where none turns.
    """

    name: str
    what: str
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    altitude_m: FloatArray
    points_m: FloatArray
    plane: LocalPlane
    time_s: FloatArray
    started: datetime
    attributes: dict[str, FloatArray]
    held_altitude_m: float
    airspeed_mps: float
    turn_radius_m: float

    def date(self, time_s: float) -> datetime:
        """Date and time of a simulated time."""
        return self.started + timedelta(seconds=time_s)


def scenario_of_run(run: Run) -> Scenario:
    """The scenario that a run flew."""
    return parse_scenario(run.scenario_yaml, str(run.folder / "scenario.yaml"), as_flown=True)


def plane_of(scenario: Scenario) -> LocalPlane:
    """The local plane of a scenario."""
    return LocalPlane(scenario.area.origin.latitude_deg, scenario.area.origin.longitude_deg)


def path_of(run: Run, what: str, tolerance_m: float) -> ExportedPath:
    """The path of a run with no more points than it takes.

    Args:
        run: the run.
        what: "flown": the track; "planned": of every plan the part that was in effect.
        tolerance_m: how far a point that is left out may be from the path, seen from above.
    """
    scenario = scenario_of_run(run)
    held, track = scenario.mission.altitude_m, run.track
    if what == "planned":
        points, rows = planned_points(run)
        places = np.column_stack((points, np.full(len(points), held)))
    else:
        places = np.column_stack((track.east_m, track.north_m, track.up_m))
        rows = np.arange(len(track))
    kept = _simplified(places, tolerance_m)
    places, rows = places[kept], rows[kept]
    plane = plane_of(scenario)
    degrees = geodetic(plane, places[:, :2])
    curvature = max((plan.max_curvature_1pm for plan in run.plans), default=0.0)
    return ExportedPath(
        name=scenario.name,
        what=what,
        latitude_deg=degrees[:, 0],
        longitude_deg=degrees[:, 1],
        altitude_m=places[:, 2],
        points_m=places[:, :2],
        plane=plane,
        time_s=track.time_s[rows],
        started=datetime.fromisoformat(str(run.manifest["started_utc"])),
        attributes={}
        if what == "planned"
        else {name: np.asarray(getattr(track, name)[rows], dtype=np.float64) for name in ATTRIBUTES},
        held_altitude_m=held,
        airspeed_mps=scenario.aircraft.airspeed_mps,
        turn_radius_m=1.0 / curvature if curvature > 0.0 else np.inf,
    )


def geodetic(plane: LocalPlane, points_m: FloatArray) -> FloatArray:
    """(n, 2) latitude and longitude, degrees, of (n, 2) points in a plane."""
    return np.array([plane.geodetic(east, north) for east, north in points_m.tolist()]).reshape(-1, 2)


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
    simple = shapely.simplify(shapely.LineString(places_m), tolerance_m, preserve_topology=False)
    kept, row = [], 0
    for place in shapely.get_coordinates(simple, include_z=True):
        while not np.array_equal(places_m[row], place):
            row += 1
        kept.append(row)
        row += 1
    return np.array(kept, dtype=np.int64)
