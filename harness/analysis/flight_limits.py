"""What a flight is measured against."""

from __future__ import annotations

import math
from dataclasses import dataclass

SPEED_S = 20.0
"""Airspeed is averaged over this, so that it is what the engine can hold and not what a gust adds."""

LOAD_S = 1.0
"""Load factor is averaged over this, so that it is that of the manoeuvre and not that of a gust."""


@dataclass(frozen=True)
class FlightLimits:
    """What a flight is measured against.

    Attributes:
        altitude_m: to be held, above mean sea level.
        clearance_m: wanted distance from every obstacle edge.
        turn_radius_m: smallest radius a plan may have, in the flight's wind and turbulence.
        airspeed_mps: true airspeed to be held; NaN where it is not judged.
        horizon_m: how far obstacles have to be seen, so that a turn along a wall straight ahead keeps the clearance.
        no_wind: the air has no mean wind and no gust; then what the track seems to show of one is turbulence.
        compute_latency_s: a plan takes effect this much later than the scan that it was made from.
        navigation_margin_m: what the planner keeps from obstacles beyond the clearance, for the navigation error; the
            cross-track error may be larger by so much.
    """

    altitude_m: float
    clearance_m: float
    bank_limit_rad: float
    turn_radius_m: float
    airspeed_mps: float = math.nan
    roll_rate_radps: float = math.inf
    stall_angle_deg: float = math.inf
    sensor_range_m: float = math.inf
    horizon_m: float = 0.0
    no_wind: bool = False
    scan_period_s: float = math.inf
    compute_latency_s: float = 0.0
    max_cross_track_m: float = 10.0
    max_altitude_error_m: float = math.inf
    max_airspeed_error_mps: float = math.inf
    max_load_factor: float = math.inf
    navigation_margin_m: float = 0.0

    @property
    def cross_track_threshold_m(self) -> float:
        """What the cross-track error may be."""
        return self.max_cross_track_m + self.navigation_margin_m
