"""Signals that ask a process to end."""

from __future__ import annotations

import signal

import pytest

from harness import signals
from harness.signals import taken_as_interrupt


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
