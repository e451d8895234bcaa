"""`simulation.rate_hz`: its default, what it refuses, and that flights use it."""

from __future__ import annotations

import pytest

from harness.files.strict_yaml import InputError
from harness.flight.closed_loop import fly
from harness.run.scenario_flight import make_loop
from harness.scenario.scenario import Scenario, dump_scenario, parse_scenario

BARE = """\
schema: wayproof/scenario/1
name: short
area: {bounds_m: [0, 0, 10000, 10000]}
mission: {start_m: [1000, 1000], goal_m: [1000, 3000]}
"""


def scenario(*lines: str) -> Scenario:
    return parse_scenario(BARE + "".join(f"{line}\n" for line in lines))


@pytest.mark.parametrize(
    ("sensor_hz", "rate_hz"), [(2, 60), (0.5, 60), (60, 60), (8, 120), (24, 120), (120, 120)]
)
def test_the_default_is_the_first_rate_that_the_sensor_divides(sensor_hz: float, rate_hz: int) -> None:
    assert scenario(f"sensor: {{rate_hz: {sensor_hz}}}").simulation.rate_hz == rate_hz


def test_is_written_out_and_read_back() -> None:
    fine = scenario("simulation: {rate_hz: 240}")
    assert fine.simulation.rate_hz == 240
    assert parse_scenario(dump_scenario(fine)) == fine
    assert scenario().with_({"simulation.rate_hz": 480}).simulation.rate_hz == 480


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["simulation: {rate_hz: 75}"], "5: simulation.rate_hz: is 75; must be a multiple of the guidance rate"),
        (["simulation: {rate_hz: 20}"], "5: simulation.rate_hz: is 20; must be at least 30"),
        (["simulation: {rate_hz: 60.5}"], "5: simulation.rate_hz"),
        (["simulation: {rates_hz: 60}"], "did you mean rate_hz?"),
        (
            ["sensor: {rate_hz: 8}", "simulation: {rate_hz: 60}"],
            "5: sensor.rate_hz: is 8, which does not divide simulation.rate_hz 60; the nearest that does is 7.5",
        ),
        (["sensor: {rate_hz: 7}"], "does not divide 120 Hz; the nearest that does is 7.0588"),
        (
            ["sensor: {rate_hz: 500}", "simulation: {rate_hz: 60}"],
            "which does not divide simulation.rate_hz 60; the nearest that does is 60",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_flown_is_refused(lines: list[str], said: str) -> None:
    with pytest.raises(InputError) as refused:
        scenario(*lines)
    assert said in str(refused.value)


def test_flights_take_so_many_steps() -> None:
    asked = scenario("sensor: {rate_hz: 5, range_m: 3000, rays: 90}", "simulation: {rate_hz: 90}")
    assert make_loop(asked).model.step_rate_hz == 90
    assert fly(make_loop(asked)).outcome.value == "reached"
