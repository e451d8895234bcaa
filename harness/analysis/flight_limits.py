"""What a flight is measured against: its limits, and a path that was given."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from harness.flight.record import FloatArray
from harness.run_files.given_path import CutCorner

SPEED_AVERAGED_S = 20.0  # the airspeed error is averaged over this time, so that a gust does not count
LOAD_AVERAGED_S = 1.0  # the load factor is averaged over this time, so that a gust does not count


@dataclass(frozen=True)
class FlightLimits:
    """The limits and reference values that a flight is measured against."""

    altitude_m: float  # altitude to be held, above mean sea level
    clearance_m: float  # wanted distance from every obstacle edge
    bank_limit_rad: float
    turn_radius_m: float  # smallest radius a plan may have, in the flight's wind and turbulence
    airspeed_mps: float = math.nan  # true airspeed to be held; NaN where it is not judged
    roll_rate_radps: float = math.inf
    stall_angle_deg: float = math.inf
    sensor_range_m: float = math.inf
    horizon_m: float = 0.0
    """How far obstacles have to be seen, so that a turn along a wall straight ahead keeps the clearance."""
    no_wind: bool = False
    """True if the air has neither mean wind nor gusts: a wind that is estimated from the track is then turbulence."""
    scan_period_s: float = math.inf
    compute_latency_s: float = 0.0  # a plan takes effect this much later than the scan that it was made from
    max_cross_track_m: float = 10.0
    max_altitude_error_m: float = math.inf
    max_airspeed_error_mps: float = math.inf
    max_load_factor: float = math.inf
    airspeed_sigma_mps: float = 0.0  # 1 sigma of the error with which the aircraft knows its airspeed
    navigation_margin_m: float = 0.0
    """What plans keep beyond the clearance for navigation errors under any law; the cross-track limit grows by it."""

    @property
    def cross_track_threshold_m(self) -> float:
        """Largest cross-track error of a trackable leg."""
        return self.max_cross_track_m + self.navigation_margin_m


@dataclass(frozen=True, eq=False)
class AsGiven:
    """A path that was given and how it was flown, row by row of the track, (n,) each.

    Each of `corners`, in order, ends a leg; one that is no corner has no `cut_m` and no `half_m`. `deviation_m` is the
    distance between the track and the path, `allowed_m` the largest that is allowed there; `altitude_m` and
    `climb_mps`, negative for a descent, are the path's at `airspeed_mps`, the true airspeed commanded there.
    `fastest_mps` (n, 2) are the fastest climb and descent of the aircraft at its airspeed there. `unheld_mps` says how
    far the commanded airspeed lies outside the range of level flight, `believed_off_m` how far the believed position is
    from the path; None where navigation is perfect.
    """

    corners: Sequence[CutCorner]
    deviation_m: FloatArray
    allowed_m: FloatArray
    altitude_m: FloatArray
    climb_mps: FloatArray
    fastest_mps: FloatArray
    airspeed_mps: FloatArray
    unheld_mps: FloatArray | float = 0.0
    believed_off_m: FloatArray | None = None
