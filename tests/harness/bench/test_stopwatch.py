"""The stopwatch: what it books, and that a watched part is still itself."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from harness.bench.stopwatch import Stopwatch


class Clock:
    """Time that only the parts spend."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


class Part:
    """Something with methods that take time."""

    def __init__(self, clock: Clock) -> None:
        self._clock, self.name = clock, "a part"

    def work(self, seconds: float) -> float:
        self._clock.now += seconds
        return 2.0 * seconds

    def fail(self) -> None:
        self._clock.now += 1.0
        raise ValueError("broken")

    def rest(self) -> None:
        self._clock.now += 100.0


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("harness.bench.stopwatch.time", SimpleNamespace(perf_counter=clock))
    return clock


def test_time_is_booked_by_block_and_only_of_watched_methods(clock: Clock) -> None:
    watch = Stopwatch()
    one, other = watch.over(Part(clock), "a", "work"), watch.over(Part(clock), "b", "work")
    assert one.work(1.0) == 2.0
    other.work(2.0)
    one.work(4.0)
    one.rest()
    assert watch.seconds == {"a": 5.0, "b": 2.0}


def test_time_of_a_method_that_raises_counts(clock: Clock) -> None:
    watch = Stopwatch()
    with pytest.raises(ValueError, match="broken"):
        watch.over(Part(clock), "a", "fail").fail()
    assert watch.seconds == {"a": 1.0}


def test_a_watched_part_shows_everything_else(clock: Clock) -> None:
    part = Part(clock)
    watched = Stopwatch().over(part, "a", "work")
    part.name = "renamed"
    assert watched.name == "renamed"
    with pytest.raises(AttributeError):
        _ = watched.missing
