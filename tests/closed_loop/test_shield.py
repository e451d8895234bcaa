"""The shield around planners that want to hit something: no contact, no departure from the area, in a still world."""

import math

import numpy as np
import pytest

import wayproof
from planner.shield import shield as shield_module
from planner.shield.certificate import Certified, Certifier
from tests.closed_loop import hostile, shield_table
from tests.closed_loop.hostile import HOSTILE, Kinked, NotANumber, Outwards, Raising, Straight, Teleporting
from wayproof import Path

WORLD = {
    "area.bounds_m": [0, 0, 5000, 3000],
    "obstacles": [
        {"circle": {"center_m": [2000, 1500], "radius_m": 200}},
        {"circle": {"center_m": [3200, 1350], "radius_m": 150}},
    ],
    "mission": {"start_m": [500, 1500], "goal_m": [4500, 1500], "course_deg": 90, "time_limit_s": 400},
    "planner.clearance_m": 40,
    "planner.shield": "loiter",
    "sensor.range_m": 1000,
}


def flown(inner: type[Straight], late_s: float = 0.0) -> wayproof.FlightResult:
    world = {**WORLD, "planner.compute_latency_s": late_s}
    return wayproof.fly(wayproof.load_scenario("aerosonde_forest").with_(world), planner=inner)


@pytest.mark.parametrize("inner", [*HOSTILE, pytest.param(hostile.Dense, marks=pytest.mark.flights)])
def test_whatever_a_planner_answers_nothing_is_hit_and_the_area_not_left(inner: type[Straight]) -> None:
    run = flown(inner)
    assert run.outcome in ("reached", "timeout"), run.reason
    track = run.track.to_pandas()
    for east, north, radius in ((2000.0, 1500.0, 200.0), (3200.0, 1350.0, 150.0)):
        assert (np.hypot(track.east_m - east, track.north_m - north) - radius).min() > 0.5 * 40.0
    assert track.east_m.between(0.0, 5000.0).all()
    assert track.north_m.between(0.0, 3000.0).all()
    assert run.metrics.shield is not None
    if inner in (Raising, NotANumber, Teleporting, Outwards):
        assert run.metrics.shield.refused_plans > 0
    if inner is Teleporting:
        assert run.outcome == "timeout"
        assert "stuck in the turn since" in run.reason
        assert run.metrics.shield.time_on_backup_s == 400.0 - 1.5, "from when it is in the turn to the end"


def test_the_same_planner_without_the_shield_hits_something() -> None:
    scenario = wayproof.load_scenario("aerosonde_forest").with_({**WORLD, "planner.shield": "none"})
    run = wayproof.fly(scenario, planner=Straight)
    assert run.outcome == "collision"
    assert run.metrics.shield is None


@pytest.mark.parametrize("part", ["turn", "corners"])
def test_without_a_part_of_the_shield_a_planner_does_harm(part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each part is needed: with one left out a hostile planner hits something, or the aircraft leaves its path."""
    if part == "turn":  # all that is certified is flown, with nowhere to turn at its end

        def without_a_turn(self: Certifier, path: Path, *_: object) -> object:
            return Certified(path, path.length_m)

        monkeypatch.setattr(Certifier, "certify", without_a_turn)
        assert flown(Straight).outcome in ("collision", "planner_failed")
    else:
        monkeypatch.setattr(shield_module, "can_be_flown", lambda *_: True)
        assert flown(Kinked).metrics.cross_track_m.max > 10.0


def test_a_planner_that_is_stuck_in_a_turn_gets_on_when_it_is_shown_where() -> None:
    """Bug2 does not read why its path is refused; without the places on its map it holds to the time limit."""
    row = shield_table.flown("bug2", 18, "loiter", limit_s=420.0)
    assert (row["outcome"], row["contact"], row["departed"]) == ("reached", 0, 0)
    assert row["backup_s"] > 30.0


@pytest.mark.parametrize(("inner", "late_s"), [(Kinked, 0.0), (hostile.Onwards, 2.0), (Straight, 1.5)])
def test_a_path_is_made_flyable_before_it_is_certified(inner: type[Straight], late_s: float) -> None:
    """Its corners are rounded, and it begins where the aircraft will be when it takes effect."""
    run = flown(inner, late_s)
    assert run.metrics.cross_track_m.max < 4.0
    hold_m = 25.0**2 / (9.80665 * math.tan(math.radians(45.0 - 10.0)))  # 10 degrees less than the bank limit
    assert max(run.plans.to_pandas().max_curvature_1pm) <= 1.005 / hold_m


def test_the_names_of_the_command_line() -> None:
    plain = wayproof.load_scenario("aerosonde_forest")
    assert plain.planner.shield == "loiter"
    named = plain.with_({"planner.kind": "vfh_plus+shield"})
    assert (named.planner.kind, named.planner.shield) == ("vfh_plus", "loiter")
    assert plain.with_({"planner.kind": "vfh_plus"}).planner.shield == "none"
    with pytest.raises(wayproof.InputError, match=r"shield is none, .*shield; must be loiter or left out"):
        plain.with_({"planner": {"kind": "vfh_plus+shield", "shield": "none"}})
