"""The rows of the tables at the end of `fly` and `check`, from the content of `metrics.json`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from harness.cli.terminal import coloured, legible, plain, spread
from harness.files.wording import counted, metres, tallied

MOST_SHOWN: Final = 6
"""At most this many corners, legs, contacts, breaches and items of a mission are listed; the others are counted."""
TO_LIST: Final = ("not flown", "flown", "not reached")
"""Items of a mission that were treated so are listed if there is a reason to tell; items not flown always are."""
ASIDE_CAUSES: Final = ("turn radius too tight", "sensor horizon", "wind drift", "bank limit", "roll rate")
"""With any other cause a leg's errors of altitude and airspeed are shown beside its cross-track error."""


def flight_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """Returns name and value of each row of the table of a flight."""
    compute, timing = metrics["compute_ms"], metrics["timing"]
    lengths = [legible(metrics[name]) for name in ("flown_length_m", "planned_length_m")]
    least_m, below_s = metrics["min_clearance_m"], legible(metrics["clearance_violation_s"])
    least = f"{legible(least_m)} m, below the wanted one for {below_s} s"
    rows = {
        "outcome": f"{coloured(metrics['outcome'])}: {plain(metrics['reason'])}"
        + ("; traceback: `error` in metrics.json" if metrics.get("error") else ""),
        "length flown": f"{lengths[0]} m, planned {lengths[1]} m",
        "flight time": f"{legible(metrics['flight_time_s'])} s",
        "least clearance": "no obstacle" if least_m is None else least,
    }
    if (above_m := metrics.get("min_altitude_above_ground_m")) is not None:
        rows["above ground"] = f"at least {legible(above_m)} m{_known(metrics)}"
    return {
        **rows,
        **error_rows(metrics),
        "trackable": _tracking_text(metrics),
        **{each["kind"]: plain(each["text"]) for each in metrics.get("findings", ())},
        "replans": str(metrics["replans"]),
        "planner time": f"p99 {legible(compute['p99'])} / max {legible(compute['max'])} ms a search",
        "wall time": f"{legible(timing['wall_s'])} s, {legible(timing['realtime_factor'])} x real time",
    }


def error_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """Returns rows on how far the true and, where it differs, the believed position were off the path and altitude."""
    legs, margin_m = metrics["trackability"], metrics.get("navigation_margin_m")
    total = metrics.get("total_system_error_m", metrics["cross_track_m"])
    threshold_m = legs[0].get("threshold_m") if legs and "check" not in metrics else None
    allowed = "" if threshold_m is None else f", allowed {metres(threshold_m)}"
    part = f", of which {legible(margin_m)} m are the navigation margin that was planned" if margin_m else ""
    rows = {"total system error": f"{spread(total)} m{allowed}{part}"}
    if metrics.get("navigation_error_m") is not None:
        rows["  flight technical error"] = f"{spread(metrics['flight_technical_error_m'])} m"
        rows["  navigation error"] = f"{spread(metrics['navigation_error_m'])} m"
    return rows | {"altitude error": f"{spread(metrics['altitude_error_m'])} m"}


def _tracking_text(metrics: Mapping[str, Any]) -> str:
    """Tells whether all legs were tracked, and why some were not, and how many plans were judged together."""
    if metrics["trackable"]:
        return "yes"
    legs, plans = metrics["trackability"], metrics["replans"] + 1
    if not (bad := [leg["cause"] for leg in legs if not leg["trackable"]]):
        return "no: no plan was flown"
    text = f"no: {len(bad)} of {len(legs)} legs, {tallied(bad, 'legs')}"
    if plans > len(legs):
        text += f" ({plans} plans; one flown for less than 5 s is judged with the next)"
    return text


def verdict_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """Returns name and value of each row of the table of `check`."""
    legs, check = metrics["trackability"], metrics["check"]
    point = "item" if check["items"] else "waypoint"
    style, (answer, _, why) = "bold green" if check["ok"] else "bold red", check["verdict"].partition(":")
    lengths = f"{check['given_length_m']:,.0f} m, rounded {metrics['planned_length_m']:,.0f} m"
    corners = sorted(check["corners"], key=lambda each: each["kept"])
    names = [f"  {point} {each['waypoint']}" for each in corners[:MOST_SHOWN]]
    names = [name + "  " * names[:at].count(name) for at, name in enumerate(names)]  # no key twice
    bad = [{"number": number, **leg} for number, leg in enumerate(legs, start=1) if not leg["trackable"]]
    return {
        "flown as given": f"[{style}]{answer}[/]:{plain(why)}",
        "outcome": plain(f"{metrics['outcome']}: {metrics['reason']}"),
        "path": f"{check['points']} points, {lengths}, {counted(len(legs), 'leg')}",
        **_contacts(metrics),
        **_deviation_rows(metrics),
        **_count_row("legs not trackable", bad),
        **dict(_leg(leg, point if check["items"] else "") for leg in bad[:MOST_SHOWN]),
        **_count_row("corners cut", corners),
        **dict(zip(names, map(_corner, corners), strict=False)),
        **_items(check["items"]),
        **{" " * (at + 1) if at else "notes": plain(note) for at, note in enumerate(check["notes"])},
        "smoothness as given": _smoothness(check["given"]),
        "smoothness as flown": _smoothness(metrics["smoothness"]["flown"]),
    }


def _count_row(title: str, entries: Sequence[Any]) -> dict[str, str]:
    more = f", the first {MOST_SHOWN}:" if len(entries) > MOST_SHOWN else ""
    return {title: f"{len(entries)}{more}"} if entries else {}


def _leg(leg: Mapping[str, Any], point: str) -> tuple[str, str]:
    off = _metres(leg["max_deviation_m"])
    text = f"{leg['start_s']:.0f} to {leg['end_s']:.0f} s: {leg['cause']}, {off} off"
    if leg["cause"] not in ASIDE_CAUSES:
        text += f", {_metres(leg['max_altitude_error_m'])} in altitude"
        if (slow_mps := leg["max_airspeed_error_mps"]) is not None:
            text += f", {slow_mps:.2g} m/s in airspeed"
    to = f" to {point} {leg['waypoint']}" if point and leg["waypoint"] is not None else ""
    return f"  leg {leg['number']}{to}", text


def _smoothness(figures: Mapping[str, float]) -> str:
    curvature_1pm = figures["max_curvature_1pm"]
    tightest = f"tightest {1.0 / curvature_1pm:,.0f} m" if curvature_1pm > 1e-9 else "no turn"
    energy = f"energy {figures['bending_energy_1pm']:.2g} /m"
    return f"turns {figures['heading_change_deg']:,.0f} deg, {energy}, {tightest}"


def _deviation_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """Tells the errors from the path given and where most, of the systems, and the height above ground."""
    legs, check, worst = metrics["trackability"], metrics["check"], metrics["check"]["worst"]
    tolerance = metres(legs[0]["threshold_m"]) if legs else "none"
    other = legs and any(corner["allowed_cut_m"] != legs[0]["threshold_m"] for corner in check["corners"])
    off = spread(metrics["deviation_from_given_m"], ("p95", "max"))
    allowed = f"{_metres(worst['off_m'])} off at {_place_text(worst)}; allowed {_metres(worst['allowed_m'])}"
    rows = {
        "off the path given": f"{off} m, allowed {tolerance}{', at corners as below' if other else ''}",
        "  worst place": allowed,
        **error_rows(metrics),
    }
    if height := metrics.get("height_above_ground_m"):
        text = f"least {_metres(height['min'])} at {_place_text(height)}; mean {_metres(height['mean'])}"
        rows["above ground"] = text + _known(metrics)
    return rows


def _known(metrics: Mapping[str, Any]) -> str:
    """Says on how much of the track nobody knows whether it touched the ground."""
    unknown = 1.0 - metrics.get("ground_known_fraction", 1.0)
    return f"; no terrain under {max(unknown, 1e-3):.1%} of the track" if unknown else ""


def _place_text(place: Mapping[str, float]) -> str:
    return f"{place['time_s']:.0f} s, ({place['east_m']:z.0f}, {place['north_m']:z.0f}) m"


def _contacts(metrics: Mapping[str, Any]) -> dict[str, str]:
    """Lists contacts, breaches and the least clearance, where there are any."""
    least_m, rows = metrics["min_clearance_m"], {}
    if least_m is not None:
        rows["least clearance"] = f"{least_m:,.4g} m"
    for one, many in (("contact", "contacts"), ("breach", "breaches")):
        rows |= _count_row(many, metrics[many])
        for number, each in enumerate(metrics[many][:MOST_SHOWN], start=1):
            time = f"{each['start_s']:.0f} to {each['end_s']:.0f} s"
            place = f"({each['east_m']:z.0f}, {each['north_m']:z.0f}) m"
            text = f"{each['name']}, {time}, by {metres(each['depth_m'])} at {place}"
            rows[f"  {one} {number}"] = plain(text)
    return rows


def _items(items: Sequence[Mapping[str, str]]) -> dict[str, str]:
    """Counts the items of a mission by their treatment, and names the noteworthy ones."""
    if not items:
        return {}
    kinds = [item["what"] for item in items]
    tally = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
    told = [item for item in items if item["what"] in TO_LIST]
    listed = [item for item in told if item["why"] or item["what"] == "not flown"]
    rows = {"items": f"{len(items)}: {tally}"}
    for item in listed[:MOST_SHOWN]:
        why = f": {item['why']}" if item["why"] else ""
        rows[f"  item {item['item']} "] = plain(f"{item['name']}, {item['what']}{why}")
    if len(listed) > MOST_SHOWN:
        rows["  more"] = f"{len(listed) - MOST_SHOWN}, in metrics.json"
    return rows


def _corner(corner: Mapping[str, Any]) -> str:
    side = "left" if corner["turn_deg"] > 0 else "right"
    allowed, cut_m = f"{metres(corner['allowed_cut_m'])} allowed", corner["flown_cut_m"]
    if cut_m is None:
        text = "not reached"
    elif not corner["radius_m"]:
        text = f"passed at {cut_m:.0f} m"
    else:
        text = f"radius {corner['radius_m']:.0f} m, cut by {cut_m:.0f} m"
        if corner["most_off_m"] > max(1.1 * cut_m, corner["allowed_cut_m"]):
            text += f", {corner['most_off_m']:.0f} m off after it"
    return f"{abs(corner['turn_deg']):.0f} deg {side}, {text}; {allowed}"


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{legible(value)} m"
