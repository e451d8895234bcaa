"""The rows of the tables at the end of `fly` and `check`, from the content of `metrics.json`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from harness.cli.terminal import coloured, legible, plain, spread
from harness.files.wording import counted, tallied

SHOWN: Final = 6
"""Most corners, legs, contacts and breaches that are listed; the others are counted."""

MOST_ITEMS: Final = 12
"""Most items of a mission that are listed one by one."""

OF_HEIGHT_OR_SPEED: Final = (
    "climb too steep",
    "descent too steep",
    "speed or throttle saturation",
    "control saturation",
    "stall",
)
"""Causes at which a leg's errors of altitude and airspeed are told beside its cross-track error."""


def flight_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """Name and value of each row of the table of a flight."""
    compute, timing = metrics["compute_ms"], metrics["timing"]
    lengths = [legible(metrics[name]) for name in ("flown_length_m", "planned_length_m")]
    rows = {
        "outcome": f"{coloured(metrics['outcome'])}: {plain(metrics['reason'])}"
        + ("; traceback: `error` in metrics.json" if metrics.get("error") else ""),
        "length flown": f"{lengths[0]} m, planned {lengths[1]} m",
        "flight time": f"{legible(metrics['flight_time_s'])} s",
        "least clearance": f"{legible(metrics['min_clearance_m'])} m, below the wanted one for "
        f"{legible(metrics['clearance_violation_s'])} s",
    }
    above_m = metrics.get("min_altitude_above_ground_m")
    if above_m is not None:
        rows["above ground"] = f"at least {legible(above_m)} m"
    return {
        **rows,
        **error_rows(metrics),
        "altitude error": f"{spread(metrics['altitude_error_m'])} m",
        "trackable": _tracked(metrics),
        **{each["kind"]: plain(each["text"]) for each in metrics.get("findings", ())},
        "replans": str(metrics["replans"]),
        "planner time": f"p99 {legible(compute['p99'])} / max {legible(compute['max'])} ms a search",
        "wall time": f"{legible(timing['wall_s'])} s, {legible(timing['realtime_factor'])} x real time",
    }


def error_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """Rows on how far the true and the believed position were off the path; one where navigation was perfect.

    The names are those of performance-based navigation (ICAO Doc 9613).
    """
    legs, margin_m = metrics["trackability"], metrics.get("navigation_margin_m")
    total = metrics.get("total_system_error_m", metrics["cross_track_m"])
    threshold_m = legs[0].get("threshold_m") if legs else None
    allowed = "" if threshold_m is None else f", allowed {threshold_m:.3g} m"
    kept = f", of which {legible(margin_m)} m are the navigation margin that was planned" if margin_m else ""
    rows = {"total system error": f"{spread(total)} m{allowed}{kept}"}
    if metrics.get("navigation_error_m") is not None:
        rows["  flight technical error"] = f"{spread(metrics['flight_technical_error_m'])} m"
        rows["  navigation error"] = f"{spread(metrics['navigation_error_m'])} m"
    return rows


def _tracked(metrics: Mapping[str, Any]) -> str:
    """Whether all legs were tracked, and why some were not; of plans that are judged together, how many they are."""
    if metrics["trackable"]:
        return "yes"
    legs, plans = metrics["trackability"], metrics["replans"] + 1
    bad = [leg["cause"] for leg in legs if not leg["trackable"]]
    if not bad:
        return "no: no plan was flown"
    told = f"no: {len(bad)} of {len(legs)} legs, {tallied(bad, 'legs')}"
    if plans > len(legs):
        told += f" ({plans} plans; one flown for less than 5 s is judged with the next)"
    return told


def verdict_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """Name and value of each row of the table of `check`."""
    legs, check = metrics["trackability"], metrics["check"]
    point = "item" if check["items"] else "waypoint"
    style, (word, _, why) = "bold green" if check["ok"] else "bold red", check["verdict"].partition(":")
    lengths = [f"{metrics['planned_length_m']:,.0f} m"]
    if "given_length_m" in check:  # in runs made since it is kept
        lengths = [f"{check['given_length_m']:,.0f} m", f"rounded {lengths[0]}"]
    rows = {
        "flown as given": f"[{style}]{word}[/]:{plain(why)}",
        "outcome": plain(f"{metrics['outcome']}: {metrics['reason']}"),
        "path": f"{check['points']} points, {', '.join(lengths)}, {counted(len(legs), 'leg')}",
    }
    _add_contacts(metrics, rows)
    _add_deviations(metrics, rows)
    bad = [{"number": number, **leg} for number, leg in enumerate(legs, start=1) if not leg["trackable"]]
    for leg in _listed(bad, "legs not trackable", rows):
        to = f" to {point} {leg['waypoint']}" if check["items"] and leg["waypoint"] is not None else ""
        rows[f"  leg {leg['number']}{to}"] = (
            f"{leg['start_s']:.0f} to {leg['end_s']:.0f} s: {leg['cause']}, {_metres(leg['max_deviation_m'])} off"
        )
        if leg["cause"] in OF_HEIGHT_OR_SPEED:
            rows[f"  leg {leg['number']}{to}"] += f", {_metres(leg['max_altitude_error_m'])} in altitude"
            if (slow_mps := leg["max_airspeed_error_mps"]) is not None:
                rows[f"  leg {leg['number']}{to}"] += f", {slow_mps:.2g} m/s in airspeed"
    for corner in _listed(sorted(check["corners"], key=lambda each: each["kept"]), "corners cut", rows):
        side = "left" if corner["turn_deg"] > 0 else "right"
        rows[f"  {point} {corner['waypoint']}"] = (
            f"{abs(corner['turn_deg']):.0f} deg {side}, {_rounded(corner)}"
        )
    _add_items(check["items"], rows)
    for number, note in enumerate(check["notes"]):
        rows["notes" if not number else " " * (number + 1)] = plain(note)
    rows["smoothness as given"] = _smoothness(check["given"])
    rows["smoothness as flown"] = _smoothness(metrics["smoothness"]["flown"])
    return rows


def _smoothness(figures: Mapping[str, float]) -> str:
    curvature_1pm = figures["max_curvature_1pm"]
    tightest = f"tightest {1.0 / curvature_1pm:,.0f} m" if curvature_1pm > 1e-9 else "no turn"
    energy = f"energy {figures['bending_energy_1pm']:.2g} /m"
    return f"turns {figures['heading_change_deg']:,.0f} deg, {energy}, {tightest}"


def _add_deviations(metrics: Mapping[str, Any], rows: dict[str, str]) -> None:
    """How far the flight was off the path, where most, and off the altitude."""
    legs, check, worst = metrics["trackability"], metrics["check"], metrics["check"]["worst"]
    tolerance = f"{legs[0]['threshold_m']:.3g} m" if legs else "none"
    off = spread(metrics["deviation_from_given_m"], ("p95", "max"))
    rows["off the path given"] = f"{off} m, allowed {tolerance}"
    if legs and any(corner["allowed_cut_m"] != legs[0]["threshold_m"] for corner in check["corners"]):
        rows["off the path given"] += ", at corners as below"
    rows["  worst place"] = (
        f"{_metres(worst['off_m'])} off at {_where(worst)}; allowed {_metres(worst['allowed_m'])}"
    )
    rows |= error_rows(metrics)
    rows["altitude error"] = f"{spread(metrics['altitude_error_m'])} m"
    if "height_above_ground_m" in metrics:
        height = metrics["height_above_ground_m"]
        rows["above ground"] = (
            f"least {_metres(height['min'])} at {_where(height)}; mean {_metres(height['mean'])}"
        )


def _where(place: Mapping[str, float]) -> str:
    return f"{place['time_s']:.0f} s, ({place['east_m']:.0f}, {place['north_m']:.0f}) m"


def _add_contacts(metrics: Mapping[str, Any], rows: dict[str, str]) -> None:
    """What was touched and crossed, and the least distance, where there was anything."""
    if metrics["min_clearance_m"] is not None:
        rows["least clearance"] = f"{metrics['min_clearance_m']:,.4g} m"
    for one, many in (("contact", "contacts"), ("breach", "breaches")):
        for number, each in enumerate(_listed(metrics[many], many, rows), start=1):
            rows[f"  {one} {number}"] = plain(
                f"{each['name']}, {each['start_s']:.0f} to {each['end_s']:.0f} s, by {each['depth_m']:.3g} m at "
                f"({each['east_m']:.0f}, {each['north_m']:.0f}) m"
            )


def _add_items(items: Sequence[Mapping[str, str]], rows: dict[str, str]) -> None:
    """What became of the items of a mission: all are counted, those of note are named."""
    if not items:
        return
    kinds = [item["what"] for item in items]
    tally = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
    rows["items"] = f"{len(items)}: {tally}"
    told = [
        each
        for each in items
        if each["what"] == "not flown" or (each["what"] in ("flown", "not reached") and each["why"])
    ]
    for item in told[:MOST_ITEMS]:
        why = f": {item['why']}" if item["why"] else ""
        rows[f"  item {item['item']} "] = plain(f"{item['name']}, {item['what']}{why}")
    if len(told) > MOST_ITEMS:
        rows["  more"] = f"{len(told) - MOST_ITEMS}, in metrics.json"


def _listed(entries: Sequence[Any], title: str, rows: dict[str, str]) -> Sequence[Any]:
    """The first few entries, and a row that counts them all."""
    if entries:
        more = f", the first {SHOWN}:" if len(entries) > SHOWN else ""
        rows[title] = f"{len(entries)}{more}"
    return entries[:SHOWN]


def _rounded(corner: Mapping[str, Any]) -> str:
    """How a corner was rounded."""
    allowed, cut_m = f"{corner['allowed_cut_m']:.3g} m allowed", corner["flown_cut_m"]
    if cut_m is None:
        return f"not reached; {allowed}"
    if not corner["radius_m"]:
        return f"passed at {cut_m:.0f} m; {allowed}"
    told = f"radius {corner['radius_m']:.0f} m, cut by {cut_m:.0f} m"
    if corner["most_off_m"] > max(1.1 * cut_m, corner["allowed_cut_m"]):
        told += f", {corner['most_off_m']:.0f} m off after it"
    return f"{told}; {allowed}"


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{legible(value)} m"
