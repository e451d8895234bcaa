"""Reports, of a comparison and of a single run: one HTML file that needs nothing but itself."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jinja2

from harness.analysis.causes import FINDINGS
from harness.analysis.metric import Metric, number
from harness.analysis.rows import DASH, Row, shown_figures
from harness.report.remarks import Remark


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
    chapters: Sequence[Chapter],
    command: str,
    versions: Mapping[str, str],
    written: str,
    kinematic: bool,
    duels: Sequence[Any] = (),
) -> str:
    """The text of `report.html`; `duels` are planners in pairs, as `harness.campaign.paired` has them."""
    return rendered(
        "comparison.html",
        duels=duels,
        number=number,
        chapters=chapters,
        command=command,
        versions=versions,
        written=written,
        kinematic=kinematic,
    )


@dataclass(frozen=True)
class JudgedBy:
    """A figure of a leg that has a limit.

    Attributes:
        figure: its name in `trackability` of `metrics.json`.
        label: what people are shown, with its unit.
        most: the limit.
    """

    figure: str
    label: str
    most: float

    def exceeded(self, leg: Mapping[str, Any]) -> bool:
        """Whether a leg is over the limit; not where it has no such figure."""
        value = leg.get(self.figure)
        return value is not None and value > self.most


def run_html(
    chapter: Chapter,
    legs: Sequence[Mapping[str, Any]],
    checked: Mapping[str, Any] | None,
    *,
    judged: Sequence[JudgedBy],
    remarks: Sequence[Remark],
    aircraft: str,
    scenario_yaml: str,
    command: str,
    versions: Mapping[str, str],
    platform: str,
    written: str,
) -> str:
    """The text of a single run's `report.html`.

    Args:
        chapter: with one row, and the figures of the path and of its profiles.
        legs: `trackability` of `metrics.json`.
        checked: `metrics.json` of a path that was given; None where a planner made the path.
        judged: what else than the distance from the path legs were judged by.
        remarks: what is said before the figures.
        aircraft: its name.
        scenario_yaml: the scenario as flown.
        command: the command line that flew it.
        versions: what flew, by name.
        platform: what it flew on.
        written: date and time of the flight.
    """
    lost = [leg for leg in legs if not leg["trackable"]]
    return rendered(
        "run.html",
        chapter=chapter,
        row=chapter.rows[0],
        number=number,
        legs=legs,
        lost=lost,
        findings={cause: FINDINGS[cause] for cause in FINDINGS if cause in {leg["cause"] for leg in lost}},
        exceeded=[each for each in judged if any(map(each.exceeded, lost))],
        checked=checked,
        remarks=remarks,
        aircraft=aircraft,
        scenario_yaml=scenario_yaml,
        command=command,
        versions=versions,
        platform=platform,
        written=written,
    )


def rendered(template: str, **values: Any) -> str:
    """A page from one of our templates, with values by the names that it uses."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("harness.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(shown=_shown, dash=DASH, **values)


def _shown(rows: Sequence[Row]) -> list[Metric]:
    """What a page shows of rows: a digest stands elsewhere."""
    return [figure for figure in shown_figures(rows) if figure.short != "digest"]
