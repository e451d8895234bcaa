"""What an aircraft believes: sizes of the errors, outages, and that a seed says it all."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.flight.navigation import HEADING_CORRELATION_S, Navigator, pose_error_m
from harness.flight.position_errors import CrossTrack
from harness.flight.record import AcceptedPlan
from harness.scenario.navigation import Navigation
from wayproof import AircraftState, Path, Plan, PlanStatus

SPEED_MPS = 20.0
SEED = np.random.SeedSequence(5, spawn_key=(3,))


def at(time_s: float) -> AircraftState:
    return AircraftState(
        time_s, SPEED_MPS * time_s, 500.0, 300.0, SPEED_MPS, 0.0, 0.0, math.pi / 2, 0.1, 0.02, 25.0, 1.0, 0.5
    )


def navigator(**keys: Any) -> Navigator:
    return Navigator(Navigation(**{"kind": "gnss", **keys}), SEED)


def position_error(navigation: Navigator, time_s: float) -> tuple[float, float]:
    believed, true = navigation.believed(at(time_s)), at(time_s)
    return believed.east_m - true.east_m, believed.north_m - true.north_m


def test_the_same_seed_has_the_same_errors_and_is_not_used_up() -> None:
    times = [0.0, 0.25, 1 / 3, 2.0, 30.0]
    one, again = navigator(outages_s=[[1, 5]]), navigator(outages_s=[[1, 5]])
    assert [one.believed(at(t)) for t in times] == [again.believed(at(t)) for t in times]
    other = Navigator(Navigation(kind="gnss"), np.random.SeedSequence(6, spawn_key=(3,)))
    assert other.believed(at(0.0)).east_m != navigator().believed(at(0.0)).east_m


@pytest.mark.parametrize("interval_s", [1.0, 7.0])
def test_errors_have_the_sizes_and_the_memory_that_were_asked_for(interval_s: float) -> None:
    keys = {
        "position_sigma_m": 4.0, "position_correlation_s": 10.0, "position_bias_m": [30.0, -20.0],
        "velocity_sigma_mps": 0.2, "heading_sigma_deg": 2.0, "airspeed_sigma_mps": 0.5,
        "altitude_sigma_m": 3.0,
    }  # fmt: skip
    gnss, count = navigator(**keys), 20_000
    rows = []
    for index in range(count):
        true = at(index * interval_s)
        rows.append(np.subtract(gnss.believed(true), true))
    errors = np.array(rows)
    # Neighbours are alike: some hundred independent heading and airspeed errors are left, so that their bound is wide.
    east, north = errors[:, 1], errors[:, 2]
    assert (east.mean(), north.mean()) == pytest.approx((30.0, -20.0), abs=0.6)
    assert (east.std(), north.std()) == pytest.approx((4.0, 4.0), rel=0.06)
    assert errors[:, 4:7].std(axis=0) == pytest.approx([0.2] * 3, rel=0.06)
    assert errors[:, 3].std() == pytest.approx(3.0, rel=0.06)
    assert np.degrees(errors[:, 7].std()) == pytest.approx(2.0, rel=0.2)
    assert errors[:, 10].std() == pytest.approx(0.5, rel=0.3)
    assert abs(np.corrcoef(east, north)[0, 1]) < 0.06
    assert np.corrcoef(east[:-1], east[1:])[0, 1] == pytest.approx(math.exp(-interval_s / 10.0), abs=0.03)


def test_in_an_outage_the_position_drifts_with_the_distance_and_then_jumps_back() -> None:
    keys: dict[str, Any] = {"position_sigma_m": 0.5, "drift_share": 0.05, "outages_s": [[10, 70], [100, 130]]}
    gnss = navigator(**keys, velocity_sigma_mps=0.0)
    last_fix = position_error(gnss, 9.0)
    drifts = {t: np.subtract(position_error(gnss, t), last_fix) for t in (11.0, 12.5, 40.0, 69.5)}
    for time_s, drift in drifts.items():
        assert math.hypot(*drift) == pytest.approx(0.05 * SPEED_MPS * (time_s - 10.0))
    ways = [drift / math.hypot(*drift) for drift in drifts.values()]
    assert np.allclose(ways, ways[0])
    drift_mps = np.subtract(gnss.believed(at(69.5)), at(69.5))[4:6]
    assert drift_mps == pytest.approx(drifts[69.5] / 59.5)  # the velocity errs as the position drifts
    back = position_error(gnss, 70.0)
    assert math.hypot(*back) < 3.0 < 50.0 < math.dist(np.add(drifts[69.5], last_fix), back)
    begun, later = (position_error(gnss, t) for t in (100.0 - 1e-9, 120.0))
    second = np.subtract(later, begun)
    assert math.hypot(*second) == pytest.approx(0.05 * SPEED_MPS * 20.0)
    assert not np.allclose(second / math.hypot(*second), ways[0], atol=1e-3)
    keys = {"position_sigma_m": 50.0, "position_correlation_s": 5.0}  # and a short fix between two looks
    lost, fixed = navigator(**keys, outages_s=[[1, 20.01], [20.02, 40]]), navigator(**keys)
    ends = [[position_error(each, t) for t in (0.0, 20.0, 20.1)][-1] for each in (lost, fixed)]
    assert math.dist(*ends) == pytest.approx(0.03 * SPEED_MPS * 0.08)


def test_two_looks_at_a_return_differ_as_first_order_processes_do() -> None:
    """After dt a process of size s and time tau differs by s sqrt(2 (1 - exp(-dt / tau))); looks are 5 s apart."""
    keys = Navigation(kind="gnss", position_sigma_m=2.0, position_correlation_s=40.0, heading_sigma_deg=0.5)
    position_m = 2.0 * math.sqrt(2.0 * (1.0 - math.exp(-5.0 / 40.0)))
    turned = math.radians(0.5) * math.sqrt(2.0 * (1.0 - math.exp(-5.0 / HEADING_CORRELATION_S)))
    assert pose_error_m(keys, 800.0) == pytest.approx(math.hypot(position_m, 800.0 * turned))


def test_dead_reckoning_knows_its_start_and_drifts_ever_after() -> None:
    blind = navigator(kind="dead_reckoning")
    assert position_error(blind, 0.0) == (0.0, 0.0)
    assert math.hypot(*position_error(blind, 1000.0)) == pytest.approx(0.01 * SPEED_MPS * 1000.0)


def test_a_state_is_as_old_as_its_latency() -> None:
    navigation = Navigation(
        kind="gnss", latency_s=0.25, position_sigma_m=0.0, velocity_sigma_mps=0.0, heading_sigma_deg=0.0,
        airspeed_sigma_mps=0.0, altitude_sigma_m=0.0,
    )  # fmt: skip
    navigator = Navigator(navigation, np.random.SeedSequence(1))
    # A circle flown at 20 m/s with a rate of 0.3 rad/s, as seen ten times a second.
    for step in range(60):
        time_s = 0.1 * step

        def place(at_s: float) -> tuple[float, float]:
            return 20 / 0.3 * (1 - math.cos(0.3 * at_s)), 20 / 0.3 * math.sin(0.3 * at_s)

        turn = 0.3 * time_s
        true = AircraftState(
            time_s, *place(time_s), 300.0 + time_s, 20 * math.sin(turn), 20 * math.cos(turn), 1.0,
            turn % math.tau, 0.1, 0.0, 20.0, 1.0,
        )  # fmt: skip
        seen = navigator.believed(true)
        assert (seen.time_s, seen.roll_rad) == pytest.approx((time_s, 0.1))
        assert (seen.east_m, seen.north_m) == pytest.approx(place(time_s - 0.25), abs=0.2)
        if step >= 3:
            assert seen.up_m == pytest.approx(300.0 + time_s - 0.25)
            assert seen.heading_rad == pytest.approx((turn - 0.075) % math.tau)


@pytest.mark.parametrize(("east_mps", "off_m"), [(20.0, -10.0), (-20.0, -math.hypot(60.0, 10.0))])
def test_before_its_start_a_plan_is_carried_on_straight_to_who_comes(east_mps: float, off_m: float) -> None:
    """Also where it begins with a turn: the circle of its 100 m passes this place at 8.2 m, the straight at 10 m."""
    path = Path(np.array([(0.0, 500.0, 1.0, 0.0, 0.01, 1.0), (1.0, 500.0, 1.0, 0.0, 0.0, 900.0)]))
    plan = AcceptedPlan(0, 0.0, 0.0, Plan(PlanStatus.FOUND, "", np.zeros((2, 2)), path))
    plans: Any = SimpleNamespace(accepted=[plan])
    state = at(0.0)._replace(east_m=-60.0, north_m=510.0, velocity_east_mps=east_mps, velocity_north_mps=0.0)
    assert CrossTrack(plans).of(state, 0) == pytest.approx(off_m)
