"""For all tests."""

import importlib
import signal
from pathlib import Path

import pytest
from hypothesis import settings

from planner.compiled import compile_all
from planner.kernel_cache import seal
from tests.examples import ALL, TIMES

SOME = 25  # random examples of a property test that asks for no other number

# No test is timed: how long an example takes is the machine's affair. `pytest --hypothesis-profile all` tries more.
settings.register_profile("wayproof", deadline=None, max_examples=SOME)
settings.register_profile(ALL, deadline=None, max_examples=TIMES * SOME)
settings.load_profile("wayproof")

ROOT = Path(__file__).parents[1]
ROOMS = ("aircraft", "harness", "planner")


def pytest_configure(config: pytest.Config) -> None:
    """Signals that whoever began this had ignored (`nohup`, a job in the background) are not, for what tests begin."""
    for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, handler)
    seal()  # Else the flight after the tests would take what they have compiled for damaged.
    if getattr(config.option, "numprocesses", None):
        _before_several_processes_test(config)


def _before_several_processes_test(config: pytest.Config) -> None:
    # One process compiles; else each of them would.
    for path in (each for room in ROOMS for each in (ROOT / room).rglob("*.py")):
        if "\n@compiled(" in path.read_text(encoding="utf-8"):
            importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
    compile_all(rare=True)
    # Each gets a half of the list, and who is done takes tests from the end of another's: neighbours, which share
    # flights, stay together, and nobody waits long for the other at the end.
    if config.option.dist == "load":
        config.option.dist = "worksteal"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The files beside this one come first: among the flights theirs are the longest, for which all would wait."""
    items.sort(key=lambda item: item.path.parent != Path(__file__).parent)


@pytest.fixture(autouse=True)
def _no_progress_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """However slow the machine is, standard error has no lines of progress."""
    monkeypatch.setattr("harness.cli.terminal.LINE_EVERY_S", 86_400.0)
