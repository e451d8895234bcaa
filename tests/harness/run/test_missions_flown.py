"""Missions flown as their files have them: each waypoint on each lap, by its own acceptance radius, and loiters."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import wayproof
from tests.harness.run.given import Array, item, waypoints_file

SQUARE = [(0.0, 0.0), (0.0, 600.0), (600.0, 600.0), (600.0, 0.0)]


def flown(path: Path, law: str = "preview", follow: str = "waypoints") -> tuple[wayproof.FlightResult, Array]:
    run = wayproof.check(path, settings={"guidance.kind": law, "guidance.follow": follow})
    return run, np.column_stack((run.track["east_m"], run.track["north_m"]))


def minima(distances_m: Array) -> list[float]:
    """The local minima below 100 m, and the ends if they are."""
    padded = np.concatenate(([np.inf], distances_m, [np.inf]))
    low = (padded[1:-1] < padded[:-2]) & (padded[1:-1] <= padded[2:]) & (distances_m < 100.0)
    return [float(each) for each in distances_m[low]]


def test_a_square_flown_in_laps_keeps_its_corner_at_the_start_on_every_lap(tmp_path: Path) -> None:
    places = [*SQUARE * 5, (0.0, 0.0)]
    run, track = flown(waypoints_file(tmp_path, places))
    assert [each["what"] for each in run.metrics.to_dict()["check"]["items"]] == ["flown"] * 21
    for place in SQUARE:
        passes = minima(np.hypot(*(track - place).T))
        assert len(passes) == places.count(place)
        assert max(passes) < 60.0
    assert run.metrics.check is not None
    assert run.metrics.check.ok


@pytest.mark.parametrize("law", ["preview", "l1"])
@pytest.mark.parametrize("turn_deg", [30.0, 89.0, 90.000001, 91.0, 150.0, 180.0])
def test_a_waypoint_is_flown_to_by_its_own_acceptance_radius_whatever_the_turn(
    turn_deg: float, law: str, tmp_path: Path
) -> None:
    """With 10 m the aircraft, at 2.5 m a row, comes within that of the waypoint and no nearer than it has to."""
    turn = math.radians(turn_deg)
    places = [(0.0, 0.0), (0.0, 900.0), (900.0 * math.sin(turn), 900.0 + 900.0 * math.cos(turn))]
    run, track = flown(waypoints_file(tmp_path, places, acceptance_m=10.0), law)
    away = np.hypot(*(track - places[1]).T)
    rolled = np.abs(np.array(run.track["roll_command_deg"])) > 5.0
    begins = int(np.flatnonzero(rolled)[0])
    assert 4.0 < 900.0 - track[begins, 1] <= 10.0  # where it leaves the first leg
    assert away.min() <= 10.0
    assert run.outcome == "reached"


@pytest.mark.parametrize(("law", "heads_for_centre"), [("npfg", True), ("l1", True), ("preview", False)])
def test_a_loiter_is_joined_as_the_laws_autopilot_does_and_gone_round_as_often_as_its_item_says(
    law: str, heads_for_centre: bool, tmp_path: Path
) -> None:
    center, radius = np.array((0.0, 2500.0)), 150.0
    loiter = item(3, 0.0, 2500.0, command=18, params=(2, 0, radius))
    path = waypoints_file(tmp_path, [(0.0, 0.0), (0.0, 800.0)], more=[loiter, item(4, 2000.0, 2500.0)])
    run, track = flown(path, law)
    off = track - center
    near = np.hypot(*off.T) < 1.2 * radius
    coming = (track[:, 1] > 1000.0) & (track[:, 1] < center[1] - 3.2 * radius) & (track[:, 0] < radius)
    coming &= np.arange(len(track)) < np.flatnonzero(near)[0]
    # On the line to the centre, or on the tangent that begins at (0, 800) and touches the circle, flown clockwise.
    touch = math.asin(radius / (center[1] - 800.0))
    wanted = 0.0 if heads_for_centre else -np.tan(touch) * (track[coming, 1] - 800.0)
    assert np.abs(track[coming, 0] - wanted).max() < 3.0
    angle = np.unwrap(np.arctan2(off[near, 1], off[near, 0]))
    turns = (angle[0] - angle[-1]) / math.tau
    assert 2.0 < turns < 3.0
    assert any(
        ("heads for its centre" if heads_for_centre else "along a tangent") in each for each in notes(run)
    )
    assert run.metrics.check is not None
    assert run.metrics.check.ok


def notes(run: wayproof.FlightResult) -> list[str]:
    every: list[str] = run.metrics.to_dict()["check"]["notes"]
    return every
