"""Flights that are held back by the clock."""

import pytest

from harness.flight.closed_loop import NOT_STEERED
from harness.watching import watched_flight as pace
from wayproof import AircraftState


class Clock:
    """Time that passes when somebody sleeps."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, wait_s: float) -> None:
        self.now_s += wait_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(pace, "time", clock)
    return clock


def row(at: pace.Pace, time_s: float) -> None:
    at.on_row(AircraftState(time_s, *[0.0] * 11), NOT_STEERED, 0)


def test_a_flight_takes_its_time_over_the_speed(clock: Clock) -> None:
    at = pace.Pace(4.0)
    for tick in range(101):
        row(at, tick / 10.0)
    assert clock.now_s == pytest.approx(102.5)


def test_what_was_lost_is_caught_up_but_no_more_than_a_second(clock: Clock) -> None:
    at = pace.Pace(1.0)
    row(at, 0.0)
    clock.now_s += 0.6
    row(at, 0.1)
    row(at, 1.0)
    assert clock.now_s == pytest.approx(101.0)
    clock.now_s += 50.0
    row(at, 1.1)
    row(at, 3.1)
    assert clock.now_s == pytest.approx(152.0)
