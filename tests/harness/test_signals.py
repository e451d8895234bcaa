"""Signals that ask a process to end."""

from __future__ import annotations

import signal

import pytest

from harness import signals
from harness.signals import interruptible, let_interrupts_through, taken_as_interrupt


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


def test_one_that_comes_to_machine_code_is_one_still() -> None:
    """Numba, when it first hands something over, makes a SystemError of it."""
    with pytest.raises(KeyboardInterrupt), interruptible():
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()


def test_no_other_error_is_taken_for_one() -> None:
    for error in (SystemError("of its own"), ValueError("wrong"), SystemExit(3)):
        let_interrupts_through(error)
    with pytest.raises(SystemError, match="of its own"), interruptible():
        raise SystemError("of its own")
