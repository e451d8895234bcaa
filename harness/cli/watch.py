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
    from harness.scenario.scenario import Scenario
    from harness.watching.watched_flight import Onlookers

LiveOption = Annotated[
    bool, flag("--live", "Show the flight in the viewer while it is flown, at --speed or as fast as it goes.")
]
WebOption = Annotated[bool, flag("--web", "With --live: show it in a browser, served on 127.0.0.1.")]
ViewerOption = Annotated[
    str | None,
    typer.Option(metavar="HOST:PORT", help="With --live: use a rerun viewer that is running."),
]
SpeedOption = Annotated[
    float | None,
    typer.Option(metavar="X", help="Speed over real time, with --live or --mavlink (default there: 1)."),
]
MavlinkOption = Annotated[
    str | None,
    typer.Option(metavar="udp:HOST:PORT", help="Show the flight to a ground station that listens there."),
]
BeyondOption = Annotated[
    bool, flag("--beyond-this-machine", "Allow --viewer and --mavlink on another machine.")
]


@dataclass(frozen=True)
class Watch:
    """What the options say."""

    live: bool = False
    web: bool = False
    viewer: str | None = None
    speed: float | None = None
    mavlink: str | None = None
    beyond: bool = False

    def check(self) -> None:
        """Refuses options that make no sense together.

        Raises:
            BadParameter: they do not.
        """
        if self.speed is not None and not 0.0 < self.speed <= 1e6:
            raise typer.BadParameter(f"--speed is {self.speed:g}; must be above 0 and at most 1e6")
        if self.speed is not None and not (self.live or self.mavlink):
            raise typer.BadParameter("--speed goes with --live or --mavlink")
        if self.viewer and not self.live:
            raise typer.BadParameter("--viewer goes with --live")
        if self.web and (self.viewer or not self.live):
            raise typer.BadParameter("--web goes with --live, and without --viewer")
        if self.beyond and not (self.viewer or self.mavlink):
            raise typer.BadParameter("--beyond-this-machine goes with --viewer or --mavlink")


@dataclass(frozen=True)
class Opened:
    """Who looks on, and how to wait until the viewer that was opened for it is closed."""

    onlookers: Onlookers | None
    wait: Callable[[], None]


@contextmanager
def opened(watch: Watch, scenario: Scenario) -> Iterator[Opened]:
    """What the options ask for, the viewer opened; it stays open no longer than the block.

    Raises:
        InputError: an address leads nowhere, or where it may not; or there is no screen for the viewer.
    """
    if not (watch.live or watch.mavlink):
        yield Opened(None, lambda: None)
        return
    from harness.watching.address import ground_station_address, viewer_address
    from harness.watching.watched_flight import Onlookers

    station, speed = None, watch.speed
    if watch.mavlink is not None:
        station, speed = ground_station_address(watch.mavlink, watch.beyond), watch.speed or 1.0
        _tell_place(scenario)

    def who(viewer: str | None) -> Onlookers:
        return Onlookers(viewer, station, speed, _tell_gone)

    if not watch.live:
        yield Opened(who(None), lambda: None)
    elif watch.viewer is not None:
        address, url = viewer_address(watch.viewer, watch.beyond)
        address.need_viewer("--viewer", secure=not url.startswith("rerun+http:"))
        yield Opened(who(url), lambda: None)
    else:
        with _viewer(watch.web) as (url, wait):
            yield Opened(who(url), wait)


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


def _tell_place(scenario: Scenario) -> None:
    """Says where the flight is shown if that may not be where it was meant to be."""
    from harness.scenario.sections import Origin

    origin = scenario.area.origin
    if origin == Origin():
        say(
            f"area.origin is the default: the ground station shows the flight about {origin.latitude_deg:g}, "
            f"{origin.longitude_deg:g}",
            err=True,
        )


def _tell_gone() -> None:
    say("wayproof: the viewer has gone; the flight goes on", err=True)
