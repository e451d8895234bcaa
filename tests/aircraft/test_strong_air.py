"""Gust fronts, and wind that the aircraft cannot fly against."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aircraft.airframes import airframe
from aircraft.frames import LocalPlane
from aircraft.guidance.interface import UPDATE_RATE_HZ
from aircraft.guidance.preview import PreviewConfig, PreviewLaw
from aircraft.interface import AircraftState, FlightModel, Route
from aircraft.jsbsim_model import JsbsimModel
from aircraft.kernels import air_direction
from aircraft.start import Atmosphere, StartConditions

EASTWARDS = StartConditions(0.0, 0.0, 300.0, math.pi / 2, 25.0)
EAST_LINE = Route(np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 20_000.0]]))


class Row(NamedTuple):
    state: AircraftState
    cross_track_m: float
    roll_command_rad: float


def flown(model: FlightModel, seconds: float, route: Route = EAST_LINE) -> list[Row]:
    limits = airframe("aerosonde").guidance_limits()
    law = PreviewLaw(PreviewConfig().resolved(limits), limits)
    law.follow(route)
    rows = []
    for _ in range(round(UPDATE_RATE_HZ * seconds)):
        state = model.state()
        output = law.update(state)
        rows.append(Row(state, output.cross_track_m, output.roll_command_rad))
        model.command(output.roll_command_rad, 300.0, 25.0)
        model.advance(model.step_rate_hz // UPDATE_RATE_HZ)
        assert model.fault() is None
    return rows


def test_the_aircraft_flies_in_wind_that_changes() -> None:
    """Until it does the flight is as without, but for rounding; then the air moves as told."""

    def air_north(state: AircraftState) -> float:
        return state.velocity_north_mps - state.airspeed_mps * math.cos(state.heading_rad)

    plane, begun = LocalPlane(47.0, 8.0), 5 * UPDATE_RATE_HZ
    calm = flown(JsbsimModel(airframe("aerosonde"), EASTWARDS, plane, Atmosphere(wind_east_mps=3.0)), 12.0)
    front = Atmosphere(wind_east_mps=3.0, changes=((5.0, 3.0, 0.0), (5.01, 3.0, 8.0)))
    gusty = flown(JsbsimModel(airframe("aerosonde"), EASTWARDS, plane, front), 12.0)
    assert gusty[begun - 1].state == pytest.approx(calm[begun - 1].state, abs=1e-6)
    assert gusty[begun + 1 :] != calm[begun + 1 :]
    assert max(abs(row.state.load_factor - 1.0) for row in gusty[:begun]) < 0.01
    at_8_s, at_11_s = (air_north(gusty[UPDATE_RATE_HZ * t].state) for t in (8, 11))
    assert at_8_s == pytest.approx(8.0, abs=2.5)  # less what sideslip hides from this estimate
    assert max(abs(row.cross_track_m) for row in gusty) > 0.05
    assert at_11_s == pytest.approx(8.0, abs=1.0)


def test_a_gust_front_is_flown_through() -> None:
    front = Atmosphere(changes=((20.0, 0.0, 0.0), (20.01, 0.0, 7.5)))
    rows = flown(JsbsimModel(airframe("aerosonde"), EASTWARDS, LocalPlane(47.0, 8.0), front), 60.0)
    assert max(abs(row.cross_track_m) for row in rows) < 8.0
    assert max(abs(row.cross_track_m) for row in rows[50 * UPDATE_RATE_HZ :]) < 0.2


angles = st.floats(0.0, math.tau)


@given(angles, angles, st.floats(1.0, 4.0))
def test_the_heading_makes_the_bearing_good_where_that_can_be(wind_to: float, bearing: float, ratio: float) -> None:
    wind, airspeed = ratio * 25.0, 25.0
    we, wn = wind * math.sin(wind_to), wind * math.cos(wind_to)
    be, bn = math.sin(bearing), math.cos(bearing)
    east, north = air_direction(we, wn, airspeed, be, bn)
    assert math.hypot(east, north) == pytest.approx(1.0)
    ge, gn = we + airspeed * east, wn + airspeed * north
    if abs(math.remainder(bearing - wind_to, math.tau)) < math.asin(1.0 / ratio) - 1e-6:
        assert abs(math.remainder(math.atan2(ge, gn) - bearing, math.tau)) < 1e-5
    else:
        assert ge * be + gn * bn >= airspeed - wind - 1e-9  # not blown back faster than it must


@pytest.mark.parametrize(("wind", "heading"), [((-30.0, 0.0), 90.0), ((0.0, -30.0), 29.0), ((30.0, 0.0), 90.0)])
def test_in_too_much_wind_it_drifts_without_circling(wind: tuple[float, float], heading: float) -> None:
    """Towards the east at 25 m/s: against the wind, across it, with it."""
    air = Atmosphere(changes=((120.0, *wind),))
    rows = flown(JsbsimModel(airframe("aerosonde"), EASTWARDS, LocalPlane(47.0, 8.0), air), 120.0)
    last = rows[-1].state
    headings = [math.degrees(row.state.heading_rad) for row in rows]
    assert abs(math.remainder(headings[-1] - heading, 360.0)) < 25.0
    assert sum(abs(math.remainder(b - a, 360.0)) for a, b in pairwise(headings)) < 200.0
    assert abs(last.roll_rad) < math.radians(5.0)
    if wind[1] == 0.0:
        assert abs(rows[-1].cross_track_m) < 1.0
        assert last.velocity_east_mps == pytest.approx(25.0 + wind[0], abs=1.0)


def test_when_the_wind_drops_the_path_is_flown_again() -> None:
    air = Atmosphere(changes=((60.0, -20.0, -20.0), (120.0, 0.0, 0.0)))
    rows = flown(JsbsimModel(airframe("aerosonde"), EASTWARDS, LocalPlane(47.0, 8.0), air), 180.0)
    assert max(abs(row.cross_track_m) for row in rows) > 20.0
    assert max(abs(row.cross_track_m) for row in rows[170 * UPDATE_RATE_HZ :]) < 0.2
