"""The path of a run folder, for other tools: what was flown, or what was planned while it was."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aircraft.frames import LocalPlane
from harness.flight.record import FloatArray
from harness.run_files.plans_table import PlanRow
from harness.run_files.run_folder import Run
from harness.scenario.scenario import parse_scenario

FORWARD_M = 0.5
"""A point that is not further on than this is left out; where a plan takes over, progress is counted anew."""


@dataclass(frozen=True, eq=False)
class ExportedPath:
    """A path on the WGS84 ellipsoid.

    Attributes:
        name: of the run's scenario.
        what: "flown" or "planned".
        latitude_deg: (n,) geodetic.
        longitude_deg: (n,).
        altitude_m: (n,) above mean sea level.
        held_altitude_m: the altitude to be held.
        airspeed_mps: the true airspeed to be held.
    """

    name: str
    what: str
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    altitude_m: FloatArray
    held_altitude_m: float
    airspeed_mps: float


def path_of(run: Run, what: str, tolerance_m: float) -> ExportedPath:
    """The path of a run with no more points than it takes.

    Args:
        run: the run.
        what: "flown": the track; "planned": of every plan the part that was in effect.
        tolerance_m: how far a point that is left out may be from the path, seen from above.
    """
    scenario = parse_scenario(run.scenario_yaml, str(run.folder / "scenario.yaml"))
    held = scenario.mission.altitude_m
    if what == "planned":
        points = planned_points(run)
        places = np.column_stack((points, np.full(len(points), held)))
    else:
        places = np.column_stack((run.track.east_m, run.track.north_m, run.track.up_m))
    kept = _simplified(places, tolerance_m)
    origin = scenario.area.origin
    degrees = geodetic(LocalPlane(origin.latitude_deg, origin.longitude_deg), kept[:, :2])
    return ExportedPath(
        name=scenario.name,
        what=what,
        latitude_deg=degrees[:, 0],
        longitude_deg=degrees[:, 1],
        altitude_m=kept[:, 2],
        held_altitude_m=held,
        airspeed_mps=scenario.aircraft.airspeed_mps,
    )


def geodetic(plane: LocalPlane, points_m: FloatArray) -> FloatArray:
    """(n, 2) latitude and longitude, degrees, of (n, 2) points in a plane."""
    return np.array([plane.geodetic(east, north) for east, north in points_m.tolist()]).reshape(-1, 2)


def planned_points(run: Run) -> FloatArray:
    """(n, 2) east and north of the plan in effect, row by row of the track; empty where nothing was planned."""
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
    return points[kept]


def _on_plan(plan: PlanRow, arc_length_m: FloatArray) -> FloatArray:
    """(k, 2) points of a plan at (k,) stations, clamped to its ends."""
    chord = np.append(0.0, np.cumsum(np.hypot(*np.diff(plan.path_m, axis=0).T)))
    # The chords are a little shorter than the arcs that stations are counted along.
    along = chord * (plan.length_m / chord[-1])
    return np.column_stack([np.interp(arc_length_m, along, plan.path_m[:, axis]) for axis in (0, 1)])


def _simplified(places_m: FloatArray, tolerance_m: float) -> FloatArray:
    """(k, 3) those of (n, 3) places that a line within a tolerance needs (Douglas and Peucker, 1973)."""
    import shapely

    if len(places_m) < 2:
        return places_m
    line = shapely.LineString(places_m)
    simple = shapely.simplify(line, tolerance_m, preserve_topology=False)
    return np.asarray(shapely.get_coordinates(simple, include_z=True))
