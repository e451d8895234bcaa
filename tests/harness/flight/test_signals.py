"""Signals that ask a process to end."""

from __future__ import annotations

import signal
import time

import pytest

from harness.flight import signals
from harness.flight.signals import held_back, taken_as_interrupt


def test_one_that_comes_again_at_once_does_not_end_the_cleaning_up(monkeypatch: pytest.MonkeyPatch) -> None:
    cleaned = False
    with taken_as_interrupt() as came:
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGHUP)
            cleaned = True
        assert cleaned
        assert came == [signal.SIGTERM]
        monkeypatch.setattr(signals, "AGAIN_S", 0.0)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_one_is_held_back_until_it_is_called_for(number: signal.Signals) -> None:
    with taken_as_interrupt() as came:
        before = signal.getsignal(number)
        with held_back() as interrupt:
            interrupt()
            signal.raise_signal(number)
            signal.raise_signal(number)
            with pytest.raises(KeyboardInterrupt):
                interrupt()
            interrupt()  # both were one
        assert came == ([number] if number is signal.SIGTERM else [])
        assert signal.getsignal(number) is before


@pytest.mark.parametrize("again_s", [signals.AGAIN_S, -1.0], ids=["first", "again"])
def test_a_block_that_never_calls_is_ended_all_the_same(
    again_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first one at its end, one that comes again where it is."""
    monkeypatch.setattr(signals, "AGAIN_S", again_s)
    went_on = False

    def never_calls() -> None:
        nonlocal went_on
        with held_back():
            signal.raise_signal(signal.SIGINT)
            went_on = True

    with pytest.raises(KeyboardInterrupt):
        never_calls()
    assert went_on == (again_s > 0.0)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_block_that_hangs_is_ended_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(signals, "AGAIN_S", 0.05)
    until = time.monotonic() + 30.0

    def hangs() -> None:
        with held_back():
            signal.raise_signal(signal.SIGINT)
            while time.monotonic() < until:
                pass

    with pytest.raises(KeyboardInterrupt):
        hangs()
    assert time.monotonic() < until
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
