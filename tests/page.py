"""A page as a browser without a screen shows it."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

NO_BROWSER = "no Chromium: install Debian's package chromium, or run `playwright install chromium`"
SETTLE_MS = 200


class NoBrowserError(RuntimeError):
    """There is no browser to show a page in."""


@dataclass(frozen=True)
class Shown:
    """What a page did in a browser.

    Attributes:
        said: lines on the console and errors of the page.
        asked_for: addresses that it wanted from anywhere but itself.
        figures: pictures on the page.
        missing: those of them that cannot be seen.
        overflow_px: by how much the page is wider than the window.
    """

    said: tuple[str, ...]
    asked_for: tuple[str, ...]
    figures: int
    missing: int
    overflow_px: int


@contextmanager
def browser() -> Iterator[Any]:
    """Chromium without a screen; NoBrowserError if there is none."""
    from playwright.sync_api import Error, sync_playwright

    with sync_playwright() as playwright:
        own = shutil.which("chromium") or shutil.which("google-chrome")
        try:
            chromium = playwright.chromium.launch(executable_path=own, args=["--no-sandbox"])
        except Error as error:
            if "Executable doesn't exist" not in str(error):
                raise
            raise NoBrowserError(NO_BROWSER) from error
        try:
            yield chromium
        finally:
            chromium.close()


def shown(chromium: Any, html: Path, width_px: int, png: Path | None = None) -> Shown:
    """Opens a file in a window of a width; may take its picture from top to bottom."""
    page = chromium.new_page(viewport={"width": width_px, "height": 900})
    said: list[str] = []
    asked: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    address = html.resolve().as_uri()
    page.goto(address)
    page.wait_for_timeout(SETTLE_MS)
    figures, missing = page.evaluate(
        "[document.images.length, [...document.images].filter("
        "image => !(image.complete && image.naturalWidth && image.getBoundingClientRect().width > 100)).length]"
    )
    overflow = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    if png is not None:
        page.screenshot(path=str(png), full_page=True)
    page.close()
    others = tuple(url for url in asked if url != address and not url.startswith("data:"))
    return Shown(tuple(said), others, figures, missing, overflow)


def assert_shown(chromium: Any, html: Path, figures: int) -> None:
    """On a phone and on a screen, with so many figures, without a complaint and without anything else than itself."""
    for width_px in (390, 1280):
        page = shown(chromium, html, width_px)
        assert (page.said, page.asked_for, page.overflow_px) == ((), (), 0)
        assert (page.figures, page.missing) == (figures, 0)
