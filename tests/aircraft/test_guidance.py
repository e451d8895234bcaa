"""Route geometry and route following, on the point mass."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLaw, GuidanceLimits, GuidanceOutput
from aircraft.guidance.preview import PreviewConfig, PreviewLaw
from aircraft.guidance.progress import route_rows
from aircraft.interface import AircraftState, Route
from aircraft.route import arc_point, route_length
from aircraft.start import Atmosphere, StartConditions
from tests.examples import examples
from tests.point_mass import PointMass
from tests.routes import route_point

AIRSPEED = 25.0
ALTITUDE = 300.0
STEPS = 120 // UPDATE_RATE_HZ
LIMITS = GuidanceLimits(25.0, 32.3, math.pi / 4, math.pi / 3, 0.25, 0.03, 1.44)
"""Of an aircraft that rolls as the point mass does."""
Piece = tuple[float, float]


def preview(limits: GuidanceLimits = LIMITS, **keys: float) -> GuidanceLaw:
    return PreviewLaw(PreviewConfig(**keys).resolved(limits), limits)


def joined(pieces: list[Piece], *, loiter: bool = False, east: float = 0.0, north: float = 0.0) -> Route:
    rows = []
    tangent = (0.0, 1.0)
    for curvature, length in pieces:
        row = (east, north, *tangent, curvature, length)
        rows.append(row)
        east, north, *tangent_list = arc_point(row, length)
        tangent = (tangent_list[0], tangent_list[1])
    return Route(np.array(rows), loiter=loiter)


def fly(
    route: Route,
    start: StartConditions,
    seconds: float,
    wind: tuple[float, float] = (0.0, 0.0),
    limits: GuidanceLimits = LIMITS,
) -> list[tuple[AircraftState, GuidanceOutput]]:
    model, law = PointMass(start, Atmosphere(*wind)), preview(limits)
    law.follow(route)
    flown = []
    for _ in range(round(UPDATE_RATE_HZ * seconds)):
        flown.append((state := model.state(), output := law.update(state)))
        model.command(output.roll_command_rad, ALTITUDE, AIRSPEED)
        model.advance(STEPS)
    return flown


def northwards(east: float = 0.0, north: float = 0.0, course: float = 0.0) -> StartConditions:
    return StartConditions(east, north, ALTITUDE, course, AIRSPEED)


pieces = st.lists(st.tuples(st.floats(-1e-2, 1e-2), st.floats(1.0, 2000.0)), min_size=1, max_size=6)


@given(pieces, st.floats(0.0, 1.0))
def test_the_tangent_is_the_derivative_of_the_point(parts: list[Piece], share: float) -> None:
    route = joined(parts)
    station = share * (route_length(route) - 1e-3)
    east, north, tangent_east, tangent_north = route_point(route, station)
    ahead = route_point(route, station + 1e-3)
    assert (ahead[0] - east) / 1e-3 == pytest.approx(tangent_east, abs=1e-4)
    assert (ahead[1] - north) / 1e-3 == pytest.approx(tangent_north, abs=1e-4)
    assert math.hypot(tangent_east, tangent_north) == pytest.approx(1.0)


@pytest.mark.parametrize("loiter", [False, True])
def test_a_route_is_kept_row_by_row_however_it_was_given(loiter: bool) -> None:
    rows = joined([(0.0, 500.0), (1 / 150.0, 300.0), (0.0, 400.0)]).segments
    kept = route_rows(Route(np.asfortranarray(rows), loiter))
    assert kept.flags.c_contiguous  # compiled guidance reads it as it lies in memory
    np.testing.assert_array_equal(kept[:3, :6], rows)


@pytest.mark.parametrize("wind", [(0.0, 0.0), (6.0, -4.0), (-12.0, 0.0)])
def test_arcs_and_lines_are_tracked(wind: tuple[float, float]) -> None:
    curvature = 1 / (110.0 * (1.0 + math.hypot(*wind) / AIRSPEED) ** 2)
    turn = 1.5 / curvature
    route = joined([(0.0, 300.0), (curvature, turn), (0.0, 200.0), (-curvature, turn), (curvature, turn)])
    flown = fly(route, northwards(), 30.0, wind)
    # Without the drift angle in the law a crosswind of 12 m/s leaves 0.2 m in the turns.
    assert max(abs(output.cross_track_m) for _, output in flown) < 0.12
    assert not any(output.bank_saturated for _, output in flown)


def test_curvature_preview_is_what_keeps_a_joint_smooth() -> None:
    """Without knowing the lag of the roll loop the bump at the joint is several times as high."""
    route = joined([(0.0, 200.0), (1 / 120.0, 300.0), (0.0, 500.0)])

    def worst(limits: GuidanceLimits) -> float:
        return max(abs(output.cross_track_m) for _, output in fly(route, northwards(), 30.0, limits=limits))

    assert worst(LIMITS) < 0.2
    assert worst(replace(LIMITS, roll_lag_s=0.0, roll_delay_s=0.0)) > 3 * worst(LIMITS)


def test_a_turn_rate_short_of_a_coordinated_turn_is_made_up_for_by_bank() -> None:
    full, short = (preview(replace(LIMITS, turn_rate_share=share)) for share in (1.0, 0.9))
    tangents = []
    for law in (full, short):
        law.follow(joined([(1 / 150.0, 1500.0)]))
        for _ in range(UPDATE_RATE_HZ * 3):
            output = law.update(PointMass(northwards()).state())
        tangents.append(math.tan(output.roll_command_rad))
    assert tangents[0] == pytest.approx(0.9 * tangents[1])
    assert tangents[0] != 0.0


@given(
    st.floats(-3000.0, 3000.0),
    st.floats(0.0, math.tau),
    st.sampled_from([(0.0, 0.0), (8.0, 3.0), (-5.0, -10.0)]),
)
@settings(max_examples=examples(12))
def test_a_far_off_start_ends_on_the_path(offset: float, course: float, wind: tuple[float, float]) -> None:
    flown = fly(joined([(0.0, 20000.0)]), northwards(offset, 0.0, course), 480.0, wind)
    assert all(abs(output.cross_track_m) < 0.1 for _, output in flown[-10 * UPDATE_RATE_HZ :])
    assert max(abs(output.cross_track_m) for _, output in flown) < abs(offset) + 500.0


def test_the_intercept_angle_is_bounded() -> None:
    flown = fly(joined([(0.0, 20000.0)]), northwards(2000.0), 100.0)
    assert max(abs(math.sin(state.course_rad)) for state, _ in flown) == pytest.approx(0.7, abs=0.02)


def test_past_the_end_it_goes_straight_on() -> None:
    flown = fly(joined([(0.0, 100.0), (1 / 150.0, 150.0 * math.pi / 2)]), northwards(), 40.0)
    state, output = flown[-1]
    assert output.past_end
    assert not flown[0][1].past_end
    assert math.sin(state.course_rad) == pytest.approx(-1.0, abs=1e-4)
    assert state.north_m == pytest.approx(250.0, abs=0.1)
