"""What of a flown and a simulated flight is set side by side: laps, outside, bank, height, airspeed, distance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.flight.record import FloatArray
from harness.replay.flown import FlownFlight
from harness.replay.mission import FlownMission

BEFORE_SETTLED = 1
"""Laps up to this number are not settled: the autopilot has just been switched on."""

Columns = Mapping[str, FloatArray]


def outside_m(columns: Columns, corners_m: FloatArray) -> FloatArray:
    """(n,) distance beyond the polygon of the corners, 0 inside; of two corners the distance from their line."""
    import shapely

    shape = shapely.Polygon(corners_m) if len(corners_m) > 2 else shapely.LineString(corners_m)
    found: FloatArray = shapely.distance(shape, shapely.points(columns["east_m"], columns["north_m"]))
    return found


def legs_of(flight: FlownFlight, mission: FlownMission, first: int) -> FloatArray:
    """(n,) how many corners had been reached before each row: by the log's targets, else by its places."""
    if "target_index" in flight:
        changed = np.diff(flight["target_index"], prepend=flight["target_index"][0]) != 0.0
        return np.cumsum(changed).astype(np.float64)
    radius = mission.acceptance_m
    corners, target, reached = mission.corners_m, first, 0
    found = np.empty(len(flight["time_s"]))
    nearest = np.inf
    for row, place in enumerate(zip(flight["east_m"], flight["north_m"], strict=True)):
        away = float(np.hypot(*(corners[target] - place)))
        nearest = min(nearest, away)
        passed = away > nearest + 5.0 and nearest < 0.25 * _span_m(corners)
        if (radius is not None and away <= radius) or (radius is None and passed):
            target, reached, nearest = (target + 1) % len(corners), reached + 1, np.inf
        found[row] = reached
    return found


def _span_m(corners_m: FloatArray) -> float:
    return float(np.hypot(*np.diff(corners_m, axis=0).T).min())


def lap_numbers(legs: FloatArray, first: int, corners: int, number: int) -> FloatArray:
    """(n,) number of the lap of each row: a new one begins once corner 0 is reached.

    Args:
        legs: corners reached before each row.
        first: corner that the first row heads for.
        corners: how many there are.
        number: of the first lap.
    """
    before = (first - 1) % corners
    return number + np.floor((legs + before) / corners)


def whole_laps(laps: FloatArray, legs: FloatArray, corners: int, ended: bool) -> list[int]:
    """The laps of which every corner was flown to, that are settled.

    Args:
        laps: number of the lap of each row.
        legs: corners reached before each row.
        corners: how many there are.
        ended: the last row has come to the end of its lap.
    """
    found = []
    for lap in np.unique(laps).astype(int).tolist():
        flown = legs[laps == lap]
        reached = flown[-1] - flown[0] + 1
        is_last = lap == laps[-1]
        if lap > BEFORE_SETTLED and reached >= corners and (not is_last or ended):
            found.append(lap)
    return found


def figures(
    columns: Columns, outside: FloatArray, chosen: NDArray[np.bool_], height_m: float
) -> dict[str, Any]:
    """What is told of some rows.

    Args:
        columns: of the flight.
        outside: of every row.
        chosen: whether a row is among them.
        height_m: that was commanded.
    """
    rows = np.flatnonzero(chosen)
    told: dict[str, Any] = {
        "outside_p95_m": _p95(outside[rows]),
        "outside_max_m": float(outside[rows].max()),
        "height_error_p95_m": _p95(np.abs(columns["up_m"][rows] - height_m)),
    }
    if "roll_deg" in columns:
        rate = np.gradient(columns["roll_deg"], columns["time_s"])
        told["bank_p95_deg"] = _p95(np.abs(columns["roll_deg"][rows]))
        told["roll_rate_p95_degps"] = _p95(np.abs(rate[rows]))
    if "airspeed_mps" in columns:
        told["airspeed_mean_mps"] = float(np.nanmean(columns["airspeed_mps"][rows]))
        told["airspeed_p95_mps"] = _p95(columns["airspeed_mps"][rows])
    return told


def lap_figures(
    columns: Columns, outside: FloatArray, laps: FloatArray, legs: FloatArray, lap: int, height_m: float
) -> dict[str, Any]:
    """The same of one lap, with its time and how far outside it was after each of its corners."""
    chosen = laps == lap
    rows = np.flatnonzero(chosen)
    times = columns["time_s"]
    end_s = times[rows[-1] + 1] if rows[-1] + 1 < len(laps) else times[-1] + (times[-1] - times[-2])
    corners = [
        {"outside_p95_m": _p95(outside[on]), "outside_max_m": float(outside[on].max())}
        for on in (chosen & (legs == leg) for leg in np.unique(legs[chosen]).tolist())
    ]
    return {
        "time_s": float(end_s - times[rows[0]]),
        **figures(columns, outside, chosen, height_m),
        "corners": corners,
    }


def between_m(
    flown: Columns, simulated: Columns, of_flown: NDArray[np.bool_], of_simulated: NDArray[np.bool_]
) -> FloatArray:
    """(n,) distance of flown rows of a lap from the simulated track of that lap."""
    import shapely

    track = shapely.LineString(
        np.column_stack((simulated["east_m"], simulated["north_m"]))[np.flatnonzero(of_simulated)]
    )
    rows = np.flatnonzero(of_flown)
    found: FloatArray = shapely.distance(track, shapely.points(flown["east_m"][rows], flown["north_m"][rows]))
    return found


def _p95(values: FloatArray) -> float:
    return float(np.nanpercentile(values, 95))
