"""The table at the end of `wayproof check`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from harness.cli.terminal import error_rows, legible, plain, spread
from harness.files.wording import counted

MOST_ITEMS = 12
"""Most items of a mission that are listed one by one."""

SHOWN = 6
"""Most corners, legs, contacts and breaches that are listed; the others are counted."""


def verdict_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """The rows of the table, from the content of `metrics.json`.

    Args:
        metrics: as `harness.run.path_check.measured` returns it.
    """
    legs, check = metrics["trackability"], metrics["check"]
    point = "item" if check["items"] else "waypoint"
    bad = [{"number": number, **leg} for number, leg in enumerate(legs, start=1) if not leg["trackable"]]
    off = metrics["deviation_from_given_m"]
    style, (word, _, why) = "bold green" if check["ok"] else "bold red", check["verdict"].partition(":")
    rows = {
        "flown as given": f"[{style}]{word}[/]:{plain(why)}",
        "outcome": plain(f"{metrics['outcome']}: {metrics['reason']}"),
        "path": f"{check['points']} points, {metrics['planned_length_m']:,.0f} m, {counted(len(legs), 'leg')}",
    }
    _add_contacts(metrics, rows)
    tolerance = f"{legs[0]['threshold_m']:.3g} m" if legs else "none"
    rows["off the path given"] = f"{spread(off, ('p95', 'max'))} m, allowed {tolerance}"
    if legs and any(corner["allowed_cut_m"] != legs[0]["threshold_m"] for corner in check["corners"]):
        rows["off the path given"] += ", at corners as below"
    worst = check["worst"]
    rows["  worst place"] = (
        f"{_metres(worst['off_m'])} off at {worst['time_s']:.0f} s, ({worst['east_m']:.0f}, "
        f"{worst['north_m']:.0f}) m; allowed {_metres(worst['allowed_m'])}"
    )
    rows |= error_rows(metrics)
    rows["altitude error"] = f"{spread(metrics['altitude_error_m'])} m"
    if "height_above_ground_m" in metrics:
        height = metrics["height_above_ground_m"]
        rows["above ground"] = (
            f"least {_metres(height['min'])} at {height['time_s']:.0f} s, ({height['east_m']:.0f}, "
            f"{height['north_m']:.0f}) m; mean {_metres(height['mean'])}"
        )
    for leg in _listed(bad, "legs not trackable", rows):
        to = f" to {point} {leg['waypoint']}" if check["items"] and leg["waypoint"] is not None else ""
        rows[f"  leg {leg['number']}{to}"] = (
            f"{leg['start_s']:.0f} to {leg['end_s']:.0f} s: {leg['cause']}, "
            f"{_metres(leg['max_deviation_m'])} off{_in_altitude(leg)}"
        )
    corners = sorted(check["corners"], key=lambda corner: corner["kept"])
    for corner in _listed(corners, "corners cut", rows):
        side = "left" if corner["turn_deg"] > 0 else "right"
        rows[f"  {point} {corner['waypoint']}"] = (
            f"{abs(corner['turn_deg']):.0f} deg {side}, {_rounded(corner)}"
        )
    _add_items(check["items"], rows)
    for number, note in enumerate(check["notes"]):
        rows["notes" if not number else " " * (number + 1)] = plain(note)
    for name, figures in (("as given", check["given"]), ("as flown", metrics["smoothness"]["flown"])):
        rows[f"smoothness {name}"] = (
            f"turns {figures['heading_change_deg']:,.0f} deg, energy {figures['bending_energy_1pm']:.2g} /m, "
            f"{_tightest(figures['max_curvature_1pm'])}"
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


def _add_items(items: Sequence[Mapping[str, str]], rows: dict[str, str]) -> None:
    """What became of the items of a mission: all are counted, those of note are named."""
    if not items:
        return
    kinds = [item["what"] for item in items]
    rows["items"] = f"{len(items)}: " + ", ".join(
        f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds)
    )
    told = [
        item
        for item in items
        if item["what"] == "not flown" or (item["what"] in ("flown", "not reached") and item["why"])
    ]
    for item in told[:MOST_ITEMS]:
        why = f": {item['why']}" if item["why"] else ""
        rows[f"  item {item['item']} "] = plain(f"{item['name']}, {item['what']}{why}")
    if len(told) > MOST_ITEMS:
        rows["  more"] = f"{len(told) - MOST_ITEMS}, in metrics.json"


def _in_altitude(leg: Mapping[str, Any]) -> str:
    """How far a leg is off in altitude, where that is why it is not trackable."""
    if leg["cause"] not in ("climb too steep", "descent too steep"):
        return ""
    return f", {_metres(leg['max_altitude_error_m'])} in altitude"


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
        return f"passed at {corner['flown_cut_m']:.0f} m; {allowed}"
    told = f"radius {corner['radius_m']:.0f} m, cut by {corner['flown_cut_m']:.0f} m"
    if corner["most_off_m"] > max(1.1 * corner["flown_cut_m"], corner["allowed_cut_m"]):
        told += f", {corner['most_off_m']:.0f} m off after it"
    return f"{told}; {allowed}"


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{legible(value)} m"


def _tightest(curvature_1pm: float) -> str:
    return f"tightest {1.0 / curvature_1pm:,.0f} m" if curvature_1pm > 1e-9 else "no turn"
