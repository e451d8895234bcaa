"""The report of a comparison: one HTML file that needs nothing but itself."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jinja2

from harness.compare_rows import DASH, FIGURES, Row

TEMPLATE = "comparison.html"


@dataclass(frozen=True)
class Picture:
    """A figure in the report.

    Attributes:
        svg: the file's content.
        alt: what it shows, for those who cannot see it.
        caption: a sentence below it.
    """

    svg: bytes
    alt: str
    caption: str

    @property
    def uri(self) -> str:
        """The figure as a data URI; as an image of its own, its ids cannot meet those of another."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.svg).decode("ascii")


@dataclass(frozen=True)
class Chapter:
    """One scenario.

    Attributes:
        name: the scenario's.
        facts: what was asked, name and value.
        rows: one a planner.
        pictures: in order.
        note: a sentence where something is missing, else empty.
    """

    name: str
    facts: Mapping[str, str]
    rows: Sequence[Row]
    pictures: Sequence[Picture]
    note: str = ""


def report_html(
    chapters: Sequence[Chapter], command: str, versions: Mapping[str, str], written: str, kinematic: bool
) -> str:
    """The text of `report.html`.

    Args:
        chapters: the scenarios in order.
        command: the command line that made the comparison.
        versions: what it was made with, by name.
        written: date and time.
        kinematic: a point flew instead of the aircraft.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("harness"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(TEMPLATE).render(
        chapters=chapters,
        figures=[figure for figure in FIGURES if figure.short != "digest"],
        command=command,
        versions=versions,
        written=written,
        kinematic=kinematic,
        dash=DASH,
    )
