"""The table at the end of `wayproof check`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from harness.cli.terminal import causes, plain
from harness.files.wording import counted

SHOWN = 6
"""So many corners and legs are listed; the others are counted."""


def verdict_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """The rows of the table, from the content of `metrics.json`.

    Args:
        metrics: as `harness.run.path_flight.check_path` returns it.
    """
    legs, check = metrics["trackability"], metrics["check"]
    bad = [{"number": number, **leg} for number, leg in enumerate(legs, start=1) if not leg["trackable"]]
    cross = metrics["cross_track_m"]
    style, word = ("bold green", "yes") if metrics["trackable"] else ("bold red", "no")
    rows = {
        "trackable": f"[{style}]{word}[/]" + (f": {causes(bad)}" if bad else ""),
        "flown": plain(f"{metrics['outcome']}: {metrics['reason']}"),
        "path": f"{check['points']} points, {metrics['planned_length_m']:,.0f} m, "
        f"{counted(len(legs), 'leg')}",
        "cross-track error": f"rms {cross['rms']:.3g} / p95 {cross['p95']:.3g} / max {cross['max']:.3g} m, "
        f"allowed {legs[0]['threshold_m']:.3g} m",
    }
    for leg in _listed(bad, "legs not trackable", rows):
        cut = leg["corner_cut_m"]
        off = f"{leg['max_cross_track_m']:.3g} m off" + (f", corner to be cut by {cut:.0f} m" if cut else "")
        rows[f"  leg {leg['number']}"] = (
            f"{leg['start_s']:.0f} to {leg['end_s']:.0f} s: {leg['cause']}, {off}"
        )
    for corner in _listed(check["corners"], "corners cut", rows):
        side = "left" if corner["turn_deg"] > 0 else "right"
        rows[f"  waypoint {corner['waypoint']}"] = (
            f"{abs(corner['turn_deg']):.0f} deg {side}, {_rounded(corner)}"
        )
    for name, figures in (("as given", check["given"]), ("as flown", metrics["smoothness"]["flown"])):
        rows[f"smoothness {name}"] = (
            f"turns {figures['heading_change_deg']:,.0f} deg, energy {figures['bending_energy_1pm']:.2g} /m, "
            f"tightest {_radius(figures['max_curvature_1pm'])}"
        )
    return rows


def _listed(entries: list[Any], title: str, rows: dict[str, str]) -> list[Any]:
    """The first few entries, and a row that counts them all."""
    if entries:
        more = f", the first {SHOWN}:" if len(entries) > SHOWN else ""
        rows[title] = f"{len(entries)}{more}"
    return entries[:SHOWN]


def _rounded(corner: dict[str, Any]) -> str:
    """How a corner was rounded."""
    if not corner["radius_m"]:
        return "no arc leads straight back"
    if corner["flown_cut_m"] is None:
        return f"radius {corner['radius_m']:.0f} m, not reached"
    return (
        f"radius {corner['radius_m']:.0f} m, "
        f"cut by {corner['flown_cut_m']:.0f} of {corner['allowed_cut_m']:.0f} m"
    )


def _radius(curvature_1pm: float) -> str:
    return f"{1.0 / curvature_1pm:,.0f} m" if curvature_1pm > 1e-9 else "straight"
