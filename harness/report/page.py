"""The HTML page of a report, of a comparison or of a single run: one file that needs nothing but itself."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jinja2

from harness.analysis.metric import number
from harness.analysis.rows import DASH, Row, shown_figures
from harness.files.wording import metres


@dataclass(frozen=True)
class Picture:
    """A figure in the report: its SVG, what it shows for those who cannot see it, and a sentence below it."""

    svg: bytes
    alt: str
    caption: str

    @property
    def uri(self) -> str:
        """The figure as a data URI; as an image of its own, its ids cannot meet those of another."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.svg).decode("ascii")


@dataclass(frozen=True)
class Chapter:
    """One scenario: its facts (name and value), a row a planner, and a note where something is missing."""

    name: str
    facts: Mapping[str, str]
    rows: Sequence[Row]
    pictures: Sequence[Picture]
    note: str = ""


def rendered(template: str, **values: Any) -> str:
    """Renders a template with values by the names it uses, and `dash`, `metres`, `number`, `shown`; or TypeError."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("harness.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # The digest stands elsewhere.
    values["shown"] = lambda rows: [figure for figure in shown_figures(rows) if figure.short != "digest"]
    try:
        return environment.get_template(template).render(dash=DASH, metres=metres, number=number, **values)
    except jinja2.UndefinedError as error:
        raise TypeError(str(error)) from error
