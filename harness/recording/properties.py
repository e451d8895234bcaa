"""Typed properties of a recording, by which rerun's table of runs sorts and filters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from harness.analysis.causes import is_allowed_for
from harness.analysis.metric import how_bad
from harness.analysis.registry import METRICS
from harness.run_files.given_path import GIVEN

if TYPE_CHECKING:
    import rerun as rr

    from harness.scenario.scenario import Scenario

RUN: Final = "run"
"""Name of the properties with the figures of a run; a column of rerun's table is `property:run:<figure>`."""
VARIED: Final = "varied"  # name of the properties with the keys that a campaign varied

UNTRACKED_SEVERITY: Final = 1.0
"""Severity of a run that reached its goal and was not tracked, or came nearer to an obstacle than was wanted."""

Value = str | float | int | bool


def run_properties(scenario: Scenario, metrics: Mapping[str, Any]) -> dict[str, Value]:
    """Returns the figures of a run, each under a name with its unit; one that it does not have is left out.

    Navigation errors that were planned for are no fault in its `severity`.
    """
    check, clearance_m = metrics.get("check"), metrics.get("min_clearance_m")
    wanted_m = scenario.planner.clearance_m if check is None else check.get("clearance_m")
    ratio = None if clearance_m is None or not wanted_m else clearance_m / wanted_m
    causes = sorted({leg["cause"] for leg in metrics["trackability"] if leg["cause"]})
    off_m = metrics.get("navigation_error_m", {}).get("max")
    allowed = is_allowed_for(causes, off_m, metrics.get("navigation_margin_m"))
    wind, turbulence = scenario.environment.wind, scenario.environment.turbulence
    found: dict[str, Value | None] = {  # of the registry, shares in percent
        metric.recorded_as: metric.factor * value if metric.unit == "%" and value is not None else value
        for metric, value in ((each, each.value(metrics)) for each in METRICS if each.recorded)
    }
    found |= {
        "causes": ", ".join(causes) or None,
        "severity": severity(metrics["outcome"], metrics["trackable"] or allowed, ratio),
        "clearance_ratio": ratio,
        "scenario": scenario.name,
        "planner": scenario.planner.label if check is None else GIVEN,
        "aircraft": scenario.aircraft.model,
        "seed": str(scenario.seed),  # may be larger than 64 bits
        "wind_mps": wind.speed_mps if wind else 0.0,
        "turbulence": turbulence.intensity if turbulence else "none",
    }
    return {name: _round(value) for name, value in found.items() if value is not None}


def _round(value: Value) -> Value:
    """Rounds a number to six significant digits, as a table shows it."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


def severity(outcome: str, trackable: bool, clearance_ratio: float | None) -> float:
    """Rates how badly a run went: its outcome before the point, and behind it more the less clearance there was."""
    fair = trackable and (clearance_ratio is None or clearance_ratio >= 1.0)
    whole = UNTRACKED_SEVERITY if outcome == "reached" and not fair else how_bad(outcome)
    near = 0.0 if clearance_ratio is None else 1.0 / (1.0 + math.exp(min(clearance_ratio, 50.0)))
    return round(whole + near, 6)


def send_properties(rec: rr.RecordingStream, name: str, values: Mapping[str, Value]) -> None:
    """Sends properties, each as a component of its own type; a number that a campaign varied is a double in every run.

    As arrays: of plain values rerun keeps the type that a name had first in the process, and drops those of another.
    """
    import pyarrow as pa
    import rerun as rr

    if values:
        components: dict[str, Any] = {each: _round(value) for each, value in values.items()}
        for each, value in components.items():
            is_varied = name == VARIED and isinstance(value, int) and not isinstance(value, bool)
            components[each] = pa.array([float(value) if is_varied else value])
        rec.send_property(name, rr.AnyValues(**components))
