"""Typed properties of a recording: what rerun's table of runs sorts and filters by."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from harness.analysis.causes import is_allowed_for

if TYPE_CHECKING:
    from pathlib import Path

    import rerun as rr

    from harness.scenario.scenario import Scenario

RUN: Final = "run"
"""Name of the properties with the figures of a run; a column of rerun's table is `property:run:<figure>`."""
VARIED: Final = "varied"
"""Name of the properties with the keys that a campaign varied."""

NO_RECORDINGS: Final = (
    "{} has no recordings: `recordings: thin` in the campaign's file keeps a small one of every run, `all` a whole "
    "one, `failures` a whole one of those that failed"
)
"""Said of a campaign of which there is no table."""
SEVERITY: Final = {
    "collision": 7.0,
    "lost_control": 6.0,
    "out_of_bounds": 5.0,
    "planner_failed": 4.0,
    "timeout": 3.0,
    "unreachable": 2.0,
}
"""How bad an outcome is; a run that reached the goal has 1 where it was not trackable or came nearer to an obstacle
than was wanted, and else 0."""
FAIR: Final = {"reached, but not tracked or too near": 1.0, "reached": 0.0}

Value = str | float | int | bool


def run_properties(scenario: Scenario, metrics: Mapping[str, Any]) -> dict[str, Value]:
    """The figures of a run, each under a name with its unit.

    Args:
        scenario: as flown.
        metrics: content of `metrics.json`.

    Returns:
        `severity` grows with how badly the run went: the outcome before the point, and for equal outcomes more the
        less clearance there was; navigation errors that were planned for are no fault. A figure that a run does not
        have (clearance in an empty world) is left out.
    """
    clearance_m = metrics.get("min_clearance_m")
    ratio = None if clearance_m is None else clearance_m / (scenario.planner.clearance_m or math.inf)
    causes = sorted({leg["cause"] for leg in metrics["trackability"] if leg["cause"]})
    off_m = metrics.get("navigation_error_m", {}).get("max")
    allowed = is_allowed_for(causes, off_m, metrics.get("navigation_margin_m"))
    lost = metrics["lost_returns"]["max"]
    wind, turbulence = scenario.environment.wind, scenario.environment.turbulence
    found: dict[str, Value | None] = {
        "outcome": metrics["outcome"],
        "severity": severity(metrics["outcome"], metrics["trackable"] or allowed, ratio),
        "trackable": bool(metrics["trackable"]),
        "causes": ", ".join(causes) or None,
        "min_clearance_m": clearance_m,
        "clearance_ratio": ratio,
        "clearance_violation_s": metrics["clearance_violation_s"],
        "cross_track_p95_m": metrics["cross_track_m"]["p95"],
        "cross_track_max_m": metrics["cross_track_m"]["max"],
        "altitude_error_p95_m": metrics["altitude_error_m"]["p95"],
        "navigation_error_max_m": off_m,
        "navigation_jump_m": metrics.get("navigation_jump_m"),
        "plan_delay_max_s": metrics["plan_delay_s"]["max"],
        "lost_returns_max_percent": None if lost is None else 100.0 * lost,
        "bank_saturation_percent": 100.0 * metrics["bank_saturation_fraction"],
        "flown_length_m": metrics["flown_length_m"],
        "flight_time_s": metrics["flight_time_s"],
        "replans": int(metrics["replans"]),
        "planner_p99_ms": metrics["compute_ms"]["p99"],
        "planner_max_ms": metrics["compute_ms"]["max"],
        "scenario": scenario.name,
        "planner": scenario.planner.kind,
        "aircraft": scenario.aircraft.model,
        "seed": str(scenario.seed),  # may be larger than 64 bits
        "wind_mps": wind.speed_mps if wind else 0.0,
        "turbulence": turbulence.intensity if turbulence else "none",
        "reason": metrics["reason"],
    }
    return {name: _rounded(value) for name, value in found.items() if value is not None}


def _rounded(value: Value) -> Value:
    """A figure as a table shows it: six significant digits."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


def severity_told() -> str:
    """What the figure `severity` says, for people who see it in a table."""
    outcomes = ", ".join(f"{value:.0f} {name.replace('_', ' ')}" for name, value in (SEVERITY | FAIR).items())
    return f"severity: the outcome before the point ({outcomes}), behind it more the less clearance there was"


def severity(outcome: str, trackable: bool, clearance_ratio: float | None) -> float:
    """How badly a run went: its outcome before the point, and behind it more the less clearance there was.

    Args:
        outcome: a value of `harness.flight.record.Outcome`.
        trackable: whether all legs were tracked, navigation errors that are planned for aside.
        clearance_ratio: least clearance over the wanted one; None where there was nothing to keep clear of.
    """
    fair = trackable and (clearance_ratio is None or clearance_ratio >= 1.0)
    whole = SEVERITY.get(outcome, 0.0 if fair else 1.0)
    near = 0.0 if clearance_ratio is None else 1.0 / (1.0 + math.exp(min(clearance_ratio, 50.0)))
    return round(whole + near, 6)


def send_properties(rec: rr.RecordingStream, name: str, values: Mapping[str, Value]) -> None:
    """Sends properties, each as a component of its own type."""
    import rerun as rr

    if values:
        components: dict[str, Any] = {each: _rounded(value) for each, value in values.items()}
        rec.send_property(name, rr.AnyValues(**components))


def properties_of(recording: Path) -> Mapping[str, Any]:
    """The typed figures of one recording; empty where it was not closed."""
    import rerun as rr

    for chunk in rr.chunk.RrdReader(str(recording)).stream():
        if str(chunk.entity_path) == f"/__properties/{RUN}":
            row = chunk.to_record_batch().to_pylist()[0]
            return {name: value[0] for name, value in row.items() if isinstance(value, list)}
    return {}
