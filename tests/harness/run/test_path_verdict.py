"""The verdict on given paths, held against distances that numpy finds between the flown track and the drawn line."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wayproof
from tests.harness.run.given import off_polyline_m, waypoints_file

SQUARE = [(0.0, 0.0), (0.0, 600.0), (600.0, 600.0), (600.0, 0.0), (0.0, 0.0)]
BY_WAYPOINTS = {"guidance.follow": "waypoints"}


def flown(path: Any, **options: Any) -> tuple[dict[str, Any], np.ndarray[Any, Any]]:
    """The metrics, and (n, 2) the flown track."""
    run = wayproof.check(path, **options)
    return run.metrics.to_dict(), np.column_stack((run.track["east_m"], run.track["north_m"]))


@pytest.mark.parametrize("law", ["preview", "l1", "npfg"])
def test_a_missions_corners_have_one_limit_whoever_flies(law: str, tmp_path: Path) -> None:
    """Limits of 10 m and, at corners, 90 m: what each law is off is measured to the four legs."""
    path = waypoints_file(tmp_path, SQUARE)
    metrics, track = flown(path, settings={**BY_WAYPOINTS, "guidance.kind": law})
    assert {leg["threshold_m"] for leg in metrics["trackability"]} == {10.0}
    corners = metrics["check"]["corners"]
    assert [(corner["waypoint"], corner["allowed_cut_m"]) for corner in corners] == [
        (2, 90.0),
        (3, 90.0),
        (4, 90.0),
    ]
    for corner, place in zip(corners, SQUARE[1:4], strict=True):
        away = np.hypot(*(track - place).T)
        near = away < 200.0
        worst = max(away.min(), off_polyline_m(track[near], SQUARE).max())
        assert corner["most_off_m"] == pytest.approx(worst, abs=2.6)  # rows are 2.5 m apart
        assert corner["kept"] == (worst <= 90.0)
    legs = np.min([np.hypot(*(track - place).T) for place in SQUARE[1:4]], axis=0) > 190.0
    assert metrics["check"]["ok"] is bool(off_polyline_m(track[legs], SQUARE).max() <= 10.0)
    assert metrics["total_system_error_m"]["max"] == pytest.approx(
        off_polyline_m(track, SQUARE).max(), abs=1.5
    )


def test_what_lies_beyond_a_corner_counts_and_a_no_names_the_limit_that_would_be_a_yes(
    tmp_path: Path,
) -> None:
    """The file lets its waypoints be passed at 10 m; the aircraft turns on to the next leg too late for that."""
    path = waypoints_file(tmp_path, SQUARE[:3], acceptance_m=10.0)
    settings = {**BY_WAYPOINTS, "guidance.acceptance_radius_m": "10"}
    metrics, track = flown(path, settings=settings)
    (corner,) = metrics["check"]["corners"]
    beyond = float(track[:, 1].max()) - 600.0  # past the corner, to the north of the leg that leads east
    assert beyond > 30.0
    assert corner["most_off_m"] == pytest.approx(beyond, abs=1.0)
    assert (corner["allowed_cut_m"], corner["kept"], metrics["check"]["ok"]) == (10.0, False, False)
    enough = metrics["check"]["corner_m_that_would_do"]
    assert f"--corner-m {enough:g} would be yes" in metrics["check"]["verdict"]
    assert enough == math.ceil(corner["most_off_m"])
    for limit_m, ok in ((enough, True), (enough - 2.0, False)):
        again, _ = flown(path, settings=settings, corner_m=limit_m)
        assert (again["check"]["ok"], again["check"]["corners"][0]["allowed_cut_m"]) == (ok, limit_m)
    worst = metrics["check"]["worst"]
    place = (worst["east_m"], worst["north_m"])
    assert worst["off_m"] == pytest.approx(off_polyline_m(np.array([place]), SQUARE[:3])[0], abs=0.5)
