"""Makes README's pictures and looks at them as CI can: `python -m tests.pictures [FOLDER]`.

Flies, compares and writes a report with the commands that people use; draws recording and overlay without a
screen, the report in a browser; and fails where a view complains, the page reaches for the network, hides a
figure or scrolls sideways.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

from PIL import Image

from harness.cli.app import main as wayproof
from harness.recording.blueprint import TIMELINE
from harness.recording.overlay import send_recording
from harness.recording.viewer import (
    LOCALHOST,
    NO_DRIVER,
    ViewerError,
    empty_viewer,
    free_port,
    viewer_process,
)
from tests.page import NoBrowserError, browser, shown

SETTLE_S = 1.5
"""The viewer draws a new time within a few frames; a software renderer needs about a second for them."""
MOST_PICTURES = 20  # what goes on changing is drawn no more often than this

ROOT = Path(__file__).parents[1]
SIZE = (1800, 1040)
COLOURS = 160
PAGE_RATIO = 1.45  # height over width of what is kept of a page: its beginning

RECORDINGS = {
    "paper_circles": ("paper_circles/improved_bug/flight.rrd", 2346.0),
    "overlay": ("paper_circles/overlay.rrd", 2500.0),
    "aerosonde_forest": ("forest/flight.rrd", 100.0),
}
"""Name of a picture: recording, and time of the cursor in s."""
PAGES = {"comparison": "report.html", "report": "paper_circles/bug2/report.html"}
"""Name of a picture: page."""
WIDTHS_PX = (390, 1100)  # windows that a page is looked at in; the picture is of the last


def make(out: Path, work: Path) -> Iterator[str]:
    """Makes all pictures in `out`, of flights in the empty folder `work`; gives the faults that it sees."""
    flights = [
        "compare", "paper_circles", "--planners", "bug2,improved_bug,rolling_window", "--out", str(work),
    ]  # fmt: skip
    if wayproof(flights) or wayproof(["report", str(work / "paper_circles" / "bug2")]):
        yield "a flight or a report failed"
    wayproof(["fly", "aerosonde_forest", "--out", str(work / "forest"), "--quiet"])
    try:
        for name, (recording, time_s) in RECORDINGS.items():
            png = work / f"{name}.png"
            complaints = screenshot(work / recording, png, time_s, SIZE)
            yield from (f"{recording}: {complaint}" for complaint in complaints)
            _keep(png, out)
    except ViewerError as error:
        if str(error) != NO_DRIVER:
            raise
        print(f"skipped the recordings: {NO_DRIVER}")
    try:
        with browser() as chromium:
            for name, page in PAGES.items():
                png = work / f"{name}.png"
                for width_px in WIDTHS_PX:
                    seen = shown(chromium, work / page, width_px, png)
                    if seen.said or seen.asked_for or seen.missing or seen.overflow_px or not seen.figures:
                        yield f"{page}, {width_px} px wide: {seen}"
                _keep(png, out)
    except NoBrowserError as error:
        print(f"skipped the pages: {error}")


def screenshot(rrd: Path, png: Path, time_s: float | None = None, size: tuple[int, int] = (1920, 1080)) -> list[str]:
    """Draws a recording at a simulated time, without a screen; returns what its views complain of."""
    from rerun.experimental import ViewerClient

    port = free_port()
    arguments = ["--headless", "--bind", LOCALHOST, "--port", str(port), "--hide-welcome-screen"]
    with (
        tempfile.TemporaryDirectory(prefix="wayproof-view-") as scratch,
        viewer_process([*arguments, "--window-size", f"{size[0]}x{size[1]}"], Path(scratch), port),
    ):
        try:
            client = ViewerClient.connect(f"rerun+http://{LOCALHOST}:{port}/proxy")
            client.open(str(rrd.resolve()))
            if time_s is not None:
                client.set_time(TIMELINE, duration=time_s, play_state="paused")
            time.sleep(SETTLE_S)
            client.save_screenshot(str(png.resolve()))
            return [str(report) for view in client.get_state().views for report in view.reports]
        except ConnectionError as error:
            # Without a driver it listens for a moment before it gives up.
            raise ViewerError(NO_DRIVER) from error


@contextmanager
def served(rrd: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Serves a recording to browsers, without opening one; gives the server and the address."""
    told: list[str] = []
    with (
        patch("webbrowser.open", lambda address: True),
        empty_viewer(web=True, report=told.append) as (viewer, source),
    ):
        send_recording(rrd, source)
        yield viewer, told[0].split()[0]


def draw_settled(client: Any, png: Path) -> None:
    """Draws what a viewer shows once two pictures in a row are alike: until then rows may be on their way."""
    time.sleep(SETTLE_S)
    before = b""
    for _ in range(MOST_PICTURES):
        time.sleep(SETTLE_S)
        client.save_screenshot(str(png))
        if png.read_bytes() == before:
            return
        before = png.read_bytes()


def _keep(png: Path, out: Path) -> None:
    """Puts a picture into the folder, small: few colours, and the beginning of what is long."""
    with Image.open(png) as picture:
        width, height = picture.size
        begin = picture.convert("RGB").crop((0, 0, width, min(height, int(PAGE_RATIO * width))))
        begin.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
            out / png.name, optimize=True
        )


def main(arguments: list[str]) -> int:
    """Makes the pictures in the folder given, by default README's; returns the exit status."""
    out = Path(arguments[0]) if arguments else ROOT / ".pictures"
    out.mkdir(parents=True, exist_ok=True)
    work = Path(tempfile.mkdtemp(prefix="wayproof-pictures-"))
    try:
        faults = list(make(out, work / "flown"))
    finally:
        shutil.rmtree(work)
    print("\n".join(faults or [f"pictures in {out}: no complaint"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
