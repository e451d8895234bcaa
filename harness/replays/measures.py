"""Measures that compare a flown with a simulated flight: laps, distance outside, bank, height, airspeed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from harness.files.input_file import InputError
from harness.flight.record import FloatArray

FIRST_SETTLED_LAP: Final = 2  # laps before are not compared: the autopilot has just been switched on
PASSED_M: Final = 5.0
"""Without a known radius, a corner passed within a quarter of the shortest leg counts as reached this far on."""
LONGEST_GAP_S: Final = 1.0  # a lap with a longer time between two rows, over thrice the usual, is not whole
FIGURES = {
    "outside_p95_m": "outside the corners, p95, m",
    "outside_max_mean_m": "mean of the largest of each lap, m",
    "lap_mean_s": "time of a lap, s",
    "bank_p95_deg": "bank, p95, deg",
    "roll_rate_p95_degps": "roll rate, p95, deg/s",
    "height_error_p95_m": "height error, p95, m",
    "airspeed_mean_mps": "airspeed, mean, m/s",
    "airspeed_p95_mps": "airspeed, p95, m/s",
}
"""Figures of `flown` and `simulated` in `replay.json`, with their names for people."""


def legs_of(columns: Mapping[str, FloatArray], corners_m: FloatArray, first: int, radius_m: float | None) -> FloatArray:
    """(n,) number of corners reached at each row of a flown flight, by its known targets, else by its places.

    `first` is the number of the corner that the first row heads for; one counts as reached from `radius_m`.
    """
    if "target_index" in columns:
        known = np.flatnonzero(columns["target_index"] >= 0.0)
        on, steps = np.diff(columns["target_index"][known]), np.zeros(len(columns["time_s"]))
        steps[known[1:]] = np.where(on != 0.0, np.maximum(on % len(corners_m), 1.0), 0.0)
        return np.cumsum(steps)
    near_m = 0.25 * float(np.hypot(*np.diff(corners_m, axis=0).T).min())
    found, reached, nearest_m = np.empty(len(columns["time_s"])), 0, np.inf
    for row, place in enumerate(zip(columns["east_m"], columns["north_m"], strict=True)):
        away_m = float(np.hypot(*(corners_m[(first + reached) % len(corners_m)] - place)))
        nearest_m = min(nearest_m, away_m)
        if away_m <= radius_m if radius_m is not None else nearest_m < min(near_m, away_m - PASSED_M):
            reached, nearest_m = reached + 1, np.inf
        found[row] = reached
    return found


@dataclass(frozen=True, eq=False)
class Replay:
    """A flown flight beside the same mission simulated: content of `replay.json`, columns of both, (k, 2) corners."""

    results: dict[str, Any]
    flown: Mapping[str, FloatArray]
    simulated: Mapping[str, FloatArray]
    corners_m: FloatArray
    folder: Path

    def __repr__(self) -> str:
        between = self.results["distance_between_m"]
        return f"Replay({self.results['log']}: tracks {between['p50']:.1f} m apart (median))"


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two flights that are compared."""

    columns: Mapping[str, FloatArray]
    """`time_s`, `east_m`, `north_m`, `up_m`, and `roll_deg`, `airspeed_mps` where they are known."""
    corners_m: FloatArray  # (k, 2) of the mission
    legs: FloatArray  # (n,) corners reached before each row
    laps: FloatArray  # (n,) number of the lap of each row
    height_m: float  # that was commanded
    begun: bool  # the first row is at the begin of its lap
    ended: bool  # the last row has come to the end of its lap

    @cached_property
    def outside(self) -> FloatArray:
        """(n,) distance beyond the polygon of the corners, 0 inside; of two corners the distance from their line."""
        import shapely

        corners = self.corners_m
        shape = shapely.Polygon(corners) if len(corners) > 2 else shapely.LineString(corners)
        points = shapely.points(self.columns["east_m"], self.columns["north_m"])
        return np.asarray(shapely.distance(shape, points))

    @cached_property
    def lacks(self) -> dict[int, str]:
        """What each settled lap lacks to be whole; "" where it was flown from begin to end, to every corner."""
        steps_s, found, corners = np.diff(self.columns["time_s"]), {}, len(self.corners_m)
        for lap in np.unique(self.laps[self.laps >= FIRST_SETTLED_LAP]).astype(int).tolist():
            rows = np.flatnonzero(self.laps == lap)
            flown = len(np.unique(self.legs[rows]))
            gap_s = float(steps_s[max(rows[0] - 1, 0) : rows[-1] + 1].max(initial=0.0))
            found[lap] = "" if flown >= corners else f"flies to {flown} of the mission's {corners} corners"
            if gap_s > max(LONGEST_GAP_S, 3.0 * float(np.median(steps_s))):
                found[lap] = f"has no row flown by the autopilot for {gap_s:.1f} s"
            if rows[-1] == len(steps_s) and not self.ended:
                found[lap] = "is not flown to its end"
            if rows[0] == 0 and not self.begun:
                found[lap] = "begins before the log"
        return found

    def figures(self, chosen: NDArray[np.bool_]) -> dict[str, float]:
        """Returns the figures of some rows."""
        every = {name: each[chosen] for name, each in self.columns.items()}
        columns = {name: each for name, each in every.items() if np.isfinite(each).any()}
        figures = _spread(self.outside[chosen])
        if "up_m" in columns and self.columns["up_m"].any():  # a log without heights has zeros
            figures["height_error_p95_m"] = _p95(np.abs(columns["up_m"] - self.height_m))
        if "roll_deg" in columns:
            figures["bank_p95_deg"] = _p95(np.abs(columns["roll_deg"]))
            rows = np.isfinite(self.columns["roll_deg"])
            rate = np.gradient(self.columns["roll_deg"][rows], self.columns["time_s"][rows])
            figures["roll_rate_p95_degps"] = _p95(np.abs(rate[chosen[rows]]))
        if "airspeed_mps" in columns:
            figures["airspeed_mean_mps"] = float(np.nanmean(columns["airspeed_mps"]))
            figures["airspeed_p95_mps"] = _p95(columns["airspeed_mps"])
        return figures

    def lap(self, lap: int) -> dict[str, Any]:
        """Returns the figures of one lap, with its time and how far outside it was after each of its corners."""
        chosen, times = self.laps == lap, self.columns["time_s"]
        rows = np.flatnonzero(chosen)
        end_s = times[rows[-1] + 1] if rows[-1] + 1 < len(times) else 2.0 * times[-1] - times[-2]
        corners = [_spread(self.outside[chosen & (self.legs == leg)]) for leg in np.unique(self.legs[chosen])]
        return {"time_s": float(end_s - times[rows[0]]), **self.figures(chosen), "corners": corners}

    def to_m(self, other: Side, lap: int) -> FloatArray:
        """(k,) distance of each row of a lap from the track of the other flight in that lap."""
        import shapely

        here, there = (np.column_stack((s.columns["east_m"], s.columns["north_m"])) for s in (self, other))
        track = shapely.LineString(there[other.laps == lap])
        return np.asarray(shapely.distance(track, shapely.points(here[self.laps == lap])))


def no_whole_lap(name: str, side: Side, otherwise: str = "") -> InputError:
    """Makes the error on a side without a whole settled lap: what the first ones lack, or `otherwise` without any."""
    why = "".join(f"; lap {lap} {lack}" for lap, lack in list(side.lacks.items())[:3] if lack) or otherwise
    return InputError(f"{name} has no whole lap after lap 1{why}; there is nothing to compare")


def compare(flown: Side, simulated: Side, end: str) -> dict[str, Any]:
    """Returns laps and figures of both flights; InputError, with its end, if the simulated one has no settled lap."""
    if not (settled := [lap for lap, lack in flown.lacks.items() if lack == simulated.lacks.get(lap) == ""]):
        raise no_whole_lap("the simulated flight", simulated, f"; it ended: {end}")
    rows: list[Any] = [{"lap": n, "flown": flown.lap(n), "simulated": simulated.lap(n)} for n in settled]
    results: dict[str, Any] = {"settled_laps": settled, "laps": rows}
    for name, side in (("flown", flown), ("simulated", simulated)):
        results[name] = side.figures(np.isin(side.laps, settled))
        results[name]["outside_max_mean_m"] = float(np.mean([row[name]["outside_max_m"] for row in rows]))
        results[name]["lap_mean_s"] = float(np.mean([row[name]["time_s"] for row in rows]))
    apart = np.concatenate([flown.to_m(simulated, lap) for lap in settled])
    results["distance_between_m"] = {"p50": float(np.median(apart)), "p95": float(np.percentile(apart, 95))}
    return results


def _spread(outside: FloatArray) -> dict[str, float]:
    return {"outside_p95_m": _p95(outside), "outside_max_m": float(outside.max())}


def _p95(values: FloatArray) -> float:
    return float(np.nanpercentile(values, 95))


def rows_of(results: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Returns name, flown, simulated and difference of each figure, as texts."""
    rows = []
    for name, label in FIGURES.items():
        if name in results["flown"] and name in results["simulated"]:
            flown, simulated = results["flown"][name], results["simulated"][name]
            share = f"{100 * (simulated / flown - 1):+.1f} %" if flown else "-"
            rows.append((label, f"{flown:.2f}", f"{simulated:.2f}", share))
    return rows
