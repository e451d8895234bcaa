"""Flies a guidance law along lines and arcs, in calm air and in wind, to find out how well it tracks with an aircraft.

It is flown at ever wider turns until it stays near them: planning then gives it turns of that radius, and keeps its
error from obstacles.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from aircraft.airframe import Airframe
from aircraft.envelope import performance
from aircraft.guidance.interface import GuidanceLaw
from aircraft.model_files import AircraftError
from aircraft.route import weave
from aircraft.trials import tracked

WIND_SHARES = (0.0, 0.3, 0.6)
"""Winds that are flown, along the weave and against it, over the airspeed."""
RADIUS_FACTORS = (1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0)
"""Turns are widened by these until the law tracks them."""
TRACKED_SHARE = 0.1
"""Cross-track error over turn radius up to which a law counts as tracking the turns."""
WAYPOINTS_TRACKED_SHARE = 1.0
"""The same where a law flies the legs between the corners of the turns, with all the bank there is at each. They are
not widened then: the wider the arc, the further its corner lies outside."""
CUT_SHARE = 0.05
"""Share of the time for which the bank may be cut meanwhile."""
SLOWEST_SHARE = 4.0
"""A weave is given up after this many times the time it takes."""

Make = Callable[[], GuidanceLaw]


def measured(frame: Airframe, kind: str, speed_mps: float, make: Make, waypoints: bool) -> dict[str, Any]:
    """The law's name, and `points`: the attributes of a `WindPoint` in every wind.

    Raises:
        AircraftError: the law does not track.
    """
    points: list[dict[str, float]] = []
    for share in WIND_SHARES:
        least = points[-1]["radius_factor"] if points else RADIUS_FACTORS[0]
        factors = RADIUS_FACTORS[:1] if waypoints else RADIUS_FACTORS
        for factor in (factor for factor in factors if factor >= least):
            error_m = _error_m(frame, speed_mps, make, waypoints, share * speed_mps, factor)
            if error_m is not None:
                break
        else:
            how = f" in a wind of {share:.0%} of the airspeed" if share else ""
            how += f" on a state {frame.files.latency_s:g} s old" if frame.files.latency_s else ""
            most = WAYPOINTS_TRACKED_SHARE if waypoints else TRACKED_SHARE
            raise AircraftError(
                f"the guidance law {kind} does not track with {frame.name}{how}: on turns of {factors[-1]:g} times "
                f"the radius that the aircraft needs it is off by more than {most:.0%} of the radius, or its bank "
                "is cut"
            )
        points.append({"wind_share": share, "radius_factor": factor, "error_m": float(f"{error_m:.3g}")})
    return {"kind": kind, "points": points}


def _error_m(
    frame: Airframe, speed_mps: float, make: Make, waypoints: bool, wind_mps: float, factor: float
) -> float | None:
    """Largest cross-track error (m) on the weave, along and against a wind; None if it is not tracked."""
    radius_m = factor * performance(frame, speed_mps, wind_mps).turn_radius_m
    worst_m = 0.0
    for north_mps in (wind_mps, -wind_mps) if wind_mps else (0.0,):
        route = weave(radius_m)
        most_s = SLOWEST_SHARE * float(route.segments[:, 5].sum()) / (speed_mps - abs(north_mps))
        error_m, cut = tracked(frame, speed_mps, make(), route, north_mps, most_s)
        if waypoints:
            kept = error_m <= WAYPOINTS_TRACKED_SHARE * radius_m
        else:
            kept = error_m <= TRACKED_SHARE * radius_m and cut <= CUT_SHARE
        if not kept:
            return None
        worst_m = max(worst_m, error_m)
    return worst_m
