"""The figures of one flight, the content of `metrics.json`: pure functions of what was flown and asked."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.analysis import smoothness
from harness.analysis.causes import saturated
from harness.analysis.deviation import error_figures
from harness.analysis.findings import findings
from harness.analysis.flight_limits import AsGiven, FlightLimits
from harness.analysis.registry import METRICS
from harness.analysis.trackability import legs
from harness.flight.record import Flight, FloatArray, Outcome, Track, digest


def metrics(flight: Flight, limits: FlightLimits, given: AsGiven | None = None) -> dict[str, Any]:
    """All figures of a flight, ready for JSON: a figure that does not exist is None, never NaN or infinity.

    `min_clearance_m` is that of the rows, or at a contact between the last two. Cross-track figures are of the rows
    flown under a plan, altitude figures of all rows, all of the true position. Errors have the names of performance-
    based navigation (ICAO Doc 9613): `total_system_error_m` is how far the true position is off the path,
    `flight_technical_error_m` how far the believed one is. `navigation_jump_m`: the most that the navigation error
    changes from row to row, as a vector. `clearance_violation_s` counts the intervals at whose end the distance to an
    obstacle edge was below the wanted clearance. `compute_ms` is processor time of all calls in which the planner
    searched, `timing.planner_wall_ms` the wall-clock time of the same. A ValueError says that the track is empty.
    """
    if not len(track := flight.track):
        raise ValueError("a flight without a track has no metrics")
    nearest_m = track.clearance_m.copy()
    nearest_m[-1] = min(nearest_m[-1], flight.contact_m)
    window = smoothness.window_m(track)
    planned = smoothness.planned_profile(track, flight.plans, window)
    lost = flight.reason if flight.outcome is Outcome.LOST_CONTROL else None
    verdicts = legs(track, flight.plans, limits, lost, given)
    load = float(track.load_factor.max())
    return {
        "outcome": flight.outcome.value,
        "reason": flight.reason,
        "flown_length_m": float(smoothness.flown_lengths(track).sum()),
        "planned_length_m": _planned_length_m(flight),
        "flight_time_s": float(track.time_s[-1] - track.time_s[0]),
        "min_clearance_m": least_known(nearest_m),
        "min_altitude_above_ground_m": least_known(track.altitude_above_ground_m),
        "ground_known_fraction": float(np.isfinite(track.altitude_above_ground_m).mean()),
        "clearance_violation_s": time_below_s(track, nearest_m, limits.clearance_m),
        **_path_errors(track),
        **_navigation(track, limits),
        "altitude_error_m": error_figures(track.up_m - (given.altitude_m if given else limits.altitude_m)),
        "smoothness": {
            "planned": dataclasses.asdict(smoothness.smoothness(planned, window)),
            "flown": dataclasses.asdict(smoothness.smoothness(smoothness.flown_profile(track), window)),
        },
        "bank_saturation_fraction": float(saturated(track, limits.bank_limit_rad).mean()),
        "max_load_factor": load if math.isfinite(load) else None,
        "trackable": bool(verdicts) and all(leg.trackable for leg in verdicts),
        "trackability": [dict(vars(leg)) for leg in verdicts],
        "findings": [dataclasses.asdict(each) for each in findings(flight, limits)],
        **{metric.path: metric.of(flight, limits) for metric in METRICS if metric.of is not None},
        "replans": max(len(flight.plans) - 1, 0),
        "shield": flight.shield and dataclasses.asdict(flight.shield),
        "plan_delay_s": percentiles(list(filter(math.isfinite, (plan.delay_s for plan in flight.plans)))),
        "compute_ms": percentiles(flight.compute_ms),
        "timing": {
            "sim_s": flight.sim_s,
            "wall_s": flight.wall_s,
            "realtime_factor": flight.sim_s / flight.wall_s if flight.wall_s > 0 else None,
            "planner_wall_ms": percentiles(flight.compute_wall_ms),
        },
        "digest": digest(track),
        "error": flight.error,
    }


def time_below_s(track: Track, nearest_m: FloatArray, wanted_m: float) -> float:
    """Returns how long distances (n,) of the rows were below the wanted one: the intervals at whose end they were."""
    return float(np.diff(track.time_s)[nearest_m[1:] < wanted_m].sum())


def _path_errors(track: Track) -> dict[str, Any]:
    """Returns the figures of how far the true and the believed positions were off the path, while a plan was flown."""
    under_plan = track.plan_index >= 0
    believed_m = track.believed_cross_track_m if track.has_beliefs else track.cross_track_m
    total = error_figures(track.cross_track_m[under_plan])
    technical = error_figures(believed_m[under_plan])
    return {"cross_track_m": total, "total_system_error_m": {**total}, "flight_technical_error_m": technical}


def _navigation(track: Track, limits: FlightLimits) -> dict[str, Any]:
    """Returns how far off the believed position was, and the margin for it; nothing if navigation is perfect."""
    if not track.has_beliefs:
        return {}
    east_m, north_m = track.believed_east_m - track.east_m, track.believed_north_m - track.north_m
    return {
        "navigation_error_m": error_figures(track.navigation_error_m),
        "navigation_jump_m": float(np.nanmax(np.hypot(np.diff(east_m), np.diff(north_m)), initial=0.0)),
        "navigation_margin_m": limits.navigation_margin_m,
    }


def percentiles(values: Sequence[float]) -> dict[str, float | None]:
    """Median, 99th percentile and maximum of times, in their unit; None without any."""
    if not values:
        return {"p50": None, "p99": None, "max": None}
    p50, p99 = np.percentile(values, (50, 99))
    return {"p50": float(p50), "p99": float(p99), "max": max(values)}


def _planned_length_m(flight: Flight) -> float:
    """Length of the planned curve that was in effect: progress along each plan while it was flown, up to its end."""
    flown_m = 0.0
    for index, start, end in smoothness.stations_in_effect(flight.track):
        flown_m += max(min(end, flight.plans[index].length_m) - start, 0.0)
    return flown_m


def least_known(values: FloatArray) -> float | None:
    """Returns the least of those values that are known; None without any."""
    known = values[np.isfinite(values)]
    return float(known.min()) if len(known) else None
