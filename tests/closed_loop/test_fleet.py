"""Every aircraft of the fleet in a world at its own scale."""

from __future__ import annotations

import re

import pytest

from aircraft.airframes import aircraft_names, airframe
from harness.scenario.scenario import Scenario
from tests.closed_loop.fleet_table import DISCS, HIGH, WIDE, discs, flown, scaled


@pytest.mark.slow
@pytest.mark.parametrize("law", ["preview", "npfg"])
@pytest.mark.parametrize("name", aircraft_names())
def test_every_aircraft_reaches_the_goal_at_the_clearance(name: str, law: str) -> None:
    flight = flown(name, law, "wind 30 %", seed=1)
    assert flight.good, flight


def test_a_range_that_is_too_short_is_refused_with_the_one_that_is_needed() -> None:
    flight = flown("T38", "preview", "calm", seed=1, range_radii=2.2)
    assert (flight.outcome, flight.good) == ("refused", False)
    assert re.search(r"must be at least \d+, to see room for a safe turn ahead", flight.reason)


def test_worlds_are_the_same_in_turn_radii() -> None:
    def shape(scenario: Scenario) -> list[float]:
        wide_m = scenario.area.bounds_m[2] - scenario.area.bounds_m[0]
        return [
            WIDE * value / wide_m
            for each in scenario.obstacles
            if each.circle
            for value in (*each.circle.center_m, each.circle.radius_m)
        ]

    small, large = (scaled(airframe(name), "preview", "calm", 1) for name in ("aerosonde", "c172p"))
    assert small.area.bounds_m[2] < large.area.bounds_m[2]
    assert shape(small) == pytest.approx(shape(large), abs=1e-3)
    assert len(discs(1)) == DISCS
    assert discs(1) != discs(2)
    assert large.area.bounds_m[3] == pytest.approx(0.5 * HIGH * large.area.bounds_m[2] / (0.5 * WIDE))
