"""Machine code of guidance against its source, and the nearest point of a route against a search of all of it."""

import math
from types import FunctionType
from typing import Any

import numpy as np
import pytest
import shapely

from aircraft import kernels
from aircraft.airframes import airframe
from aircraft.guidance.interface import GuidanceOutput
from aircraft.guidance.preview import PreviewConfig, PreviewLaw
from aircraft.guidance.progress import RouteProgress
from aircraft.interface import AircraftState, Route
from aircraft.route import route_length
from harness.scenario.kinds import guidance_kinds
from planner.interface import Path
from tests.routes import route_of, route_point

LIMITS = airframe("aerosonde").guidance_limits()
CIRCLE = (1.0 / 120.0, math.tau * 120.0)


def source(name: str) -> Any:
    """A function of `kernels` as it is written; the functions that it calls are too."""
    names = dict(vars(kernels))
    for each, function in vars(kernels).items():
        if hasattr(function, "py_func"):
            names[each] = FunctionType(function.py_func.__code__, names)
    return names[name]


def drawn(rng: np.random.Generator) -> Route:
    """Lines and arcs, joined; some end in a loiter."""
    loiter = bool(rng.random() < 0.5)
    pieces = [
        (float(rng.choice((0.0, *rng.uniform(-1e-2, 1e-2, 2)))), float(rng.uniform(1.0, 2000.0)))
        for _ in range(rng.integers(1, 6))
    ]
    return route_of(*pieces, *([CIRCLE] if loiter else []), loiter=loiter)


def near(route: Route, arc_length_m: float, rng: np.random.Generator) -> AircraftState:
    """Somewhere about an arc length, on any course, in any wind, a hurricane included."""
    east, north, tangent_east, tangent_north = route_point(route, arc_length_m)
    off = rng.normal(0.0, float(rng.choice((0.0, 1.0, 100.0))), 2)
    heading = math.atan2(tangent_east, tangent_north) + float(rng.normal(0.0, rng.choice((0.1, 3.0))))
    wind = rng.normal(0.0, float(rng.choice((0.0, 5.0, 40.0))), 2)
    velocity = 25.0 * np.array((math.sin(heading), math.cos(heading))) + wind
    values = (east + off[0], north + off[1], 300.0, *velocity, 0.0, heading % math.tau, 0.0, 0.0, 25.0, 1.0)
    return AircraftState(0.0, *map(float, values))


@pytest.mark.parametrize("seed", range(10))
def test_the_law_decides_as_its_source(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    route = drawn(rng)
    states = [near(route, float(share) * route_length(route), rng) for share in np.linspace(0.0, 1.5, 60)]

    def decided() -> list[GuidanceOutput]:
        law = PreviewLaw(PreviewConfig().resolved(LIMITS), LIMITS)
        law.follow(route, 5.0)
        return [law.update(state) for state in states]

    compiled = decided()

    def by_source(rows: Any, gains: Any, memory: Any, *numbers: Any) -> Any:
        return source("preview_update")(rows, gains.view(np.recarray), memory.view(np.recarray), *numbers)

    monkeypatch.setattr(kernels, "for_types_of", lambda function, *_: by_source)
    np.testing.assert_allclose(np.array(decided(), float), np.array(compiled, float), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_a_point_beside_a_route_is_told_with_its_distance_and_curvature(seed: int) -> None:
    rng = np.random.default_rng(seed)
    route = drawn(rng)
    progress = RouteProgress(route)
    ends = np.cumsum(route.segments[:, 5])
    for arc_length in np.linspace(0.0, 0.999 * route_length(route), 200):
        off = float(rng.uniform(-20.0, 20.0))
        east, north, tangent_east, tangent_north = route_point(route, float(arc_length))
        point = progress.nearest(east + off * tangent_north, north - off * tangent_east)
        assert point.cross_track_m == pytest.approx(off, abs=1e-6)
        assert point.arc_length_m == pytest.approx(arc_length, abs=1e-6)
        assert (point.east_m, point.north_m) == pytest.approx((east, north), abs=1e-6)
        tangent = tangent_east, tangent_north
        assert (point.tangent_east, point.tangent_north) == pytest.approx(tangent, abs=1e-9)
        assert point.curvature_1pm in route.segments[[int(np.searchsorted(ends, arc_length))], 4]
        assert point.off_m == point.cross_track_m  # to the last bit, where no corner is near
        assert not point.past_end


@pytest.mark.parametrize(("turn_deg", "back"), [(60.0, -5.0), (-90.0, -5.0), (150.0, 1.0), (-179.0, 1.0)])
def test_beyond_a_corner_the_distance_is_that_from_the_path(turn_deg: float, back: float) -> None:
    """Flown 2 m outside of the first leg past the corner at the origin, and back; by shapely."""
    turn, outside = math.radians(turn_deg), math.copysign(2.0, turn_deg)
    points = np.array([(-1000.0, 0.0), (0.0, 0.0), (500.0 * math.cos(turn), 500.0 * math.sin(turn))])
    route, laws = Route(Path.through(points).segments), ("preview", "l1")
    progress, flown = RouteProgress(route), [guidance_kinds()[each].law(LIMITS) for each in laws]
    for law in flown:
        law.follow(route)
    for east in (-500.0, -1.0, 1.0, 20.0, 60.0, back):
        distance_m = shapely.LineString(points).distance(shapely.Point(east, -outside))
        by_hand = math.copysign(distance_m, outside)  # a turn to the left is passed on the right
        assert progress.nearest(east, -outside).off_m == pytest.approx(by_hand)
        state = AircraftState(0.0, east, -outside, 300.0, 25.0, 0.0, 0.0, 0.5 * math.pi, 0.0, 0.0, 25.0, 1.0)
        assert [law.update(state).cross_track_m for law in flown] == pytest.approx([by_hand, by_hand])


@pytest.mark.parametrize("curvature", [1e-13, 1e-15, -1e-17, -1e-25])
def test_beside_a_line_that_rounding_has_curved_the_cross_track_error_is_the_distance_from_the_line(
    curvature: float,
) -> None:
    """By hand: 3 m to the right of the x axis, whatever the curvature that rounding has left in the segment."""
    progress = RouteProgress(Route(Path(np.array([(0.0, 0.0, 1.0, 0.0, curvature, 6000.0)])).segments))
    for along_m in np.linspace(0.0, 5900.0, 60):
        point = progress.nearest(float(along_m), -3.0)
        assert (point.arc_length_m, point.cross_track_m) == pytest.approx((along_m, 3.0), abs=1e-6)
