"""For all tests."""

from __future__ import annotations

import signal

from hypothesis import settings

# No test is timed: how long an example takes is the machine's affair. `pytest --hypothesis-profile all` tries more.
settings.register_profile("wayproof", deadline=None, max_examples=30)
settings.register_profile("all", deadline=None, max_examples=200)
settings.load_profile("wayproof")


def pytest_configure() -> None:
    """Signals that whoever began this had ignored (`nohup`, a job in the background) are not, for what tests begin."""
    for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, handler)
