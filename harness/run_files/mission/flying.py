"""A mission in the local plane, what it is flown with, and the route that is made of both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from aircraft.guidance.altitude import VerticalProfile
from aircraft.guidance.mission_legs import MissionLeg
from harness.run_files.given_path import FloatArray, FlyBy

Ground = Callable[[FloatArray, FloatArray], FloatArray]
"""East and north -> height of the ground above mean sea level, NaN where it is not known."""


CORNER_M: Final = 90.0
"""How far off a waypoint of a mission may be passed that says nothing itself: ArduPilot Plane's default WP_RADIUS."""


def corner_limit_m(acceptance_m: float, corner_m: float | None) -> float:
    """How far off a waypoint may be passed: as is asked for all of them, else as it says itself, else `CORNER_M`."""
    return corner_m if corner_m is not None else acceptance_m or CORNER_M


@dataclass(frozen=True)
class Flying:
    """What a mission is flown with.

    Attributes:
        airspeed_mps: before the mission says otherwise.
        airspeed_range_mps: what the aircraft holds.
        turn_radius_m: for a turn at an airspeed that leaves the aircraft bank in hand.
        climb_mps: fastest climb and descent at an airspeed.
        free_cut_m: a corner may be passed at this distance only to make its arc wider.
        least_radius_m: of a turn at the bank limit at an airspeed, in calm air; None: the same.
        heads_for_centres: a loiter is flown to as far as its circle on the line to its centre; else along a tangent.
        corner_m: how far off every corner may be passed; None: as its item says, else `CORNER_M`.
        wind_mps: east + i north where the wind blows to.
        ground: height of the ground; None: not known, then it is taken to be as high as home.
    """

    airspeed_mps: float
    airspeed_range_mps: tuple[float, float]
    turn_radius_m: Callable[[float], float]
    climb_mps: Callable[[float], tuple[float, float]]
    free_cut_m: float
    ground: Ground | None = None
    least_radius_m: Callable[[float], float] | None = None
    heads_for_centres: bool = False
    corner_m: float | None = None
    wind_mps: complex = 0j


@dataclass(frozen=True, eq=False)
class MissionRoute:
    """A mission as it is flown.

    Attributes:
        way: lines and arcs; its corners have the numbers of their items.
        profile: altitude and airspeed along it.
        asked_mps: the airspeeds that the mission asks for, as those of the profile; the aircraft may not hold them.
        marks: item and arc length where each is reached.
        notes: what was assumed, a line each.
        legs: the mission leg by leg, for a law that flies to its waypoints.
    """

    way: FlyBy
    profile: VerticalProfile
    asked_mps: FloatArray
    marks: tuple[tuple[int, float], ...]
    notes: tuple[str, ...]
    legs: tuple[MissionLeg, ...]
