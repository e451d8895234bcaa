"""Worlds of separate convex obstacles, drawn at random: the goal is reached and the clearance kept."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from harness.flight.record import Outcome
from tests.closed_loop.small import flown_by_point_mass, small_world

CELL_M, CELLS = 1100.0, 4
FIRST_CENTRE_M = 1350.0
LARGEST_M, SHIFT_M = 280.0, 120.0
"""Neighbours are at least 1100 - 2 (280 + 120) = 300 m apart, three turn radii of the aircraft."""


BOUNDED = settings(
    derandomize=True,
    phases=(Phase.explicit, Phase.reuse, Phase.generate),
    max_examples=settings().max_examples // 2,
)
"""A flight takes a third of a second: a failure is shown as drawn, for shrinking it would take minutes."""


@st.composite
def obstacles(draw: st.DrawFn, east: float, north: float, most_corners: int) -> dict[str, Any]:
    """A circle, or a convex polygon of at most so many corners, about a place."""
    shift, radii = st.integers(-int(SHIFT_M), int(SHIFT_M)), st.integers(60, int(LARGEST_M))
    x, y, radius = east + draw(shift), north + draw(shift), float(draw(radii))
    corners = draw(st.integers(2, most_corners))
    if corners == 2:
        return {"circle": {"center_m": [x, y], "radius_m": radius}}
    turned = math.radians(draw(st.integers(0, 119)))
    angles = [turned + math.tau * corner / corners for corner in range(corners)]
    ring = [[x + radius * math.cos(angle), y + radius * math.sin(angle)] for angle in angles]
    return {"polygon": {"vertices_m": ring}}


@st.composite
def fields(draw: st.DrawFn, most_corners: int = 7) -> list[dict[str, Any]]:
    """Up to one obstacle in each cell of a grid."""
    places = [FIRST_CENTRE_M + CELL_M * step for step in range(CELLS)]
    taken = draw(st.lists(st.booleans(), min_size=CELLS**2, max_size=CELLS**2))
    cells = [(east, north) for east in places for north in places]
    return [draw(obstacles(*cell, most_corners)) for cell, full in zip(cells, taken, strict=True) if full]


@pytest.mark.flights
@given(field=fields(), wind_from_deg=st.none() | st.integers(0, 359))
@BOUNDED
def test_reaches_the_goal_among_corners_in_any_wind(
    field: list[dict[str, Any]], wind_from_deg: int | None
) -> None:
    wind = {"speed_mps": 5.0, "from_deg": float(wind_from_deg or 0)}
    scenario = small_world(*field, environment={} if wind_from_deg is None else {"wind": wind})
    flight = flown_by_point_mass(scenario)
    assert flight.outcome is Outcome.REACHED, flight.reason
    wanted_m = scenario.planner.clearance_m
    assert flight.track.clearance_m.min() >= wanted_m
