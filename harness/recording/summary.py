"""The summary page of a recording, in Markdown: the task, the results, the meaning of the colours."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from harness.analysis.metric import MISSED, number
from harness.analysis.registry import METRICS
from harness.analysis.rows import escaped

if TYPE_CHECKING:
    from harness.recording.blueprint import Scene

LEGEND = """\
* **yellow to red**: flown track, from on the plan to {error} m off it, where it is no longer tracked
* **brown line**: track still ahead of the cursor
* **blue**: plan in effect with its waypoints{believed}; **dark blue**: candidates, or the waypoints joined
* **pink**: guide vector
* **green, violet**: free sectors, planning window
* **grey circle**: sensing range
* **red dots**: what the last scan returned
* **white**: sensed so far; **dark grey**: true outline
* **brown**: obstacles that move or come and go
* **red, green outlines**: fences to stay out of, and inside
* **orange**: what the map takes to move, with where it will be in 30 s
* **violet dots**: where the plan expects to meet it

The aircraft is drawn larger than it is; obstacles have no top.
"""
"""Explains the colours as a list, whose lines are wrapped; a narrow view would cut the cells of a table."""


def summary(scene: Scene, metrics: Mapping[str, Any] | None) -> str:
    """Returns the page as Markdown."""
    mission = scene.mission
    # No heading: it would take three lines of a view that has room for five.
    lines = [escaped(scene.name), ""]
    if metrics is None:
        lines += ["Still flying, or stopped before the end.", ""]
    else:
        if "check" in metrics:
            lines += [f"**Flown as given: {escaped(metrics['check']['verdict'])}**", ""]
        lines += [f"**{metrics['outcome'].replace('_', ' ')}**: {escaped(metrics['reason'])}", ""]
        rows = [f"| {name} | {escaped(value)} |" for name, value in figures(scene, metrics).items()]
        lines += [rows[0], "|---|---|", *rows[1:], ""]
    lines += [f"{scene.wind[1].capitalize() or 'No steady wind'}.", ""]
    lines += [
        f"Straight line {math.dist(scene.start_m, mission.goal_m):.0f} m at {mission.speed_mps:g} m/s"
        f"{'' if scene.profile else f' and {scene.altitude_m:g} m above sea level'}; "
        f"smallest turn radius {mission.turn_radius_m:.0f} m; sensing "
        f"range {mission.sensor_range_m:g} m.",
        "",
    ]
    if scene.scenario_yaml:
        lines += ["### Scenario", "", "```yaml", scene.scenario_yaml.rstrip(), "```", ""]
    return "\n".join(lines)


def colours(scene: Scene) -> str:
    """Returns an explanation of the colours of the views, as Markdown."""
    believed = "; thin, the track as the aircraft believed it" if scene.believes else ""
    return LEGEND.format(error=f"{scene.limits.cross_track_threshold_m:.4g}", believed=believed)


def figures(scene: Scene, metrics: Mapping[str, Any]) -> dict[str, str]:
    """Returns the results by name: clearance and verdict, then those in the viewer's table of runs."""
    causes = dict.fromkeys(leg["cause"] for leg in metrics["trackability"] if not leg["trackable"])
    none = MISSED if metrics["trackability"] else "no plan"
    found = {
        "least clearance": _clearance(scene, metrics),
        "trackable": "yes" if metrics["trackable"] else f"no: {', '.join(causes) or none}",
    }
    for metric in (each for each in METRICS if each.heading and each.kind in ("number", "int")):
        value = metric.value(metrics)
        if value is not None and (value or not metric.rare):
            found.setdefault(metric.title, f"{metric.text(value)} {metric.unit}".rstrip())
    return {**found, "digest": metrics["digest"][:16]}


def _clearance(scene: Scene, metrics: Mapping[str, Any]) -> str:
    if not (least := number(metrics["min_clearance_m"])):
        above = number(metrics.get("min_altitude_above_ground_m"))
        return f"{above} m above ground" if above else "no obstacle"
    below_s = metrics["clearance_violation_s"]
    below = f"; {below_s:.1f} s {'below' if scene.limits.clearance_m else 'inside'}" if below_s else ""
    wanted = f" of {scene.limits.clearance_m:g} m" if scene.limits.clearance_m else ""
    return f"{least} m{wanted}{below}"
