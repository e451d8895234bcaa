"""What is claimed of a flight: by the sentences of the contract, on `metrics.json` of a few lines."""

from typing import Any, get_args

import pytest

from harness.analysis.metric import SEVERITY, Claim, cause_of, holds, margin

AFTER_WHICH_NOBODY_KNOWS = {"collision", "lost_control", "planner_failed", "error"}


def said(outcome: str = "reached", trackable: bool = True, ok: bool = True, **more: Any) -> dict[str, Any]:
    """A flight within 8 of 10 m of its plan, 2 of 4 m at a corner, and 60 % of its limit in altitude."""
    leg = {"max_cross_track_m": 8.0, "threshold_m": 10.0, "cause": None if trackable else "wind drift"}
    corner = {"waypoint": 3, "kept": trackable, "most_off_m": 2.0, "allowed_cut_m": 4.0}
    check = {"ok": ok, "corners": [corner], "limit_used": {"off_path": None, "altitude": 0.6}}
    straight = {**leg, "max_cross_track_m": 1.0, "cause": None}
    flown = {"outcome": outcome, "trackable": trackable, "trackability": [straight, leg], "min_clearance_m": 30.0}
    return {**flown, "check": check, **more}


@pytest.mark.parametrize("outcome", SEVERITY)
def test_claims_hold_by_outcome_contact_tracking_and_check(outcome: str) -> None:
    def held(**how: Any) -> list[bool]:
        return [holds(claim, said(outcome, **how)) for claim in ("reached", "no-contact", "trackable", "as-given")]

    there, safe = outcome == "reached", outcome not in AFTER_WHICH_NOBODY_KNOWS
    assert held() == [there, safe, there, True]
    assert held(trackable=False) == [there, safe, False, True]
    assert held(ok=False) == [there, safe, there, False]
    assert held(contact=True) == [there, False, there, True]
    assert held(check={}) == [there, safe, there, False]


def test_margins_are_what_is_left_of_the_least_distance_or_of_the_limit_used_most() -> None:
    scenario = {name: value for name, value in said().items() if name != "check"}
    assert [margin(claim, said()) for claim in get_args(Claim)] == [None, 30.0, *[pytest.approx(0.4)] * 2]
    assert margin("trackable", scenario) == pytest.approx(0.2)
    assert margin("no-contact", said(min_clearance_m=-2.0)) == pytest.approx(0.0, abs=1e-6)  # of a fence
    assert margin("no-contact", said(min_clearance_m=-2.0)) != 0.0
    assert [margin(claim, said("collision", ok=False)) for claim in get_args(Claim)] == [0.0] * 4


def test_a_cause_is_what_was_touched_or_else_crossed_or_else_why_legs_or_a_corner_were_missed() -> None:
    tower, zone = {"kind": "obstacle", "name": "tower"}, {"kind": "exclusion", "name": "zone"}
    lost: dict[str, Any] = {"breaches": [zone], "trackable": False}
    for claim in get_args(Claim):
        assert cause_of(claim, said(contacts=[tower], **lost)) == "touches tower"
        assert cause_of(claim, said(contacts=[], **lost)) == ("enters zone" if claim == "as-given" else "wind drift")
    assert cause_of("as-given", said(trackable=False, trackability=[])) == "corner 3 not kept"
    assert cause_of("reached", said()) == ""
