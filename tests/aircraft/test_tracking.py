"""Guidance, autopilot and JSBSim together: how close the aircraft stays to a planned route.

Thresholds are those that a user is promised; what is flown is about half of each.
"""

from __future__ import annotations

import math
import random
from typing import NamedTuple

import numpy as np
import pytest

from aircraft.airframes import airframe
from aircraft.envelope import performance
from aircraft.frames import LocalPlane
from aircraft.guidance import PathFollower, arc_point
from aircraft.interface import Command, Route
from aircraft.jsbsim_model import JsbsimModel
from aircraft.start import Atmosphere, StartConditions

ALTITUDE = 300.0
COURSE = 0.3


class Tracking(NamedTuple):
    cross_p95: float
    cross_max: float
    altitude_p95: float
    saturated: float


def course(seed: int, radius_m: float, turns: int = 8) -> Route:
    """Lines and arcs of 20 to 120 degrees, left and right, at one radius."""
    rng = random.Random(seed)
    pieces = [(0.0, 4.0 * radius_m)]
    for _ in range(turns):
        pieces.append((rng.choice((-1, 1)) / radius_m, math.radians(rng.uniform(20, 120)) * radius_m))
        pieces.append((0.0, rng.uniform(1.0, 4.0) * radius_m))
    rows = []
    point = (0.0, 0.0, math.sin(COURSE), math.cos(COURSE))
    for curvature, length in pieces:
        rows.append((*point, curvature, length))
        point = arc_point(rows[-1], length)
    return Route(np.array(rows))


def tracked(name: str, atmosphere: Atmosphere, seed: int, airspeed: float | None = None) -> Tracking:
    """Flies a course at the radius that planning would use."""
    frame = airframe(name)
    airspeed = airspeed or frame.cruise_mps
    planned = performance(frame, airspeed, atmosphere.wind_mps, atmosphere.intensity)
    start = StartConditions(0.0, 0.0, ALTITUDE, COURSE, airspeed)
    model = JsbsimModel(name, start, LocalPlane(47.0, 8.0), atmosphere)
    follower = PathFollower(frame.guidance_limits)
    follower.follow(course(seed, planned.turn_radius_m))
    cross, altitude, saturated = [], [], []
    while True:
        assert model.fault() is None
        state = model.state()
        output = follower.update(state)
        if output.past_end:
            break
        cross.append(abs(output.cross_track_m))
        altitude.append(abs(state.up_m - ALTITUDE))
        saturated.append(output.bank_saturated)
        model.command(Command(output.roll_command_rad, ALTITUDE, airspeed))
        model.advance(6)
    assert max(cross) <= planned.tracking_error_m
    return Tracking(
        float(np.percentile(cross, 95)),
        max(cross),
        float(np.percentile(altitude, 95)),
        float(np.mean(saturated)),
    )


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    ("atmosphere", "promised"),
    [
        (Atmosphere(), Tracking(0.15, 0.35, 0.15, 0.0)),
        (Atmosphere(wind_east_mps=7.5), Tracking(0.20, 0.50, 0.15, 0.0)),
        (Atmosphere(wind_north_mps=-12.5), Tracking(0.30, 0.80, 0.20, 0.0)),
        (Atmosphere(0.0, 0.0, "tustin", "moderate", 11), Tracking(0.50, 2.0, 1.0, 0.0)),
        (Atmosphere(0.0, 0.0, "milspec", "moderate", 12), Tracking(0.50, 2.0, 1.0, 0.0)),
        (Atmosphere(-5.3, 5.3, "tustin", "severe", 13), Tracking(1.0, 4.0, 2.0, 0.02)),
    ],
    ids=["calm", "wind30", "wind50", "tustin", "milspec", "severe"],
)
def test_aerosonde(atmosphere: Atmosphere, promised: Tracking, seed: int) -> None:
    flown = tracked("aerosonde", atmosphere, seed)
    assert all(value <= limit for value, limit in zip(flown, promised, strict=True)), flown


@pytest.mark.parametrize("airspeed", [20.0, 30.0])
def test_aerosonde_away_from_cruise(airspeed: float) -> None:
    flown = tracked("aerosonde", Atmosphere(), seed=4, airspeed=airspeed)
    assert flown.cross_p95 <= 0.2
    assert flown.cross_max <= 0.5
    assert flown.altitude_p95 <= 0.3


@pytest.mark.parametrize("wind", [0.0, 15.0])
def test_c172p(wind: float) -> None:
    flown = tracked("c172p", Atmosphere(wind_east_mps=wind), seed=5)
    assert flown.cross_p95 <= 0.6
    assert flown.cross_max <= 1.4
    assert flown.altitude_p95 <= 0.6
    assert flown.saturated == 0.0
