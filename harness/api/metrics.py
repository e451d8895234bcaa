"""The type of `run.metrics`: the content of `metrics.json` with names and types.

A figure that does not exist is None. A key of a newer version, which has no field here, is an attribute with the value
that JSON has.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, PrivateAttr


class Figures(BaseModel):
    """A mapping of `metrics.json`: frozen, with every key in it."""

    model_config = ConfigDict(frozen=True, extra="allow", protected_namespaces=())

    def __repr__(self) -> str:
        """Its numbers, shortened."""
        return f"{type(self).__name__}({', '.join(_short(*each) for each in self)})"

    __str__ = __repr__


class Spread(Figures):
    """A figure over all rows of the track.

    Attributes:
        rms: root mean square.
        p95: 95th percentile of the absolute value.
        max: largest absolute value.
    """

    rms: float | None = None
    p95: float | None = None
    max: float | None = None


class Percentiles(Figures):
    """Times of the planner's calls in which it searched, ms.

    Attributes:
        p50: median.
        p99: 99th percentile.
        max: the longest.
    """

    p50: float | None = None
    p99: float | None = None
    max: float | None = None


class Delays(Figures):
    """Time from the latest scan that a plan could use until the plan took effect, s.

    Attributes:
        p50: median.
        p99: 99th percentile.
        max: the latest.
    """

    p50: float | None = None
    p99: float | None = None
    max: float | None = None


class LostReturns(Figures):
    """Share of the beams that met something and returned nothing, 0 to 1.

    Attributes:
        share: in all scans.
        max: in the worst scan.
    """

    share: float | None = None
    max: float | None = None


class ShieldFigures(Figures):
    """What a shield did.

    Attributes:
        interventions: how often the aircraft came from the planner's path onto the backup.
        time_on_backup_s: time on the backup.
        refused_plans: paths of the planner of which no part that gets on could be certified.
    """

    interventions: int
    time_on_backup_s: float
    refused_plans: int


class PathFigures(Figures):
    """How smooth a path is; `harness.analysis.smoothness` defines each figure.

    Attributes:
        heading_change_deg: total absolute change of direction.
        bending_energy_1pm: integral of the squared curvature over the length, 1/m.
        max_curvature_1pm: largest absolute curvature, 1/m.
        max_curvature_rate_1pm2: largest change of curvature per length, 1/m^2.
        angle_over_length_radpm: total absolute change of direction over the length.
        bending_energy_normalised: bending energy times the length.
        max_curvature_normalised: largest absolute curvature times the length.
        max_curvature_rate_normalised: largest rate of curvature times the length squared.
    """

    heading_change_deg: float | None = None
    bending_energy_1pm: float | None = None
    max_curvature_1pm: float | None = None
    max_curvature_rate_1pm2: float | None = None
    angle_over_length_radpm: float | None = None
    bending_energy_normalised: float | None = None
    max_curvature_normalised: float | None = None
    max_curvature_rate_normalised: float | None = None


class PlannedAndFlown(Figures):
    """The same figures of the path as planned and as flown.

    Attributes:
        planned: of the parts of the plans that were in effect.
        flown: of the flown track.
    """

    planned: PathFigures
    flown: PathFigures


class LegVerdict(Figures):
    """Whether one leg was tracked; `harness.analysis.trackability.Leg` has the definitions.

    Attributes:
        start_s: simulated time of its first row.
        end_s: simulated time of its last row.
        max_cross_track_m: largest absolute cross-track error.
        threshold_m: limit of the cross-track error.
        max_altitude_error_m: largest absolute altitude error.
        max_airspeed_error_mps: largest absolute error of the airspeed, averaged; None where it is not judged.
        max_load_factor: largest load factor, averaged.
        corner_cut_m: how far from the corner at its end the plan passes; 0 without one.
        waypoint: number of the point of a given path that the leg leads to; None if it leads to none.
        max_deviation_m: largest distance from the path as given; None where a planner made the path.
        trackable: whether the leg stayed within all limits.
        cause: why not; None where trackable.
    """

    start_s: float
    end_s: float
    max_cross_track_m: float | None = None
    threshold_m: float | None = None
    max_altitude_error_m: float | None = None
    max_airspeed_error_mps: float | None = None
    max_load_factor: float | None = None
    corner_cut_m: float | None = None
    waypoint: int | None = None
    max_deviation_m: float | None = None
    trackable: bool
    cause: str | None = None


class Timing(Figures):
    """Simulated and wall-clock time of a flight.

    Attributes:
        sim_s: simulated time.
        wall_s: wall-clock time.
        realtime_factor: simulated over wall-clock time.
        planner_wall_ms: wall-clock times of the planner's searches.
    """

    sim_s: float
    wall_s: float
    realtime_factor: float | None = None
    planner_wall_ms: Percentiles = Percentiles()


class CheckVerdict(Figures):
    """Whether a path can be flown as given.

    Attributes:
        ok: tracked, nothing touched, no fence or bound crossed.
        verdict: the answer as a sentence.
        drawn: true for a line, which is to be flown as drawn; false for a mission, whose corners may be cut.
        points: number of points given.
        worst: where the track is furthest off the path in relation to what is allowed there: time, place, distance.
        limit_used: largest share of what is allowed that was used, `off_path` and `altitude`; above 1 it is a no.
        corner_m_that_would_do: the `--corner-m` that would have been kept; None where none would, or no other.
        given: how smooth the path as given is.
        corners: corners that had to be cut, as in `metrics.json`.
    """

    ok: bool
    verdict: str
    drawn: bool = True
    points: int
    worst: dict[str, Any] = {}
    limit_used: dict[str, float | None] = {}
    corner_m_that_would_do: float | None = None
    given: PathFigures
    corners: tuple[dict[str, Any], ...] = ()


class Metrics(Figures):
    """All figures of one run, as in its `metrics.json`; `harness.analysis.metrics` defines each.

    Attributes:
        outcome: how the flight ended: `reached`, `collision`, `timeout`, ...
        reason: the same as a sentence.
        flown_length_m: length of the flown track.
        planned_length_m: length of those parts of the plans that were in effect.
        flight_time_s: simulated time from start to end.
        min_clearance_m: least true distance to an obstacle edge; None without obstacles.
        min_altitude_above_ground_m: least height above the true ground; None where that is not known.
        clearance_violation_s: time below the wanted clearance.
        cross_track_m: distance from the plan being flown.
        total_system_error_m: distance of the true position from the path: the plan, or the path as given.
        flight_technical_error_m: distance of the believed position from it.
        navigation_error_m: distance from the true position to the believed one; None where navigation is perfect.
        navigation_jump_m: largest change of this error from one row of the track to the next; likewise.
        navigation_margin_m: distance that the planner kept beyond the clearance because of this error; likewise.
        altitude_error_m: distance from the mission's altitude.
        smoothness: of the path as planned and as flown.
        bank_saturation_fraction: share of the rows in which the bank was at its limit.
        max_load_factor: largest load factor.
        trackable: whether every leg was tracked.
        trackability: verdict and cause, leg by leg.
        findings: what the outcome does not say, each with kind, time and text.
        bank_reversals_per_min: how often a minute the bank command goes from one side to the other.
        plan_contradictions: plans that lead to the other side of the course than the one before.
        replans: plans accepted after the first.
        shield: what the planner's shield did; None without one.
        plan_delay_s: from the latest scan that a plan could use until the plan took effect.
        lost_returns: share of the returns that the sensor lost.
        compute_ms: processor times of the planner's searches.
        timing: simulated and wall-clock time.
        digest: SHA-256 of the track.
        error: traceback of the planner's exception; None if there was none.
        deviation_from_given_m: of a checked path: distance of the track from the path as given.
        contact: of a checked path: whether an obstacle was touched.
        contacts: of a checked path: each contact, as in `metrics.json`.
        breaches: of a checked path: fences and bounds that were crossed, as in `metrics.json`.
        check: of a checked path: the verdict; None for other runs.
    """

    outcome: str
    reason: str
    flown_length_m: float
    planned_length_m: float
    flight_time_s: float
    min_clearance_m: float | None = None
    min_altitude_above_ground_m: float | None = None
    clearance_violation_s: float
    cross_track_m: Spread
    total_system_error_m: Spread = Spread()
    flight_technical_error_m: Spread = Spread()
    altitude_error_m: Spread
    navigation_error_m: Spread | None = None
    navigation_jump_m: float | None = None
    navigation_margin_m: float | None = None
    smoothness: PlannedAndFlown
    bank_saturation_fraction: float
    max_load_factor: float | None = None
    trackable: bool
    trackability: tuple[LegVerdict, ...]
    findings: tuple[dict[str, Any], ...] = ()
    bank_reversals_per_min: float | None = None
    plan_contradictions: int | None = None
    replans: int
    shield: ShieldFigures | None = None
    plan_delay_s: Delays = Delays()
    lost_returns: LostReturns = LostReturns()
    compute_ms: Percentiles
    timing: Timing
    digest: str
    error: str | None = None
    deviation_from_given_m: Spread | None = None
    contact: bool | None = None
    contacts: tuple[dict[str, Any], ...] = ()
    breaches: tuple[dict[str, Any], ...] = ()
    check: CheckVerdict | None = None

    _content: dict[str, Any] = PrivateAttr(default_factory=dict)

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> Metrics:
        """The metrics in the content of a `metrics.json`."""
        plain = json.loads(json.dumps(content))
        metrics = cls.model_validate(plain)
        metrics._content = plain
        return metrics

    def to_dict(self) -> dict[str, Any]:
        """The content of `metrics.json`, key by key; yours to change."""
        return copy.deepcopy(self._content)

    def __repr__(self) -> str:
        """Outcome and the figures that most ask for."""
        return (
            f"Metrics({self.outcome}, flown_length_m={self.flown_length_m:.0f}, trackable={self.trackable}, "
            f"cross_track_m={self.cross_track_m}, ...)"
        )

    __str__ = __repr__


def _short(name: str, value: object) -> str:
    return f"{name}={value:.4g}" if isinstance(value, float) else f"{name}={value!r}"
