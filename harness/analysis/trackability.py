"""Which parts of what was planned could be tracked, and why the others could not.

A plan is trackable where the true position stayed within `FlightLimits.cross_track_threshold_m` of it. A given path is
judged as given, corner by corner, not by the arcs that were made of it. Altitude, airspeed and load factor have limits
of their own. No limit depends on who flies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.analysis import causes
from harness.analysis.deviation import CORNER_REACH
from harness.analysis.findings import is_past_end
from harness.analysis.flight_limits import LOAD_AVERAGED_S, SPEED_AVERAGED_S, AsGiven, FlightLimits
from harness.analysis.in_force import InForce
from harness.flight.record import AcceptedPlan, FloatArray, IntArray, Track

SHORTEST_LEG_S = 5.0  # a plan flown for less time is judged together with its successor


@dataclass(frozen=True, kw_only=True)
class Leg:
    """A stretch of flight under one plan, and the verdict on it.

    Errors are absolute; airspeed is averaged over `SPEED_AVERAGED_S` (None where it is not judged), load factor over
    `LOAD_AVERAGED_S`. `threshold_m` is what the cross-track error may be. On a given path `waypoint` is the number of
    the point that the leg leads to, `corner_cut_m` how far from the corner there the plan passes, `max_deviation_m`
    the largest distance from it. Of several limits that were exceeded the first is the cause: control lost, cross-
    track error or distance from the path as given, load factor, airspeed, altitude.
    """

    start_s: float
    end_s: float
    max_cross_track_m: float
    threshold_m: float
    max_altitude_error_m: float
    max_airspeed_error_mps: float | None
    max_load_factor: float
    waypoint: int | None = None
    corner_cut_m: float = 0.0
    max_deviation_m: float | None = None
    trackable: bool
    cause: str | None


def legs(
    track: Track,
    plans: Sequence[AcceptedPlan],
    limits: FlightLimits,
    lost: str | None = None,
    given: AsGiven | None = None,
) -> tuple[Leg, ...]:
    """Judges a flight leg by leg; empty where no plan was flown.

    A leg is flown under one plan, or of a given path lies between two of its corners; a short one joins the next.
    `plans[i]` is the plan of rows with `plan_index` i, and `given` the path that the only plan follows, if there was
    one. `lost` says why control was lost at the end of the flight, whose last leg is then not trackable.
    """
    force = InForce.of(track, limits, given.airspeed_mps if given else None)
    flown = _Flown(track, plans, limits, force, given)
    past_end = is_past_end(track, plans, limits)
    ends_m = [corner.arc_length_m for corner in given.corners] if given else []
    stretches = _stretches(track, track.plan_index + np.searchsorted(ends_m, track.arc_length_m))
    judged = flown.as_given(stretches) if given else [flown.leg(*rows) for rows in stretches]
    for number, (first, last) in enumerate(stretches):
        if past_end[first : last + 1].any():
            judged[number] = replace(judged[number], trackable=False, cause=causes.PLAN_ENDED)
    if lost is not None and judged and stretches[-1][1] == len(track) - 1:
        cause = "stall" if "stalled" in lost else "lost control"
        judged[-1] = replace(judged[-1], trackable=False, cause=cause)
    return tuple(judged)


def _stretches(track: Track, leg: IntArray) -> list[tuple[int, int]]:
    """First and last row of every leg, by its number (n,); a short one joins the next, a short last one that before."""
    if not len(flown := np.flatnonzero(track.plan_index >= 0)):
        return []
    joined: list[tuple[int, int]] = []
    first = int(flown[0])
    for end in [*(1 + np.flatnonzero(np.diff(leg[flown]))).tolist(), len(flown)]:
        if track.time_s[last := int(flown[end - 1])] - track.time_s[first] >= SHORTEST_LEG_S:
            joined.append((first, last))
            first = last + 1
    if first <= flown[-1]:
        joined.append((joined.pop()[0] if joined else first, int(flown[-1])))
    return joined


@dataclass(frozen=True, eq=False)
class _Flown:
    """A flight that is judged: its track and plans, the limits, what was in force, and the path that was given."""

    track: Track
    plans: Sequence[AcceptedPlan]
    limits: FlightLimits
    force: InForce
    given: AsGiven | None

    def leg(self, first: int, last: int) -> Leg:
        """Judges a leg by its plan; a leg of a given path by altitude, airspeed and load factor alone."""
        leg, limits, given = self.track.part(first, last + 1), self.limits, self.given
        rows = slice(first, last + 1)
        high = leg.up_m - (given.altitude_m[rows] if given else limits.altitude_m)
        judged = given is not None or math.isfinite(limits.airspeed_mps)
        fast = leg.airspeed_mps - (self.force.commanded_mps[rows] if judged else math.nan)
        mean_fast = causes.averaged(fast, leg, SPEED_AVERAGED_S)
        off, slow = np.nan_to_num(np.abs(leg.cross_track_m)), np.abs(mean_fast)
        loads = causes.averaged(leg.load_factor, leg, LOAD_AVERAGED_S)
        cause = None
        if given is None and off.max() > limits.cross_track_threshold_m:
            cause = self._cross_track_cause(first + int(off.argmax()))
        elif loads.max() > limits.max_load_factor:
            cause = self._steep_cause(first + int(loads.argmax()), len(leg) - len(loads) + 1) or "load factor"
        elif slow.max() > limits.max_airspeed_error_mps:
            at = int(slow.argmax())
            cause = self._speed_cause(first + at, len(leg) - len(slow) + 1, float(mean_fast[at]))
        elif np.abs(high).max() > limits.max_altitude_error_m:
            cause = self._altitude_cause(leg, high, first)
        return Leg(
            start_s=float(leg.time_s[0]),
            end_s=float(leg.time_s[-1]),
            max_cross_track_m=float(off.max()),
            threshold_m=limits.cross_track_threshold_m,
            max_altitude_error_m=float(np.abs(high).max()),
            max_airspeed_error_mps=float(slow.max()) if np.isfinite(slow.max()) else None,
            max_load_factor=float(loads.max()),
            trackable=cause is None,
            cause=cause,
        )

    def _cross_track_cause(self, peak: int) -> str:
        """Names the cause for which the aircraft is off its plan at a row: a navigation error, or else the flight."""
        off_m, believed_m = self.track.cross_track_m[peak], self.track.believed_cross_track_m[peak]
        if self._is_misled(abs(off_m), abs(believed_m), self.limits.cross_track_threshold_m, peak):
            return causes.NAVIGATION_ERROR
        return causes.cross_track_cause(self.track, peak, self.plans, self.limits, self.force)

    def _is_misled(self, off_m: float, believed_m: float, most_m: float, peak: int) -> bool:
        """Whether what is beyond the limit, or most of the error, is navigation's, or was before a fix came back."""
        time_s, off = self.track.time_s, self.track.cross_track_m
        within = np.flatnonzero(np.abs(off[:peak]) <= most_m)
        first = np.searchsorted(time_s, time_s[within[-1] if len(within) else 0] - causes.LEAD_S)
        led_m = np.sign(off[peak]) * (off - self.track.believed_cross_track_m)[first : peak + 1]
        return believed_m <= most_m or bool((2.0 * led_m >= off_m).any())

    def _altitude_cause(self, leg: Track, high_m: FloatArray, first: int) -> str:
        """Names the cause for which a leg is off its altitude by this, at the row where it is most."""
        row = int(np.abs(high_m).argmax())
        believed = leg.believed_up_m - (leg.up_m - high_m)
        if abs(believed[row]) <= max(self.limits.max_altitude_error_m, abs(high_m[row] - believed[row])):
            return causes.NAVIGATION_ERROR
        return causes.altitude_cause(self.track, first + row, self.limits, self.given)

    def _speed_cause(self, first: int, rows: int, fast_mps: float) -> str:
        """Names the cause for a mean airspeed that is too high by this: the path's slope or speed, or the flight."""
        if steep := self._steep_cause(first, rows):
            return steep
        unheld_mps = np.broadcast_to(self.given.unheld_mps if self.given else 0.0, len(self.track))
        if unheld_mps[first : first + rows].mean() > self.limits.max_airspeed_error_mps:
            return "speed or throttle saturation"
        return causes.speed_cause(self.track.part(first, first + rows), fast_mps, self.limits)

    def _steep_cause(self, first: int, rows: int) -> str | None:
        """Returns the cause that the path was too steep over the rows of a mean or just before; else None."""
        time_s = self.track.time_s
        since = int(np.searchsorted(time_s, time_s[first] - causes.LEAD_S))
        return causes.steepness_cause(self.track, since, first + rows, self.given)

    def as_given(self, stretches: Sequence[tuple[int, int]]) -> list[Leg]:
        """Legs of a given path, which are not trackable either where they are too far from it.

        All of a corner belongs to the leg that it ends.
        """
        given = self.given
        assert given is not None
        along = np.maximum.accumulate(np.nan_to_num(self.track.arc_length_m))
        reached = np.searchsorted(along, [corner.arc_length_m for corner in given.corners]) - 1
        judged, over_m = [], -math.inf
        for first, last in stretches:
            leg = self.leg(first, last)
            passed = [c for c, row in zip(given.corners, reached, strict=True) if first <= row <= last]
            ends = passed and last < stretches[-1][1]  # beyond it may lie a last leg that was too short
            since_m, over_m = over_m, passed[-1].arc_length_m + passed[-1].half_m if ends else math.inf
            rows = np.flatnonzero((along > since_m) & (along <= over_m))
            off, cause = np.nan_to_num(given.deviation_m[rows]), leg.cause
            if len(rows) and (excess := off - given.allowed_m[rows]).max() > 0.0:
                cause = self._cause_off_given(given, int(rows[excess.argmax()]))
            waypoint, off_m = passed[-1].waypoint if passed else None, float(off.max(initial=0.0))
            cut_m = max((corner.cut_m for corner in passed), default=0.0)
            found = replace(leg, waypoint=waypoint, corner_cut_m=cut_m, max_deviation_m=off_m)
            judged.append(replace(found, trackable=cause is None, cause=cause))
        return judged

    def _cause_off_given(self, given: AsGiven, worst: int) -> str:
        """Names the cause for which the aircraft is too far off the path as given, at the row where that is worst."""
        track, believed_m = self.track, given.believed_off_m
        allowed_m, along_m = float(given.allowed_m[worst]), float(track.arc_length_m[worst])
        off_m = float(given.deviation_m[worst])
        if believed_m is not None and self._is_misled(off_m, believed_m[worst], allowed_m, worst):
            return causes.NAVIGATION_ERROR
        wide = False
        for corner in given.corners:
            reach_m = max(corner.half_m, CORNER_REACH * allowed_m)
            after_m = reach_m + causes.LEAD_S * float(track.groundspeed_mps[worst])
            if -reach_m <= along_m - corner.arc_length_m <= after_m:
                most_m = max(allowed_m, corner.allowed_cut_m)
                if cause := causes.corner_cause(corner, most_m, worst, self.force):
                    return cause
                wide |= corner.turn_deg != 0.0
        return causes.cross_track_cause(track, worst, self.plans, self.limits, self.force, wide)
