"""The rows of a comparison and their forms: CSV for programs, Markdown for papers, labels for people."""

from __future__ import annotations

import csv
import html
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

from harness.files.wording import printable

ERROR = "error"
"""Outcome of a flight whose software failed before its end; the other outcomes are those of `metrics.json`."""

DASH = "\N{EN DASH}"


@dataclass(frozen=True)
class Row:
    """One planner, under one guidance law, on one scenario. A figure that does not exist is None.

    Attributes:
        scenario: its name.
        planner: its kind.
        outcome: as in `metrics.json`, or `error`.
        reason: the same as a sentence.
        flown_length_m: length of the flown track.
        optimum_m: the clairvoyant shortest path for a point that keeps the clearance.
        ratio: flown length over the optimum; only where the goal was reached. The flight ends at the edge of
            the goal circle, the optimum at its centre.
        min_clearance_m: least distance to an obstacle edge.
        clearance_violation_s: time below the wanted clearance.
        turn_radius_m: smallest radius that a plan may ask the aircraft for.
        tightest_turn: largest planned curvature times that radius, as in `PlannedRows`: the turn onto a plan
            that takes effect counts too; above 1 the aircraft cannot follow.
        tightest_flown_turn: largest flown curvature times that radius.
        planned_heading_change_deg: sum of all changes of direction of the plans in effect.
        flown_heading_change_deg: the same of the flown track.
        planned_bending_energy_1pm: integral of the squared curvature over the length.
        flown_bending_energy_1pm: the same of the flown track.
        cross_track_p95_m: 95th percentile of the distance from the plan in effect.
        cross_track_max_m: its largest value.
        trackable: whether every leg of the plans was tracked; None where a point flew, which tracks anything.
        planner_p50_ms: wall-clock time of a search, median.
        planner_p99_ms: the same, 99th percentile.
        planner_max_ms: the same, largest.
        replans: plans accepted after the first.
        digest: SHA-256 of the track.
        guidance: the guidance law; empty where all flew under the same one.
        bank_saturation_fraction: share of the time at the bank limit.
        cause: why the first leg that was not tracked was not; empty where all were.
        navigation_error_p95_m: distance from the true position to the believed one, 95th percentile; None where
            navigation is perfect.
        navigation_error_max_m: the same, largest.
        navigation_jump_m: the most that it changes from one row of the track to the next; likewise.
        plan_delay_max_s: longest time from the latest scan that a plan could know of until it took effect.
        lost_returns: share of the beams that met something and returned nothing; None without a sensor.
    """

    scenario: str
    planner: str
    outcome: str
    reason: str
    flown_length_m: float | None = None
    optimum_m: float | None = None
    ratio: float | None = None
    min_clearance_m: float | None = None
    clearance_violation_s: float | None = None
    turn_radius_m: float | None = None
    tightest_turn: float | None = None
    tightest_flown_turn: float | None = None
    planned_heading_change_deg: float | None = None
    flown_heading_change_deg: float | None = None
    planned_bending_energy_1pm: float | None = None
    flown_bending_energy_1pm: float | None = None
    cross_track_p95_m: float | None = None
    cross_track_max_m: float | None = None
    trackable: bool | None = None
    planner_p50_ms: float | None = None
    planner_p99_ms: float | None = None
    planner_max_ms: float | None = None
    replans: int | None = None
    digest: str = ""
    guidance: str = ""
    bank_saturation_fraction: float | None = None
    cause: str = ""
    navigation_error_p95_m: float | None = None
    navigation_error_max_m: float | None = None
    navigation_jump_m: float | None = None
    plan_delay_max_s: float | None = None
    lost_returns: float | None = None

    @property
    def label(self) -> str:
        """What people are shown as its name."""
        return f"{self.planner}, {self.guidance}" if self.guidance else self.planner


def row_of(
    scenario: str,
    planner: str,
    metrics: Mapping[str, Any],
    *,
    optimum_m: float | None,
    turn_radius_m: float,
    tightest_1pm: float,
    kinematic: bool,
    guidance: str = "",
) -> Row:
    """The row of a flight that came to an end.

    Args:
        scenario: its name.
        planner: its kind.
        metrics: content of `metrics.json`.
        optimum_m: the clairvoyant optimum; None where there is none.
        turn_radius_m: smallest radius of the aircraft.
        tightest_1pm: largest planned curvature.
        kinematic: a point flew.
        guidance: the law, where several are compared.
    """
    planned, flown = metrics["smoothness"]["planned"], metrics["smoothness"]["flown"]
    length, compute, reached = (
        metrics["flown_length_m"],
        metrics["compute_ms"],
        metrics["outcome"] == "reached",
    )
    return Row(
        scenario=scenario,
        planner=planner,
        outcome=metrics["outcome"],
        reason=metrics["reason"],
        flown_length_m=length,
        optimum_m=optimum_m,
        ratio=length / optimum_m if reached and optimum_m else None,
        min_clearance_m=metrics["min_clearance_m"],
        clearance_violation_s=metrics["clearance_violation_s"],
        turn_radius_m=turn_radius_m,
        tightest_turn=tightest_1pm * turn_radius_m,
        tightest_flown_turn=flown["max_curvature_1pm"] * turn_radius_m,
        planned_heading_change_deg=planned["heading_change_deg"],
        flown_heading_change_deg=flown["heading_change_deg"],
        planned_bending_energy_1pm=planned["bending_energy_1pm"],
        flown_bending_energy_1pm=flown["bending_energy_1pm"],
        cross_track_p95_m=metrics["cross_track_m"]["p95"],
        cross_track_max_m=metrics["cross_track_m"]["max"],
        trackable=None if kinematic else metrics["trackable"],
        planner_p50_ms=compute["p50"],
        planner_p99_ms=compute["p99"],
        planner_max_ms=compute["max"],
        replans=metrics["replans"],
        digest=metrics["digest"],
        guidance=guidance,
        bank_saturation_fraction=metrics["bank_saturation_fraction"],
        cause=""
        if kinematic
        else next((leg["cause"] for leg in metrics["trackability"] if leg["cause"]), ""),
        navigation_error_p95_m=_within(metrics, "navigation_error_m", "p95"),
        navigation_error_max_m=_within(metrics, "navigation_error_m", "max"),
        navigation_jump_m=metrics.get("navigation_jump_m"),
        plan_delay_max_s=_within(metrics, "plan_delay_s", "max"),
        lost_returns=_within(metrics, "lost_returns", "share"),
    )


def _within(metrics: Mapping[str, Any], name: str, figure: str) -> float | None:
    """A figure of a group that only some flights have, or older versions did not write."""
    value: float | None = metrics.get(name, {}).get(figure)
    return value


@dataclass(frozen=True)
class Figure:
    """One line of a table for people.

    Attributes:
        label: what it is, with its unit.
        short: the same in a few letters, for a terminal.
        text: its value in a row.
        hint: what it means, where the label does not say it; empty else.
        everywhere: it is shown where no row has a value, too.
    """

    label: str
    short: str
    text: Callable[[Row], str]
    hint: str = ""
    everywhere: bool = True


FIGURES = (
    Figure(
        "outcome",
        "outcome",
        lambda row: row.outcome,
        hint="how the flight ended; error: the software failed before the end, which says nothing of the aircraft",
    ),
    Figure("flown length, km", "km", lambda row: number(row.flown_length_m, 1e-3)),
    Figure(
        "ratio to the clairvoyant optimum",
        "ratio",
        lambda row: _fixed(row.ratio, 4),
        hint="flown length over the shortest path of a point that knows the world and keeps the clearance",
    ),
    Figure("least clearance, m", "clear m", lambda row: number(row.min_clearance_m)),
    Figure("below the wanted clearance, s", "below s", lambda row: number(row.clearance_violation_s)),
    Figure(
        "tightest planned turn, curvature · turn radius",
        "κ·R",
        lambda row: _fixed(row.tightest_turn, 2),
        hint="largest planned curvature times the smallest turn radius; above 1 the aircraft cannot follow",
    ),
    Figure(
        "tightest flown turn, curvature · turn radius",
        "κ·R fl.",
        lambda row: _fixed(row.tightest_flown_turn, 2),
        hint="largest curvature of the track times the smallest turn radius that a plan may ask for",
    ),
    Figure(
        "trackable",
        "tracks",
        lambda row: {None: "", True: "yes", False: "no"}[row.trackable],
        hint="every leg was flown within the limits for cross-track error, altitude, airspeed and load",
    ),
    Figure("cause of the first leg not tracked", "cause", lambda row: row.cause),
    Figure("time at the bank limit, %", "bank %", lambda row: number(row.bank_saturation_fraction, 100.0)),
    Figure("cross-track error p95, m", "xt p95", lambda row: number(row.cross_track_p95_m)),
    Figure("cross-track error max, m", "xt max", lambda row: number(row.cross_track_max_m)),
    Figure(
        "navigation error p95, m",
        "nav p95",
        lambda row: number(row.navigation_error_p95_m),
        hint="distance from the true position to the one that the aircraft believed to have",
        everywhere=False,
    ),
    Figure(
        "navigation error max, m", "nav max", lambda row: number(row.navigation_error_max_m), everywhere=False
    ),
    Figure(
        "largest jump of the believed position, m",
        "nav jump",
        lambda row: number(row.navigation_jump_m),
        hint="the most that the navigation error changes in a tenth of a second, when a fix comes back for example",
        everywhere=False,
    ),
    Figure(
        "heading change planned, °",
        "turn °",
        lambda row: number(row.planned_heading_change_deg),
        hint="sum of all changes of direction of the plans in effect",
    ),
    Figure("heading change flown, °", "flown °", lambda row: number(row.flown_heading_change_deg)),
    Figure(
        "bending energy planned, 1/km",
        "bend",
        lambda row: number(row.planned_bending_energy_1pm, 1e3),
        hint="integral of the squared curvature along the plans in effect",
    ),
    Figure(
        "bending energy flown, 1/km",
        "bend fl.",
        lambda row: number(row.flown_bending_energy_1pm, 1e3),
        hint="integral of the squared curvature along the track",
    ),
    Figure("planner time p50, ms", "p50 ms", lambda row: number(row.planner_p50_ms)),
    Figure("planner time p99, ms", "p99 ms", lambda row: number(row.planner_p99_ms)),
    Figure("planner time max, ms", "max ms", lambda row: number(row.planner_max_ms)),
    Figure(
        "plan delay max, s",
        "delay s",
        lambda row: number(row.plan_delay_max_s) if row.plan_delay_max_s else "",
        hint="simulated time from the latest scan that a plan could know of until it was flown",
        everywhere=False,
    ),
    Figure(
        "returns lost by the sensor, %",
        "lost %",
        lambda row: number(row.lost_returns, 100.0) if row.lost_returns else "",
        hint="share of the beams that met something and returned nothing",
        everywhere=False,
    ),
    Figure("replans", "replans", lambda row: "" if row.replans is None else str(row.replans)),
    Figure("digest", "digest", lambda row: row.digest[:12]),
)
"""What people may be shown, in this order."""

ON_TERMINAL = ("outcome", "km", "ratio", "clear m", "κ·R", "tracks", "xt max", "p99 ms")
"""Those that fit 80 columns, by `short`."""


def shown_figures(rows: Sequence[Row]) -> list[Figure]:
    """The figures that a table of rows shows."""
    return [figure for figure in FIGURES if figure.everywhere or any(map(figure.text, rows))]


def number(value: float | None, factor: float = 1.0) -> str:
    """A value times a factor with three or four digits; empty where there is none."""
    if value is None:
        return ""
    scaled = value * factor
    if abs(scaled) < 1e-3:
        return "0" if scaled == 0 else f"{scaled:.1e}"
    return (
        f"{scaled:.0f}" if abs(scaled) >= 1000 else f"{scaled:.3g}" if abs(scaled) < 100 else f"{scaled:.1f}"
    )


def _fixed(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def to_csv(rows: Sequence[Row]) -> str:
    """All figures at full precision; a figure that does not exist is an empty cell."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    for row in rows:
        cells = asdict(row).items()
        writer.writerow({key: printable(cell) if isinstance(cell, str) else cell for key, cell in cells})
    return text.getvalue()


def to_markdown(rows: Sequence[Row]) -> str:
    """One table a scenario: a line for each figure, a column for each planner."""
    parts = []
    for name in dict.fromkeys(row.scenario for row in rows):
        own = [row for row in rows if row.scenario == name]
        lines = [f"## {escaped(name)}", "", _line(["", *(row.label for row in own)])]
        lines.append(_line(["---", *("---:" for _ in own)]))
        shown = shown_figures(own)
        lines += [_line([figure.label, *(figure.text(row) or DASH for row in own)]) for figure in shown]
        lines += ["", *(f"- {escaped(row.label)}: {escaped(row.reason)}" for row in own), ""]
        parts.append("\n".join(lines))
    return "\n".join(parts)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(map(escaped, cells))} |"


def escaped(text: str) -> str:
    """Text in one line that Markdown takes for nothing else, nor whoever shows its HTML."""
    text = html.escape(printable(" ".join(text.splitlines())), quote=False)
    for mark in "\\|`*[]":
        text = text.replace(mark, f"\\{mark}")
    return text
