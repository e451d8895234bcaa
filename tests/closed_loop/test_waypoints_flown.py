"""`guidance.follow: waypoints`: the whole loop flies the plan as a mission, and planning keeps a margin for it."""

import pytest

from aircraft.guidance.waypoints import WaypointLaw
from harness.flight.closed_loop import fly
from harness.run.scenario_flight import make_loop
from harness.scenario.performance import performance_of
from tests.scenarios import scenario_of
from wayproof import InputError, dump_scenario

TEXT = """\
schema: wayproof/scenario/1
name: mission
area: {bounds_m: [0, 0, 10000, 10000]}
obstacles:
  - circle: {center_m: [2500, 5000], radius_m: 500}
mission: {start_m: [2500, 1000], goal_m: [2500, 8000]}
sensor: {range_m: 2500, rays: 180}
"""


def test_a_mission_is_flown_round_an_obstacle() -> None:
    mission = scenario_of(TEXT + "guidance: {kind: l1, follow: waypoints}\n")
    assert scenario_of(dump_scenario(mission)) == mission
    assert performance_of(mission).tracking_error_m > performance_of(scenario_of(TEXT)).tracking_error_m + 5.0
    loop = make_loop(mission)
    assert isinstance(loop.guidance, WaypointLaw)
    flight = fly(loop)
    assert flight.outcome.value == "reached"
    assert flight.track.clearance_m.min() > 0.0
    assert abs(flight.track.cross_track_m[flight.track.plan_index >= 0]).max() > 1.0
    assert mission.with_({"guidance.kind": "pure_pursuit"}).guidance.follow == "waypoints"


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("follow: legs", "8: guidance.follow: is the text 'legs'; must be 'path' or 'waypoints'"),
        ("acceptance_radius_m: 0", "8: guidance.acceptance_radius_m: is 0; must be greater than 0"),
    ],
)
def test_what_is_no_way_to_follow_is_refused(key: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        scenario_of(TEXT + f"guidance: {{{key}}}\n")
    assert said in str(refused.value)
