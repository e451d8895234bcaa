"""A fence to stay inside of, flown by an aircraft that only believes where it is."""

import json
from pathlib import Path

import pytest

from aircraft.frames import LocalPlane
from harness.flight.closed_loop import fly
from harness.flight.record import Outcome
from harness.run.scenario_flight import make_loop
from harness.scenario.performance import mission_of
from tests.closed_loop.small import small_world
from tests.point_mass import PointMass
from wayproof import Scenario

INNER_M = (1500.0, 4500.0)
BENT_M = [(50.0, 50.0), (INNER_M[0], 50.0), INNER_M, (5950.0, INNER_M[1]), (5950.0, 5950.0), (50.0, 5950.0)]
"""A fence round a corner of the way: the straight line from start to goal leaves it."""


@pytest.fixture
def fenced(tmp_path: Path) -> Scenario:
    corners = [list(LocalPlane(47.0, 8.0).geodetic(east, north)) for east, north in BENT_M]
    fence = {"polygons": [{"polygon": corners, "inclusion": True, "version": 1}], "circles": [], "version": 2}
    path = tmp_path / "fence.plan"
    path.write_text(json.dumps({"fileType": "Plan", "version": 1, "geoFence": fence}))
    return small_world({"file": {"path": str(path)}}, navigation={"kind": "gnss"})


@pytest.mark.flights
def test_plans_keep_clearance_and_margin_from_a_fence(fenced: Scenario) -> None:
    margin_m = fenced.navigation.margin_m
    wanted_m = fenced.planner.clearance_m
    assert margin_m is not None
    assert margin_m > 3.0 * 4.7
    assert mission_of(fenced).clearance_m == pytest.approx(wanted_m + margin_m)
    exact = fenced.with_({"navigation": {"kind": "perfect"}})
    flights = [fly(make_loop(each, PointMass)) for each in (exact, fenced)]
    assert [flight.outcome for flight in flights] == [Outcome.REACHED] * 2
    # Both lead round its corner. Fence and aircraft are believed off by about the same.
    without_m, with_m = (float(flight.track.clearance_m.min()) for flight in flights)
    assert wanted_m <= without_m < wanted_m + 30.0
    assert wanted_m + margin_m <= with_m < wanted_m + margin_m + 30.0
    assert without_m < with_m
