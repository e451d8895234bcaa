"""All figures of a flight, each named once: where it stands in `metrics.json`, its unit, label, format and meaning.

Columns of campaigns and comparisons, tables for people, properties of recordings, rankings and `wayproof list metrics`
are made of this list. To add a figure that follows from a flight alone, append a `Metric` with `of`: it then stands in
`metrics.json` and in all of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, Final

from harness.analysis.findings import bank_reversals_per_min, contradictions_s
from harness.analysis.metric import Metric
from harness.analysis.smoothness import Smoothness


def _causes(metrics: Mapping[str, Any]) -> list[str]:
    return [leg["cause"] for leg in metrics["trackability"] if leg["cause"]]


def _spread(name: str, title: str, short: str = "", hint: str = "", rare: bool = False) -> list[Metric]:
    """rms, 95th percentile and maximum of an error in metres; the two last are properties of recordings."""
    stem = name.removesuffix("_m")
    figures = [
        Metric(
            f"{stem}_{of}_m", f"{title} {of}", "m", short and f"{short} {of}", f"{name}.{of}", worse="more", rare=rare,
            recorded=True, heading=f"{title} max, m" if short and not rare and of == "max" else "", hint=each,
        )
        for of, each in (("p95", hint), ("max", ""))
    ]  # fmt: skip
    return [Metric(f"{stem}_rms_m", path=f"{name}.rms"), *figures]


def _smooth(figure: str, title: str, unit: str, short: tuple[str, str], hint: str, factor: float = 1.0) -> list[Metric]:
    """A smoothness figure twice, of the planned (with the hint) and of the flown path, with the heading of each."""
    planned, flown = (
        Metric(f"{of}_{figure}", f"{title} {of}", unit, each, f"smoothness.{of}.{figure}", factor=factor, worse="more")
        for of, each in zip(("planned", "flown"), short, strict=True)
    )  # fmt: skip
    return [replace(planned, hint=hint), flown]


_SMOOTHNESS_SHOWN: Final = ("heading_change_deg", "bending_energy_1pm")  # they have entries of their own
# fmt: off
METRICS: Final[tuple[Metric, ...]] = (
    Metric("outcome", "outcome", short="outcome", kind="text", recorded=True, heading="outcome",
           hint="how the flight ended; error: the software failed before the end, which says nothing of the aircraft"),
    Metric("reason", kind="text", recorded=True),
    Metric("flown_length_m", "flown length", "km", "km", factor=0.001, recorded=True, heading="flown, m"),
    Metric("planned_length_m"),
    Metric("flight_time_s", "flight time", "s", recorded=True, heading="flight, s"),
    Metric("optimum_m", derived=True),
    Metric("ratio", "ratio to the clairvoyant optimum", short="ratio", digits=4, derived=True, worse="more",
           hint="flown length over the shortest path to the goal circle for a point that knows the world and keeps "
           "clear"),
    Metric("min_clearance_m", "least clearance", "m", "clear m", worse="less", recorded=True,
           heading="min clearance, m", hint="of the track's rows, ten a second; what is fast may come nearer between"),
    Metric("clearance_violation_s", "below the wanted clearance", "s", "below s", worse="more", recorded=True),
    Metric("turn_radius_m", derived=True),
    Metric("tightest_turn", "tightest planned turn, curvature · turn radius", short="κ·R", digits=2, derived=True,
           worse="more",
           hint="largest planned curvature times the turn radius in this air; above 1 with less bank in reserve"),
    Metric("tightest_flown_turn", "tightest flown turn, curvature · turn radius", short="κ·R fl.", digits=2,
           derived=True, worse="more",
           hint="largest curvature of the track times the radius that turns are planned with"),
    Metric("trackable", "trackable", short="tracks", kind="bool", worse="less", recorded=True, heading="trackable",
           hint="every leg was flown within the limits for cross-track error, altitude, airspeed and load"),
    Metric("cause", "cause of the first leg not tracked", short="cause", kind="text",
           get=lambda metrics: next(iter(_causes(metrics)), "")),
    Metric("causes", path="trackability.causes", kind="text", recorded=True, heading="causes",
           get=lambda metrics: "; ".join(sorted(set(_causes(metrics))))),
    Metric("legs", path="trackability.legs", kind="int", get=lambda metrics: len(metrics["trackability"])),
    Metric("legs_not_trackable", path="trackability.not_trackable", kind="int", worse="more",
           get=lambda metrics: sum(not leg["trackable"] for leg in metrics["trackability"])),
    Metric("bank_saturation_fraction", "time at the bank limit", "%", "bank %", factor=100.0, worse="more",
           recorded=True, heading="bank at limit, %"),
    Metric("max_load_factor", "load factor max", worse="more"),
    *_spread("total_system_error_m", "total system error", "tse",
             "distance of the true position from the path, as planned or as given"),
    *_spread("cross_track_m", "cross-track error"),
    *_spread("altitude_error_m", "altitude error"),
    *_spread("flight_technical_error_m", "flight technical error",
             hint="distance of the believed position from the path"),
    *_spread("navigation_error_m", "navigation error", "nav",
             "distance from the true position to the one that the aircraft believed to have", rare=True),
    Metric("navigation_jump_m", "jump of the believed position max", "m", "nav jump", worse="more", rare=True,
           recorded=True, heading="navigation jump, m",
           hint="the most that the navigation error changes in a tenth of a second, as when a fix comes back"),
    Metric("navigation_margin_m"),
    Metric("min_altitude_above_ground_m", worse="less"),
    Metric("ground_known_fraction"),
    *_smooth("heading_change_deg", "heading change", "°", ("turn °", "flown °"),
             "sum of all changes of direction of the plans in effect"),
    *_smooth("bending_energy_1pm", "bending energy", "1/km", ("bend", "bend fl."),
             "integral of the squared curvature along the plans in effect", 1e3),
    *(Metric(f"{of}_{each.name}", path=f"smoothness.{of}.{each.name}", worse="more") for of in ("planned", "flown")
           for each in fields(Smoothness) if each.name not in _SMOOTHNESS_SHOWN),
    *(Metric(f"planner_{of}_ms", f"planner time {of}", "ms", f"{of} ms", f"compute_ms.{of}", worse="more", timed=True,
           recorded=True, heading="planner max, ms" if of == "max" else "") for of in ("p50", "p99", "max")),
    Metric("wall_s", path="timing.wall_s", timed=True),
    Metric("realtime_factor", path="timing.realtime_factor", timed=True),
    *(Metric(f"plan_delay_{of}_s", path=f"plan_delay_s.{of}") for of in ("p50", "p99")),
    Metric("plan_delay_max_s", "plan delay max", "s", "delay s", "plan_delay_s.max", worse="more", rare=True,
           recorded=True, heading="plan delay max, s",
           hint="simulated time from the latest scan that a plan could know of until it was flown"),
    Metric("bank_reversals_per_min", "bank reversals", "1/min", "rev/min", worse="more", recorded=True,
           of=lambda flight, limits: bank_reversals_per_min(flight.track),
           hint="how often a minute the bank command goes from 10° on one side to as much on the other"),
    Metric("plan_contradictions", "plans that contradict the one before", short="contra", kind="int", worse="more",
           rare=True, recorded=True, of=lambda flight, limits: len(contradictions_s(flight.track, flight.plans)),
           hint="they lead to the other side of the course within 5 s of flight"),
    Metric("replans", "replans", short="replans", kind="int", recorded=True, heading="replans"),
    Metric("shield_interventions", "interventions of the shield", "", "shield", "shield.interventions", "int",
           rare=True),
    Metric("shield_backup_s", "time on the backup", "s", "backup s", "shield.time_on_backup_s", rare=True),
    Metric("shield_refused_plans", "plans that the shield refused", "", "refused", "shield.refused_plans", "int",
           rare=True),
    Metric("deviation_p95_m", path="deviation_from_given_m.p95", worse="more"),
    Metric("deviation_max_m", path="deviation_from_given_m.max", worse="more"),
    Metric("check_ok", path="check.ok", kind="bool", worse="less"),
    Metric("check_verdict", path="check.verdict", kind="text"),
    Metric("error", kind="text"),
    Metric("digest", "digest", short="digest", kind="text"),
)
# fmt: on
"""All figures, in the order in which people are shown them."""
