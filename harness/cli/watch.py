"""Who looks on at a flight of `fly`: the options, what they may be together, and the viewer that they open."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from harness.cli.options import flag
from harness.cli.standard_output import say

if TYPE_CHECKING:
    from harness.watching.watched_flight import Onlookers

LiveOption = Annotated[
    bool, flag("--live", "Show the flight in the viewer while it is flown, at --speed or as fast as it goes.")
]
WebOption = Annotated[bool, flag("--web", "With --live: show it in a browser, served on 127.0.0.1.")]
SpeedOption = Annotated[
    float | None,
    typer.Option(metavar="X", help="With --live: simulated seconds a second."),
]


@dataclass(frozen=True)
class Watch:
    """What the options say."""

    live: bool = False
    web: bool = False
    speed: float | None = None

    def check(self) -> None:
        """Refuses options that make no sense together.

        Raises:
            BadParameter: they do not.
        """
        if self.speed is not None and not 0.0 < self.speed <= 1e6:
            raise typer.BadParameter(f"--speed is {self.speed:g}; must be above 0 and at most 1e6")
        for option, given in (("--speed", self.speed is not None), ("--web", self.web)):
            if given and not self.live:
                raise typer.BadParameter(f"{option} goes with --live")


@dataclass(frozen=True)
class Opened:
    """Who looks on, and how to wait until the viewer that was opened for it is closed."""

    onlookers: Onlookers | None
    wait: Callable[[], None]


@contextmanager
def opened(watch: Watch) -> Iterator[Opened]:
    """What the options ask for, the viewer opened; it stays open no longer than the block.

    Raises:
        InputError: there is no screen for the viewer.
    """
    if not watch.live:
        yield Opened(None, lambda: None)
        return
    from harness.watching.watched_flight import Onlookers

    with _viewer(watch.web) as (url, wait):
        yield Opened(Onlookers(url, watch.speed, _tell_gone), wait)


@contextmanager
def _viewer(web: bool) -> Iterator[tuple[str, Callable[[], None]]]:
    """A viewer of our own."""
    from contextlib import ExitStack

    from harness.files.input_file import InputError
    from harness.recording.viewer import ViewerError, following_viewer

    with ExitStack() as stack:
        try:
            process, url = stack.enter_context(
                following_viewer(web, lambda address: say(f"{address} (Ctrl-C ends it)", err=True))
            )
        except ViewerError as error:
            raise InputError(f"wayproof: {error}") from error

        def wait() -> None:
            if sys.stdout is not None:
                sys.stdout.flush()
            try:
                process.wait()
            except KeyboardInterrupt:
                return

        yield url, wait


def _tell_gone() -> None:
    say("wayproof: the viewer has gone; the flight goes on", err=True)
