"""A straight lane between two blocks, too narrow to turn in, is the only way to the goal."""

import pytest

from harness.flight.record import Flight
from tests.closed_loop.small import flown_by_point_mass, small_world
from tests.longer import longer


def flown(width_m: float, length_m: float, margin_m: float | None = None) -> Flight:
    """5.2 km to the east and the length of the lane, which begins 1,600 m ahead of the start."""
    x0, x1, half = 2000.0, 2000.0 + length_m, 0.5 * width_m
    blocks = [
        {"polygon": {"vertices_m": [[x0, south], [x1, south], [x1, north], [x0, north]]}}
        for south, north in ((0.0, 2000.0 - half), (2000.0 + half, 4000.0))
    ]
    goal = {"goal_m": [x1 + 1600.0, 2000.0]}
    scenario = small_world(
        *blocks,
        area={"bounds_m": [0, 0, x1 + 2000.0, 4000]},
        mission={"start_m": [400.0, 2000.0], "course_deg": 90.0, "time_limit_s": 1500.0} | goal,
        sensor={"range_m": 1200.0},
        planner={"clearance_m": 50.0, "margin_m": margin_m},
    )
    return flown_by_point_mass(scenario)


@pytest.mark.parametrize(("width_m", "length_m"), [(250.0, 600.0), (400.0, 1000.0)])
def test_a_lane_is_flown_through_where_room_to_turn_is_seen_beyond(width_m: float, length_m: float) -> None:
    flight = flown(width_m, length_m)
    assert flight.outcome.value == "reached", flight.reason
    assert flight.track.time_s[-1] * 25.0 < 1.01 * (3200.0 + length_m)
    assert abs(flight.track.north_m - 2000.0).max() < 0.5 * width_m - 50.0


@pytest.mark.flights
def test_a_lane_whose_end_is_out_of_sight_is_not_called_a_proof() -> None:
    flight = flown(250.0, 2000.0)
    assert flight.outcome.value == "planner_failed"
    assert "no way with room to turn is left" in flight.reason
    assert "That does not prove the goal unreachable" in flight.reason
    assert flight.plans[-1].plan.path is not None
    assert flight.plans[-1].plan.path.loiter
    assert flight.track.east_m.max() < 2200.0


@pytest.mark.parametrize(
    ("width_m", "margin_m", "outcome"),
    [(85.0, None, "unreachable"), *longer([(102.0, None, "planner_failed")]), (120.0, 50.0, "reached")],
)
def test_a_gap_that_can_be_passed_at_the_clearance_is_not_called_closed(
    width_m: float, margin_m: float | None, outcome: str
) -> None:
    """A point passes what is wider than twice the clearance of 50 m. Seen from 1.2 km it looks narrower."""
    flight = flown(width_m, 200.0, margin_m)
    assert flight.outcome.value == outcome, flight.reason
    assert ("That does not prove the goal unreachable" in flight.reason) is (outcome == "planner_failed")
    assert flight.track.clearance_m.min() > 0.99 * 50.0 or outcome != "reached"
