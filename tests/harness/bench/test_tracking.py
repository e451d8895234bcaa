"""Guidance, autopilot and JSBSim together: how close an aircraft stays to planned routes, in all kinds of air.

The limits are those that a user is promised; what is flown is about half of each.
"""

import numpy as np
import pytest

from aircraft.airframes import aircraft_names, airframe
from aircraft.envelope import performance
from aircraft.start import Atmosphere
from harness.bench.tracking import TURNS, course, fly_course
from tests.closed_loop import courses_table
from tests.closed_loop.courses_table import (
    ALTITUDE_NOT_HELD,
    CASES,
    LIMIT_FACTORS,
    Case,
    times,
    tracked,
    within,
)
from tests.routes import route_point

CALM = CASES[0]
MEASURED = ("aerosonde", "c172p", "T38")
"""Aircraft that fly twenty courses in each air, the others two."""


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_the_aerosonde_keeps_what_is_promised(case: Case) -> None:
    flown = tracked("aerosonde", case, [1])
    assert within(flown, case.limits), flown


@pytest.mark.flights
@pytest.mark.parametrize("name", [name for name in LIMIT_FACTORS if name != "aerosonde"])
def test_others_keep_their_multiple_of_it(name: str) -> None:
    flown = tracked(name, CASES[1], [1])
    assert within(flown, times(CASES[1].limits, LIMIT_FACTORS[name])), flown


@pytest.mark.slow
@pytest.mark.parametrize("name", LIMIT_FACTORS)
def test_courses_of_every_verified_aircraft(name: str) -> None:
    """In all air that they stay up in."""
    for case in CASES:
        if (name, case.intensity) in ALTITUDE_NOT_HELD:
            continue
        flown = tracked(name, case, range(1, 21 if name in MEASURED else 3))
        assert within(flown, times(case.limits, LIMIT_FACTORS[name])), (case.name, flown)


@pytest.mark.flights
def test_verified_are_those_that_have_limits() -> None:
    assert {name for name in aircraft_names() if airframe(name).verified} == set(LIMIT_FACTORS)


def test_stays_within_the_error_that_planning_allows_for() -> None:
    for case in (CALM, CASES[3]):
        allowed = performance(airframe("aerosonde"), 25.0, 0.0, case.intensity).tracking_error_m
        assert tracked("aerosonde", case, [2]).cross_track_max_m <= allowed


def test_a_turn_that_is_too_tight_is_not_tracked() -> None:
    frame = airframe("aerosonde")
    tight = fly_course(frame, 25.0, Atmosphere(), course(1, 0.5 * performance(frame, 25.0).turn_radius_m))
    assert tight.bank_saturation > 0.1
    assert not within(tight, CALM.limits)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_courses_are_joined_and_turn_as_they_should(seed: int) -> None:
    route = course(seed, 100.0)
    turns = route.segments[route.segments[:, 4] != 0.0]
    degrees = np.degrees(np.abs(turns[:, 4]) * turns[:, 5])
    assert len(turns) == TURNS
    assert np.all((degrees >= 20.0) & (degrees <= 120.0))
    assert np.allclose(np.abs(turns[:, 4]), 0.01)
    stations = np.concatenate(([0.0], np.cumsum(route.segments[:-1, 5])))
    for row, station in zip(route.segments[1:], stations[1:], strict=True):
        assert row[:4] == pytest.approx(route_point(route, station - 1e-9), abs=1e-6)
    assert not np.array_equal(course(seed + 1, 100.0).segments, route.segments)


def test_other_laws_are_flown() -> None:
    ours, theirs = (tracked("aerosonde", CALM, [1], guidance=kind) for kind in ("preview", "l1"))
    assert theirs.cross_track_p95_m > 5.0 * ours.cross_track_p95_m


def test_an_aircraft_that_is_lost_is_a_row_of_the_table(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def lost(*_: object) -> None:
        raise ArithmeticError("c172p: control is lost after 9 s: stalled")

    monkeypatch.setattr(courses_table, "CASES", CASES[5:])
    monkeypatch.setattr(courses_table, "fly_course", lost)
    courses_table.main("c172p", "preview", "1")
    told = "| severe, wind 30 % | c172p: control is lost after 9 s: stalled |\n"
    assert capsys.readouterr().out.endswith(told)
