"""What came of a path that was flown: the content of its `metrics.json`."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from aircraft.guidance.altitude import slewed
from harness.analysis.as_given import AsGiven
from harness.analysis.breaches import Kept, kept
from harness.analysis.deviation import Deviation, allowed_m, deviation, distances_m
from harness.analysis.flight_limits import FlightLimits
from harness.analysis.metrics import error_figures, metrics
from harness.analysis.smoothness import polyline_profile, smoothness
from harness.flight.record import Flight, Outcome, Track
from harness.run.path_layers import layer_contacts
from harness.run.path_verdict import verdict
from harness.run_files.given_path import SAME_PLACE_M, CutCorner, FloatArray
from harness.world.world import World

if TYPE_CHECKING:
    from harness.run.path_check import PathCheck
    from harness.run.path_plan import PathPlan

SPACING_SHARE = 0.25
"""Points along the given path are measured so close together, in thresholds of the cross-track error."""

WINDOW_RADII = 4.0
"""Track and path are compared where they are no further apart than this along the path, in turn radii."""


@dataclass(frozen=True)
class _Corner:
    """A corner and what it may be cut by."""

    corner: CutCorner
    allowed_cut_m: float

    @property
    def waypoint(self) -> int:
        return self.corner.waypoint

    @property
    def arc_length_m(self) -> float:
        return self.corner.arc_length_m

    @property
    def turn_deg(self) -> float:
        return self.corner.turn_deg

    @property
    def cut_m(self) -> float:
        return self.corner.cut_m

    @property
    def half_m(self) -> float:
        return self.corner.half_m


def measured(check: PathCheck, flight: Flight, limits: FlightLimits) -> dict[str, Any]:
    """The content of `metrics.json` of a path that was flown.

    On top of what a flight has: `deviation_from_given_m`, `contact`, `breaches`, and under `check` the verdict, the
    corners that had to be cut, what was given, and what became of the items of a mission.

    Args:
        check: what was asked.
        flight: what was flown.
        limits: what it is measured against.
    """
    track, tolerance, way = flight.track, limits.cross_track_threshold_m, check.plan.way
    corners = [_Corner(corner, check.allowed_cut_m(corner.waypoint)) for corner in way.corners]
    window_m = WINDOW_RADII * limits.turn_radius_m
    found = deviation(track, way.given_m, SPACING_SHARE * tolerance, window_m)
    allowed = allowed_m(track, tolerance, corners)
    figures = metrics(flight, limits, _as_given(check.plan, track, corners, found.by_row_m, allowed))
    others = layer_contacts(track, check.scenario, check.files)
    seen = kept(track, World.from_scenario(check.scenario), check.given.fences, check.bounded, others)
    if seen.contacts and flight.outcome is not Outcome.COLLISION:
        first = seen.contacts[0]
        figures["outcome"] = Outcome.COLLISION.value
        figures["reason"] = f"touched {first.name} after {first.start_s:.0f} s; {flight.reason}"
    figures["trackable"] = figures["trackable"] and figures["outcome"] == Outcome.REACHED.value
    speed = max(float(track.groundspeed_mps.mean()), 1e-3)
    ok, sentence = verdict(figures, seen, check.given.drawn, tolerance)
    mission = check.given.mission
    return {
        **figures,
        "total_system_error_m": error_figures(found.rows_m),
        "flight_technical_error_m": error_figures(_believed_off_m(track, way.given_m, window_m, found)),
        **_kept_figures(seen),
        "deviation_from_given_m": found.figures(),
        "check": {
            "ok": ok,
            "verdict": sentence,
            "drawn": check.given.drawn,
            "points": len(check.given.points_m),
            "given": dataclasses.asdict(smoothness(polyline_profile(_line(check.plan), speed), speed)),
            "corners": [_passed(corner, flight, found.by_row_m) for corner in corners],
            "fences": [fence.plain() for fence in check.given.fences.every],
            "items": [dataclasses.asdict(told) for told in mission.program.items] if mission else [],
            "notes": [*check.given.notes, *check.plan.notes],
        },
    }


def _believed_off_m(track: Track, given_m: FloatArray, window_m: float, found: Deviation) -> FloatArray:
    """(n,) how far off the path as given the aircraft believed to be, where its true distance is known."""
    if not track.has_beliefs:
        return found.rows_m
    rows = np.isfinite(found.rows_m)
    believed = np.column_stack((track.believed_m[rows, :2], np.maximum.accumulate(track.arc_length_m[rows])))
    return distances_m(believed, given_m, window_m)


def _line(plan: PathPlan) -> FloatArray:
    """(k, 2) the line that was given: of a mission with its circles."""
    if not plan.marks:
        return plan.way.waypoints_m
    line = plan.way.given_m[:, :2]
    apart = np.hypot(*np.diff(line, axis=0).T) > SAME_PLACE_M
    kept: FloatArray = line[np.append(True, apart)]
    return kept


def _as_given(
    plan: PathPlan, track: Track, corners: list[_Corner], deviation_m: FloatArray, allowed: FloatArray
) -> AsGiven:
    """What the path asks for, row by row."""
    along = np.nan_to_num(track.arc_length_m)
    profile = plan.profile
    asked = np.searchsorted(profile.speed_from_m, along, side="right") - 1
    speeds = slewed(plan.asked_mps[np.maximum(asked, 0)], track.time_s)
    if profile.level:
        fastest = np.full((len(track), 2), np.inf)
    else:
        rates = {speed: plan.climb_mps(speed) for speed in set(profile.airspeed_mps.tolist())}
        fastest = np.array([rates[speed] for speed in profile.airspeeds(along).tolist()]).reshape(-1, 2)
    return AsGiven(
        _ends(plan, corners),
        deviation_m,
        allowed,
        altitude_m=profile.altitudes(along),
        climb_mps=profile.slopes(along) * track.groundspeed_mps,
        fastest_mps=fastest,
        airspeed_mps=speeds,
    )


def _ends(plan: PathPlan, corners: list[_Corner]) -> list[_Corner]:
    """Where legs end: at every item of a mission; at the corners of a drawn line, and where its slope changes."""
    known = {(corner.waypoint, round(corner.arc_length_m, 3)): corner for corner in corners}
    ends = [] if plan.marks else corners.copy()
    for number, along in plan.marks or plan.bends:
        plain = _Corner(CutCorner(number, 0.0, 0.0, 0.0, 0.0, 0.0, along, 0.0), 0.0)
        corner = known.get((number, round(along, 3)), plain)
        ends += [corner] if plan.marks or corner is plain else []
    return sorted(ends, key=lambda each: each.arc_length_m)


def _kept_figures(seen: Kept) -> dict[str, Any]:
    return {
        "min_clearance_m": seen.margin_m if np.isfinite(seen.margin_m) else None,
        "contact": bool(seen.contacts),
        "contacts": [each.plain() for each in seen.contacts],
        "breaches": [each.plain() for each in seen.crossings],
        **({} if seen.height_m is None else {"height_above_ground_m": seen.height_m}),
    }


def _passed(corner: _Corner, flight: Flight, deviation_m: FloatArray) -> dict[str, Any]:
    """What is told of a corner; `flown_cut_m` is None where the aircraft did not get there."""
    track, place = flight.track, corner.corner
    about = np.abs(track.arc_length_m - corner.arc_length_m) <= corner.half_m + corner.allowed_cut_m
    away_m = np.hypot(track.east_m - place.east_m, track.north_m - place.north_m)[about]
    flown = float(away_m.min()) if len(away_m) else None
    off = np.nan_to_num(deviation_m[np.abs(track.arc_length_m - corner.arc_length_m) <= corner.half_m])
    most = float(off.max(initial=flown or 0.0))
    return {
        **dataclasses.asdict(place),
        "flown_cut_m": flown,
        "most_off_m": most,
        "allowed_cut_m": corner.allowed_cut_m,
        "kept": flown is not None and most <= corner.allowed_cut_m,
    }
