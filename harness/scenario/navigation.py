"""What an aircraft may be wrong about: the navigation section of a scenario, its presets, the margin for it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal

from pydantic import Field, Strict, model_validator

from harness.scenario.sections import DERIVED, Interval, Section, Share
from harness.scenario.validation import KeyFault

MAX_ERROR_M: Final = 10_000.0  # largest sigma of position or altitude, and largest bias of a position
Error = Annotated[float, Field(ge=0, le=MAX_ERROR_M)]
Offset = Annotated[float, Field(ge=-MAX_ERROR_M, le=MAX_ERROR_M)]

MARGIN_SIGMAS: Final = 3.0  # of the position error in the planner's margin: 1 - exp(-9 / 2) of all errors

_ERROR_KEYS: Final = (  # keys that are zero where navigation is perfect
    "position_sigma_m", "velocity_sigma_mps", "heading_sigma_deg", "airspeed_sigma_mps", "altitude_sigma_m",
    "drift_share", "latency_s",
)  # fmt: skip
_PERFECT: Final[dict[str, Any]] = dict.fromkeys(_ERROR_KEYS, 0.0) | {
    "position_correlation_s": 1100.0,  # [BM], 1 / k_GPS of the Gauss-Markov table
    "position_bias_m": (0.0, 0.0),
    "outages_s": (),
}
_GNSS: Final[dict[str, Any]] = _PERFECT | {
    "position_sigma_m": 4.7,  # [BM], nominal errors: 11.5 m at 95 %; [SPS] has 8 m on average, at worst 15 m
    "velocity_sigma_mps": 0.05,  # [BM], and the median in data sheets of u-blox receivers
    "heading_sigma_deg": 1.0,  # [BM], bias of the digital compass
    "airspeed_sigma_mps": 0.65,  # [BM], drift of 0.020 kPa over 1.225 kg/m3 times 25 m/s
    "altitude_sigma_m": 9.2,  # [BM], nominal errors
    "drift_share": 0.03,  # airspeed and heading as above: sqrt((0.65 / 25)^2 + 0.017^2)
}
PRESETS: Final[Mapping[str, Mapping[str, Any]]] = {
    "perfect": _PERFECT,
    "gnss": _GNSS,
    "rtk": _GNSS
    | {
        "position_sigma_m": 0.017,  # [F9P], circular error 0.01 m + 1 ppm of 10 km, which is 1.1774 sigma
        "position_correlation_s": 100.0,  # chosen: multipath of some minutes
        "altitude_sigma_m": 0.03,  # [F9P], median 0.01 m + 1 ppm, which is 0.6745 sigma
    },
    "dead_reckoning": _GNSS
    | {
        "position_sigma_m": 0.0,
        "velocity_sigma_mps": 0.1,  # chosen: twice that of GPS
        "altitude_sigma_m": 10.4,  # [BM], barometer: drift of 0.125 kPa over 1.225 kg/m3 times 9.80665 m/s2
        "drift_share": 0.01,  # [ORB], stereo odometry on KITTI: 1.15 %
        "outages_s": ((0.0, 1e7),),
    },
}
"""What each kind fills in; all sigmas are of one axis. `dead_reckoning` knows its start and never has a fix after it.

Sources: [BM] Beard and McLain, Small Unmanned Aircraft (2012), chapter 7; [SPS] GPS Standard Positioning Service
Performance Standard, 5th edition (2020); [F9P] data sheet of the u-blox ZED-F9P; [ORB] ORB-SLAM2, Mur-Artal and Tardos
(2017)."""


class Navigation(Section):
    """What the aircraft believes of its state, beside what it is."""

    kind: Literal["perfect", "gnss", "rtk", "dead_reckoning"] = "perfect"
    """Where the other keys have their defaults from; perfect has no error at all."""
    position_sigma_m: Error = DERIVED
    """1 sigma of the position error, east and north each (Gauss-Markov, of first order). Default: that of the kind."""
    position_correlation_s: Annotated[float, Field(ge=1e-3, le=1e7)] = DERIVED
    """Correlation time of the position error and of the altitude error. Default: that of the kind."""
    position_bias_m: Annotated[tuple[Offset, Offset], Strict(False)] = DERIVED
    """Constant position error on top: east, north. Default: that of the kind."""
    velocity_sigma_mps: Annotated[float, Field(ge=0, le=100)] = DERIVED
    """1 sigma of the error of each component of the velocity. Default: that of the kind."""
    heading_sigma_deg: Annotated[float, Field(ge=0, le=90)] = DERIVED
    """1 sigma of the heading error. Default: that of the kind."""
    airspeed_sigma_mps: Annotated[float, Field(ge=0, le=100)] = DERIVED
    """1 sigma of the error of the true airspeed. Default: that of the kind."""
    altitude_sigma_m: Error = DERIVED
    """1 sigma of the altitude error. Default: that of the kind."""
    drift_share: Share = DERIVED
    """Without a fix the position drifts by this share of the distance flown. Default: that of the kind."""
    outages_s: Annotated[tuple[Interval, ...], Strict(False), Field(max_length=1000)] = DERIVED
    """Times without a fix, from and to; at the end the position comes back with a jump. Default: that of the kind."""
    latency_s: Annotated[float, Field(ge=0, le=5)] = DERIVED
    """Age of the state that guidance and autopilot work with. Default: that of the conditions, 0 for ideal."""
    margin_m: Error = DERIVED
    """What the planner keeps from obstacles beyond planner.clearance_m. Default: 3 sigma, the bias, what is flown in
    latency_s, the drift of the longest outage, or of half a turn where that is less, and what 3 sigma of the heading
    misplace an edge by that is one clearance away, or as far as it takes to turn aside."""

    @model_validator(mode="after")
    def _fill_in(self) -> Navigation:
        """Fills in what the kind has, and holds the outages against each other."""
        for name, value in PRESETS[self.kind].items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)
        last_s = -math.inf
        for index, (begin_s, end_s) in enumerate(self.outages_s):
            if begin_s <= last_s:
                wanted = f"must begin after {last_s:g} s, the end of the one before"
                raise KeyFault(("outages_s", index), f"is [{begin_s:g}, {end_s:g}]; {wanted}")
            last_s = end_s
        return self

    def refuse_errors(self) -> None:
        """Raises a KeyFault if a key gives an error, which `perfect` has not."""
        for name, value in _PERFECT.items():
            if name != "position_correlation_s" and (given := getattr(self, name)) != value:
                text = f"is {given:g}" if isinstance(given, float) else "is given"
                right = "must be left out, or kind be gnss"
                raise KeyFault(("navigation", name), f"{text}, but kind perfect has no error; {right}")


def planning_margin_m(
    navigation: Navigation, speed_mps: float, time_limit_s: float, clearance_m: float, turn_radius_m: float
) -> float:
    """Returns the margin (m) that the clearance needs on top, so that the true aircraft keeps it, not the believed one.

    `MARGIN_SIGMAS` of the position error, its bias, what is flown at `speed_mps`, wind included, while the state grows
    old, and the drift of the longest outage, up to `time_limit_s`. The map drifts as the aircraft does: what stands in
    it is off only by what was drifted since it was last seen, half a turn ago at most.

    A heading error turns the scan: an edge at distance d is misplaced by d times the error, square to where it is seen.
    The map places an edge anew whenever it is seen from 0.7 of the distance (`harness.mapping.obstacle_map`), the last
    time within c / 0.7 of an edge that is passed at the clearance c, sqrt(1 / 0.7^2 - 1) c = c before it is passed. An
    aircraft of turn radius R that turns aside by the error e, left and right, flies 4 R e: the longer way counts.
    """
    lasting_s = [min(end, time_limit_s) - min(begin, time_limit_s) for begin, end in navigation.outages_s]
    unseen_m = min(speed_mps * max(lasting_s, default=0.0), math.pi * turn_radius_m)
    turned_rad = MARGIN_SIGMAS * math.radians(navigation.heading_sigma_deg)
    turned_m = turned_rad * max(clearance_m, 4.0 * turn_radius_m * turned_rad)
    known_m = MARGIN_SIGMAS * navigation.position_sigma_m + math.hypot(*navigation.position_bias_m)
    return known_m + navigation.latency_s * speed_mps + navigation.drift_share * unseen_m + turned_m
