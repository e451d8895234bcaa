"""Guidance as machine code, as every flight has it, against its source."""

from __future__ import annotations

import math
import random
import subprocess
import sys
from types import FunctionType

import numpy as np
import pytest

import harness.run.compiled_guidance  # noqa: F401
from aircraft import guidance_law
from aircraft.airframes import airframe
from aircraft.guidance import GuidanceOutput, PathFollower
from aircraft.interface import AircraftState, Route
from aircraft.route import arc_point, route_length, route_point
from planner.compiled import compile_all

LIMITS = airframe("aerosonde").guidance_limits
CIRCLE = (1.0 / 120.0, math.tau * 120.0)


def source() -> dict[str, FunctionType]:
    """Its functions as they are written, which call each other and nothing that was compiled."""
    names = dict(vars(guidance_law))
    for function, _ in guidance_law.COMPILED:
        names[function.__name__] = FunctionType(function.__code__, names)
    return names


def drawn(rng: np.random.Generator) -> Route:
    """Lines and arcs, joined; some end in a loiter."""
    loiter = bool(rng.random() < 0.5)
    pieces = [
        (float(rng.choice((0.0, *rng.uniform(-1e-2, 1e-2, 2)))), float(rng.uniform(1.0, 2000.0)))
        for _ in range(rng.integers(1, 6))
    ]
    rows, place = [], (0.0, 0.0, 0.0, 1.0)
    for curvature, length in [*pieces, CIRCLE] if loiter else pieces:
        rows.append((*place, curvature, length))
        place = arc_point(rows[-1], length)
    return Route(np.array(rows), loiter)


def near(route: Route, arc_length_m: float, rng: np.random.Generator) -> AircraftState:
    """Somewhere about a station, on any course, in any wind, a hurricane included."""
    east, north, tangent_east, tangent_north = route_point(route, arc_length_m)
    off = rng.normal(0.0, float(rng.choice((0.0, 1.0, 100.0))), 2)
    heading = math.atan2(tangent_east, tangent_north) + float(rng.normal(0.0, rng.choice((0.1, 3.0))))
    wind = rng.normal(0.0, float(rng.choice((0.0, 5.0, 40.0))), 2)
    velocity = 25.0 * np.array((math.sin(heading), math.cos(heading))) + wind
    values = (east + off[0], north + off[1], 300.0, *velocity, 0.0, heading % math.tau, 0.0, 0.0, 25.0, 1.0)
    return AircraftState(0.0, *map(float, values))


@pytest.mark.parametrize("seed", range(40))
def test_it_decides_as_its_source_to_the_last_bit(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    compile_all()
    assert not isinstance(guidance_law.decide, FunctionType)
    rng = np.random.default_rng(seed)
    route = drawn(rng)
    states = [near(route, float(share) * route_length(route), rng) for share in np.linspace(0.0, 1.5, 60)]

    def decided() -> list[GuidanceOutput]:
        follower = PathFollower(LIMITS)
        follower.follow(route, 5.0)
        return [follower.update(state) for state in states]

    compiled = decided()
    monkeypatch.setattr(guidance_law, "decide", source()["decide"])
    assert decided() == compiled


def test_a_length_is_rounded_once() -> None:
    """As CPython's own, which C's is not."""
    lengths = guidance_law._length, source()["_length"]
    numbers = random.Random(1)
    for _ in range(20_000):
        x, y = (numbers.uniform(-1.0, 1.0) * 10.0 ** numbers.uniform(-3.0, 5.0) for _ in range(2))
        assert {length(x, y) for length in lengths} == {math.hypot(x, y)}
    assert [length(0.0, 0.0) for length in lengths] == [0.0, 0.0]


def test_courses_are_flown_with_it() -> None:
    code = (
        "from types import FunctionType; from aircraft import guidance_law\n"
        "from aircraft.airframes import airframe; from aircraft.start import Atmosphere\n"
        "from harness.bench.tracking import course, fly_course\n"
        "fly_course(airframe('aerosonde'), 25.0, Atmosphere(), course(1, 200.0, 1))\n"
        "assert not isinstance(guidance_law.decide, FunctionType)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
