"""Which moving obstacles lie outside the planner's assumptions."""

import pytest

from harness.world.motion_assumptions import outside_assumptions
from harness.world.world import World
from tests.scenarios import scenario_of
from wayproof import Scenario


def told(obstacle: str, airspeed_mps: float = 25.0) -> tuple[str, ...]:
    return outside_assumptions(
        scenario_of(
            "schema: wayproof/scenario/1\nname: a\narea: {bounds_m: [0, 0, 9000, 9000]}\n"
            "mission: {start_m: [500, 500], goal_m: [8000, 8000]}\n"
            "sensor: {range_m: 1000}\nplanner: {clearance_m: 100}\n"
            f"aircraft: {{model: aerosonde, airspeed_mps: {airspeed_mps}}}\nobstacles:\n  - {{{obstacle}}}\n"
        )
    )


@pytest.mark.parametrize(
    ("speed_mps", "airspeed_mps", "inside"),
    [(0.4, 25.0, False), (0.5, 25.0, True), (19.9, 25.0, True), (20.1, 25.0, False), (24.1, 30.0, False)],
)
def test_speeds(speed_mps: float, airspeed_mps: float, inside: bool) -> None:
    said = told(f"circle: {{center_m: [4000, 4000], radius_m: 10}}, velocity_mps: [0, -{speed_mps}]", airspeed_mps)
    assert (said == ()) is inside
    assert inside or said[0].startswith(f"obstacles[0] moves at {speed_mps:g} m/s; assumed are 0.5 to ")


def test_the_width_is_that_across_the_motion() -> None:
    wall = "polygon: {vertices_m: [[4000, 4000], [4050, 4000], [4050, 7000], [4000, 7000]]}"
    assert told(f"{wall}, velocity_mps: [10, 0]") == (
        "obstacles[0] is 3,000 m wide across its motion; assumed is no more than the sensing range, 1,000 m",
    )
    assert told(f"{wall}, velocity_mps: [0, 10]") == ()
    slanting = "polygon: {vertices_m: [[4000, 4000], [4900, 4900], [4901, 4900]]}"  # 1273 m long
    assert told(f"{slanting}, velocity_mps: [5, 5]}}\n  - {{circle: {{center_m: [4000, 2000], radius_m: 501}}") == ()
    assert told(f"{slanting}, velocity_mps: [5, -5]")[0].startswith("obstacles[0] is 1,273 m wide")
    assert told("circle: {center_m: [4000, 4000], radius_m: 501}, velocity_mps: [0, 10]") != ()


def test_where_nothing_moves_no_world_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 100,000 buildings it took as long to make as the file to read."""
    made: list[Scenario] = []
    monkeypatch.setattr(World, "from_scenario", made.append)
    circle = "circle: {center_m: [4000, 4000], radius_m: 100}"
    for standing in (circle, f"{circle}, velocity_mps: [0, 0], active_s: [5, 9]"):
        assert told(standing) == ()
    assert made == []
