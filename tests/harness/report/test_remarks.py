"""What the report of a run says before its figures."""

from __future__ import annotations

from typing import Any

import pytest

from harness.analysis.rows import Row
from harness.report.remarks import remarks

FIGURES: dict[str, Any] = {
    "min_clearance_m": 43.0,
    "clearance_violation_s": 0.0,
    "bank_saturation_fraction": 0.01,
    "plan_delay_max_s": 0.5,
    "lost_returns": 0.1,
    "navigation_jump_m": 5.0,
}


def flown(**odd: Any) -> Row:
    return Row("forest", "rolling_window", "reached", "inside the goal circle", **{**FIGURES, **odd})


USUAL = flown()
WANTED_M, SPEED_MPS = 40.0, 25.0


def test_of_a_usual_flight_nothing_is_said() -> None:
    assert remarks(USUAL, WANTED_M, SPEED_MPS) == []


@pytest.mark.parametrize(
    ("odd", "about", "text"),
    [
        (
            {"min_clearance_m": 18.0, "clearance_violation_s": 2.7},
            "nearer to an obstacle than wanted",
            "18 m at the least; for 2.7 s nearer than the wanted 40 m",
        ),
        ({"bank_saturation_fraction": 0.225}, "long at the bank limit", "22.5 % of the time"),
        (
            {"plan_delay_max_s": 9.1},
            "late plans",
            "a plan took effect up to 9.1 s after the scan that it was made from; the aircraft flew 227.5 m meanwhile, "
            "more than the wanted clearance of 40 m",
        ),
        (
            {"lost_returns": 0.352},
            "many returns lost",
            "35.2 % of the beams that met something returned nothing",
        ),
        (
            {"navigation_jump_m": 44.2},
            "the believed position jumped",
            "by 44.2 m at once, where the wanted clearance is 40 m",
        ),
    ],
)
def test_what_is_odd_is_said_in_words(odd: dict[str, Any], about: str, text: str) -> None:
    assert remarks(flown(**odd), WANTED_M, SPEED_MPS) == [(about, text)]


def test_a_path_that_was_given_keeps_no_clearance_and_waits_for_no_plan() -> None:
    row = flown(clearance_violation_s=9.0, plan_delay_max_s=9.0)
    assert remarks(row, WANTED_M, SPEED_MPS, given=True) == []


def test_without_a_wanted_clearance_nothing_is_measured_against_it() -> None:
    assert remarks(flown(plan_delay_max_s=9.0, navigation_jump_m=50.0), 0.0, SPEED_MPS) == []
