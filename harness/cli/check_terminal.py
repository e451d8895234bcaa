"""The table at the end of `wayproof check`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from harness.cli.terminal import plain
from harness.files.wording import counted

SHOWN = 6
"""So many corners, legs, contacts and breaches are listed; the others are counted."""


def verdict_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """The rows of the table, from the content of `metrics.json`.

    Args:
        metrics: as `harness.run.path_check.measured` returns it.
    """
    legs, check = metrics["trackability"], metrics["check"]
    bad = [{"number": number, **leg} for number, leg in enumerate(legs, start=1) if not leg["trackable"]]
    cross, off = metrics["cross_track_m"], metrics["deviation_from_given_m"]
    style, (word, _, why) = "bold green" if check["ok"] else "bold red", check["verdict"].partition(":")
    rows = {
        "flown as given": f"[{style}]{word}[/]:{plain(why)}",
        "outcome": plain(f"{metrics['outcome']}: {metrics['reason']}"),
        "path": f"{check['points']} points, {metrics['planned_length_m']:,.0f} m, {counted(len(legs), 'leg')}",
    }
    _add_contacts(metrics, rows)
    tolerance = f"{legs[0]['threshold_m']:.3g} m" if legs else "none"
    rows["off the path given"] = f"p95 {_metres(off['p95'])} / max {_metres(off['max'])}, allowed {tolerance}"
    if any(corner["allowed_cut_m"] != legs[0]["threshold_m"] for corner in check["corners"]):
        rows["off the path given"] += ", at corners as below"
    rows["cross-track error"] = (
        f"rms {_metres(cross['rms'])} / p95 {_metres(cross['p95'])} / max {_metres(cross['max'])}"
    )
    for leg in _listed(bad, "legs not trackable", rows):
        rows[f"  leg {leg['number']}"] = (
            f"{leg['start_s']:.0f} to {leg['end_s']:.0f} s: {leg['cause']}, "
            f"{_metres(leg['max_deviation_m'])} off"
        )
    corners = sorted(check["corners"], key=lambda corner: corner["kept"])
    for corner in _listed(corners, "corners cut", rows):
        side = "left" if corner["turn_deg"] > 0 else "right"
        rows[f"  waypoint {corner['waypoint']}"] = (
            f"{abs(corner['turn_deg']):.0f} deg {side}, {_rounded(corner)}"
        )
    for number, note in enumerate(check["notes"]):
        rows["also in the file" if not number else " " * (number + 1)] = plain(note)
    for name, figures in (("as given", check["given"]), ("as flown", metrics["smoothness"]["flown"])):
        rows[f"smoothness {name}"] = (
            f"turns {figures['heading_change_deg']:,.0f} deg, energy {figures['bending_energy_1pm']:.2g} /m, "
            f"tightest {_radius(figures['max_curvature_1pm'])}"
        )
    return rows


def _add_contacts(metrics: Mapping[str, Any], rows: dict[str, str]) -> None:
    """What was touched and crossed, and the least distance, where there was anything."""
    if metrics["min_clearance_m"] is not None:
        rows["least clearance"] = f"{metrics['min_clearance_m']:,.4g} m"
    for title, found in (("contacts", metrics["contacts"]), ("breaches", metrics["breaches"])):
        for number, each in enumerate(_listed(found, title, rows), start=1):
            rows[f"  {title[:-2] if title == 'breaches' else title[:-1]} {number}"] = plain(
                f"{each['name']}, {each['start_s']:.0f} to {each['end_s']:.0f} s, by {each['depth_m']:.3g} m at "
                f"({each['east_m']:.0f}, {each['north_m']:.0f}) m"
            )


def _listed(entries: Sequence[Any], title: str, rows: dict[str, str]) -> Sequence[Any]:
    """The first few entries, and a row that counts them all."""
    if entries:
        more = f", the first {SHOWN}:" if len(entries) > SHOWN else ""
        rows[title] = f"{len(entries)}{more}"
    return entries[:SHOWN]


def _rounded(corner: dict[str, Any]) -> str:
    """How a corner was rounded."""
    allowed = f"{corner['allowed_cut_m']:.3g} m allowed"
    if corner["flown_cut_m"] is None:
        return f"not reached; {allowed}"
    if not corner["radius_m"]:
        return f"no arc leads straight back, passed at {corner['flown_cut_m']:.0f} m; {allowed}"
    return f"radius {corner['radius_m']:.0f} m, cut by {corner['flown_cut_m']:.0f} m; {allowed}"


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g} m"


def _radius(curvature_1pm: float) -> str:
    return f"{1.0 / curvature_1pm:,.0f} m" if curvature_1pm > 1e-9 else "straight"
