"""What an aircraft may be wrong about: the navigation section of a scenario, its presets, the margin for it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal

from pydantic import Field, Strict, model_validator

from harness.scenario.sections import Interval, Section, Share, key
from harness.scenario.validation import KeyFault

MAX_ERROR_M: Final = 10_000.0
Error = Annotated[float, Field(ge=0, le=MAX_ERROR_M)]
Offset = Annotated[float, Field(ge=-MAX_ERROR_M, le=MAX_ERROR_M)]
PRESET: Final = "that of the kind"

GPS_CORRELATION_S: Final = 1100.0
"""Correlation time of a GPS position error: 1 / k_GPS of Beard and McLain, Small Unmanned Aircraft (2012), chapter 7,
table of the Gauss-Markov error model."""

GPS_SIGMA_M: Final = 4.7
"""1 sigma of a GPS position error, east and north each.

The table of nominal errors of Beard and McLain, chapter 7, has 4.7 m. The 0.21 m of their Gauss-Markov table is what
drives the error once a second, not its size: 0.21 m / sqrt(1 - exp(-2 / 1100)) = 4.9 m. It is 11.5 m at 95 %; the GPS
Standard Positioning Service Performance Standard (5th edition, 2020) promises 8 m as the global average and 15 m at
the worst site."""

GPS_ALTITUDE_SIGMA_M: Final = 9.2
"""1 sigma of a GPS altitude error: nominal errors of Beard and McLain, chapter 7 (0.40 m drive it: 9.4 m)."""

GPS_VELOCITY_SIGMA_MPS: Final = 0.05
"""1 sigma of each component of a GPS velocity: sensor parameters of Beard and McLain; data sheets of u-blox receivers
(NEO-M8, ZED-F9P) have 0.05 m/s as the median."""

RTK_SIGMA_M: Final = 0.017
"""1 sigma of an RTK position, east and north each, 10 km from the base.

Data sheet of the u-blox ZED-F9P: circular error probable 0.01 m + 1 ppm of the baseline; a circular error probable is
1.1774 sigma."""

RTK_ALTITUDE_SIGMA_M: Final = 0.03
"""1 sigma of an RTK altitude, 10 km from the base: the ZED-F9P's median of 0.01 m + 1 ppm, which is 0.6745 sigma."""

RTK_CORRELATION_S: Final = 100.0
"""Correlation time of an RTK position error. Chosen: multipath of some minutes; no figure of a source."""

BAROMETER_SIGMA_M: Final = 10.4
"""1 sigma of a barometric altitude: drift of 0.125 kPa of the absolute pressure sensor in Beard and McLain, chapter 7,
over 1.225 kg/m3 times 9.80665 m/s2."""

COMPASS_SIGMA_DEG: Final = 1.0
"""1 sigma of a heading: the bias of the digital compass in Beard and McLain, chapter 7."""

PITOT_SIGMA_MPS: Final = 0.65
"""1 sigma of a true airspeed near 25 m/s.

The drift of 0.020 kPa of the differential pressure sensor in Beard and McLain, chapter 7, over 1.225 kg/m3 times
25 m/s."""

AIR_DATA_DRIFT: Final = 0.03
"""Share of the distance by which a position drifts that is reckoned from airspeed, heading and the last known wind.

0.65 m/s of 25 m/s and 1 degree of heading, as those sensors have them: sqrt(0.026^2 + 0.017^2)."""

VISUAL_DRIFT: Final = 0.01
"""Share of the distance by which a position drifts that is reckoned from cameras: about what stereo odometry reaches on
the KITTI benchmark (ORB-SLAM2, Mur-Artal and Tardos, 2017: 1.15 %)."""

VISUAL_VELOCITY_SIGMA_MPS: Final = 0.1
"""1 sigma of each component of a velocity that is reckoned without GPS. Chosen: twice that of GPS."""

SIGMAS: Final = 3.0
"""The planner's margin covers so many sigma of the position error: 98.9 % of all errors in the plane are smaller."""

_PERFECT: Final[dict[str, Any]] = {
    "position_sigma_m": 0.0,
    "position_correlation_s": GPS_CORRELATION_S,
    "position_bias_m": (0.0, 0.0),
    "velocity_sigma_mps": 0.0,
    "heading_sigma_deg": 0.0,
    "airspeed_sigma_mps": 0.0,
    "altitude_sigma_m": 0.0,
    "drift_share": 0.0,
    "outages_s": (),
    "latency_s": 0.0,
}
_GNSS: Final[dict[str, Any]] = _PERFECT | {
    "position_sigma_m": GPS_SIGMA_M,
    "velocity_sigma_mps": GPS_VELOCITY_SIGMA_MPS,
    "heading_sigma_deg": COMPASS_SIGMA_DEG,
    "airspeed_sigma_mps": PITOT_SIGMA_MPS,
    "altitude_sigma_m": GPS_ALTITUDE_SIGMA_M,
    "drift_share": AIR_DATA_DRIFT,
}
PRESETS: Final[Mapping[str, Mapping[str, Any]]] = {
    "perfect": _PERFECT,
    "gnss": _GNSS,
    "rtk": _GNSS
    | {
        "position_sigma_m": RTK_SIGMA_M,
        "position_correlation_s": RTK_CORRELATION_S,
        "altitude_sigma_m": RTK_ALTITUDE_SIGMA_M,
    },
    "dead_reckoning": _GNSS
    | {
        "position_sigma_m": 0.0,
        "velocity_sigma_mps": VISUAL_VELOCITY_SIGMA_MPS,
        "altitude_sigma_m": BAROMETER_SIGMA_M,
        "drift_share": VISUAL_DRIFT,
        "outages_s": ((0.0, 1e7),),
    },
}
"""What each kind fills in. `dead_reckoning` knows its start and never has a fix after it."""


class Navigation(Section):
    """What the aircraft believes of its state, beside what it is."""

    kind: Literal["perfect", "gnss", "rtk", "dead_reckoning"] = key(
        "Where the other keys have their defaults from; perfect has no error at all.", "perfect"
    )
    position_sigma_m: Error = key(
        "1 sigma of the position error, east and north each (Gauss-Markov, of first order).", derived=PRESET
    )
    position_correlation_s: float = key(
        "Correlation time of the position error and of the altitude error.", derived=PRESET, ge=1e-3, le=1e7
    )
    position_bias_m: Annotated[tuple[Offset, Offset], Strict(False)] = key(
        "Constant position error on top: east, north.", derived=PRESET
    )
    velocity_sigma_mps: float = key(
        "1 sigma of the error of each component of the velocity.", derived=PRESET, ge=0, le=100
    )
    heading_sigma_deg: float = key("1 sigma of the heading error.", derived=PRESET, ge=0, le=90)
    airspeed_sigma_mps: float = key(
        "1 sigma of the error of the true airspeed.", derived=PRESET, ge=0, le=100
    )
    altitude_sigma_m: Error = key("1 sigma of the altitude error.", derived=PRESET)
    drift_share: Share = key(
        "Without a fix the position drifts by this share of the distance flown.", derived=PRESET
    )
    outages_s: Annotated[tuple[Interval, ...], Strict(False)] = key(
        "Times without a fix, from and to, one after the other; at the end the position comes back with a jump.",
        derived=PRESET,
        max_length=1000,
    )
    latency_s: float = key(
        "Age of the state that guidance and autopilot work with: position, velocity, attitude and airspeed.",
        derived="that of the conditions, 0 for ideal",
        ge=0,
        le=5,
    )
    margin_m: Error = key(
        "What the planner keeps from obstacles beyond planner.clearance_m.",
        derived="3 sigma, the bias, what is flown in latency_s, the drift of the longest outage, or of half a turn "
        "where that is less, and what 3 sigma of the heading misplace an edge by that is one clearance away, or as far "
        "as it takes to turn aside",
    )

    @model_validator(mode="after")
    def _filled_in(self) -> Navigation:
        """Fills in what the kind has, and holds the keys against each other."""
        preset = PRESETS[self.kind]
        for name, value in preset.items():
            given = getattr(self, name)
            if given is None:
                object.__setattr__(self, name, value)
            elif self.kind == "perfect" and name != "position_correlation_s" and given != value:
                told = f"is {given:g}" if isinstance(given, float) else "is given"
                raise KeyFault(
                    (name,), f"{told}, but kind perfect has no error; must be left out, or kind be gnss"
                )
        last_s = -math.inf
        for index, (begin_s, end_s) in enumerate(self.outages_s):
            if not last_s < begin_s < end_s:
                after = "" if math.isinf(last_s) else f", after the one before ends at {last_s:g} s"
                raise KeyFault(
                    ("outages_s", index),
                    f"is [{begin_s:g}, {end_s:g}]; must be [from, to] with from < to{after}",
                )
            last_s = end_s
        return self


def planning_margin_m(
    navigation: Navigation,
    speed_mps: float,
    time_limit_s: float,
    k: float = SIGMAS,
    unseen_m: float = math.inf,
    clearance_m: float = 0.0,
    turn_radius_m: float = 0.0,
) -> float:
    """What clearance must have on top, so that the true aircraft keeps it where the believed one does.

    `k` sigma of the position error, its bias, what is flown while the state grows old, and the drift of the longest
    outage: drift_share x speed x duration. The map drifts as the aircraft does, and is forgotten when a fix comes back:
    what stands in it is off only by what has been drifted since it was last seen. For an error whose two components are
    normal with the same sigma, 1 - exp(-k^2 / 2) of all errors are within k sigma: 98.9 % for 3.

    A heading error turns the scan about the aircraft: an edge at distance d is misplaced by d times the error, square
    to where it is seen. An edge that is passed at the clearance c is beside the aircraft then, and its error lies along
    the way. Before, the map places it anew whenever it is seen from 0.7 of the distance
    (`harness.mapping.obstacle_map`), the last time within c / 0.7. That is sqrt(1 / 0.7^2 - 1) c, one clearance, before
    it is passed. An aircraft with turn radius R needs more than that where 4 R e is more: so far it flies while it
    turns aside by e times that way, left and right. k sigma of the heading times the longer way is added.

    Args:
        navigation: its errors.
        speed_mps: greatest speed over the ground, wind included.
        time_limit_s: when the flight ends at the latest; no outage lasts longer.
        k: sigmas.
        unseen_m: what is passed was seen no longer ago than this distance flown; a scenario has half a turn, during
            which a sensor that looks ahead may lose sight of it.
        clearance_m: wanted distance from obstacles,
        turn_radius_m: and that of plans, for the heading; where both are 0 it is left out.

    Returns:
        The margin in metres; 0 for perfect navigation.
    """
    longest_s = max(
        (min(end_s, time_limit_s) - min(begin_s, time_limit_s) for begin_s, end_s in navigation.outages_s),
        default=0.0,
    )
    drift_m = navigation.drift_share * min(speed_mps * longest_s, unseen_m)
    turned_rad = k * math.radians(navigation.heading_sigma_deg)
    turned_m = turned_rad * max(clearance_m, 4.0 * turn_radius_m * turned_rad)
    known_m = k * navigation.position_sigma_m + math.hypot(*navigation.position_bias_m)
    return known_m + navigation.latency_s * speed_mps + drift_m + turned_m
