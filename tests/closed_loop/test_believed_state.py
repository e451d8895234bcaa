"""What the aircraft believes of its state goes to guidance, planner, map and hold; what is true ends and records."""

from dataclasses import replace

import numpy as np
import pytest

from aircraft.guidance.progress import RouteProgress
from harness.flight.closed_loop import fly
from harness.flight.navigation import StateEstimator
from harness.flight.record import Flight, Outcome
from harness.run.scenario_flight import make_loop
from tests.closed_loop.small import small_world
from tests.point_mass import PointMass
from wayproof import AircraftState, Plan, PlanRequest, Route

EAST_M, NORTH_M, UP_M, AIRSPEED_MPS = 30.0, -40.0, 7.0, 2.0
TREE = {"circle": {"center_m": [3000.0, 3000.0], "radius_m": 300.0}}


class Shifted(StateEstimator):
    """Believes to be elsewhere, always by as much."""

    held_errors = UP_M, AIRSPEED_MPS

    def believed(self, state: AircraftState) -> AircraftState:
        return state._replace(
            east_m=state.east_m + EAST_M,
            north_m=state.north_m + NORTH_M,
            up_m=state.up_m + UP_M,
            airspeed_mps=state.airspeed_mps + AIRSPEED_MPS,
        )


class Asked:
    """A planner that notes where it is told to be."""

    def __init__(self, planner: object) -> None:
        self._plan = planner.plan  # type: ignore[attr-defined]
        self.requests: list[PlanRequest] = []

    def plan(self, request: PlanRequest) -> Plan:
        self.requests.append(request)
        return self._plan(request)  # type: ignore[no-any-return]


Flown = tuple[Flight, Asked, np.ndarray]


@pytest.fixture(scope="module")
def flown() -> Flown:
    loop = make_loop(small_world(TREE), PointMass)
    asked = Asked(loop.planner)
    return fly(replace(loop, planner=asked, navigator=Shifted())), asked, loop.seen.edges_since(0)


def test_the_planner_is_told_where_the_aircraft_believes_to_be(flown: Flown) -> None:
    flight, asked, _ = flown
    for request in asked.requests[::20]:
        row = flight.track.time_s.tolist().index(request.time_s)
        true = flight.track.east_m[row], flight.track.north_m[row]
        assert request.position_m == pytest.approx((true[0] + EAST_M, true[1] + NORTH_M))


def test_scans_enter_the_map_from_there(flown: Flown) -> None:
    edges = flown[2] - (3000.0 + EAST_M, 3000.0 + NORTH_M)
    assert len(edges) > 50
    np.testing.assert_allclose(np.hypot(*edges.T), 300.0, atol=5.0)


def test_guidance_follows_the_plan_where_it_believes_to_be(flown: Flown) -> None:
    """It sees no error; the aircraft is off by all that it is wrong about."""
    flight = flown[0]
    assert flight.outcome is Outcome.REACHED, flight.reason
    track, plan = flight.track, flight.plans[-1]
    assert np.nanpercentile(np.abs(track.believed_cross_track_m), 95) < 1.0
    progress = RouteProgress(Route(plan.segments, plan.loiter))
    rows = np.flatnonzero(track.plan_index == plan.plan_index)[:-1]
    assert len(rows) > 20
    seen = np.column_stack((track.east_m + EAST_M, track.north_m + NORTH_M, track.believed_cross_track_m))
    for east, north, told in seen[rows].tolist():
        assert progress.nearest(east, north).cross_track_m == pytest.approx(told, abs=1e-6)


def test_altitude_and_airspeed_that_are_held_are_believed_ones(flown: Flown) -> None:
    track = flown[0].track
    np.testing.assert_allclose(track.up_m[1:], 300.0 - UP_M)
    np.testing.assert_allclose(track.airspeed_mps[1:], 25.0 - AIRSPEED_MPS)
