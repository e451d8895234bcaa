"""Every aircraft of the fleet in a world at its own scale."""

import re

import pytest

from aircraft.airframes import aircraft_names
from tests.closed_loop.fleet_table import flown


@pytest.mark.slow
@pytest.mark.parametrize("law", ["preview", "npfg"])
@pytest.mark.parametrize("name", aircraft_names())
def test_every_aircraft_reaches_the_goal_at_the_clearance(name: str, law: str) -> None:
    # In wind the world at the scale of the 787-8 is wider than the local plane, which reaches 400 km.
    flight = flown(name, law, "calm" if name == "787-8" else "wind 30 %", seed=1)
    assert flight.good, flight


def test_a_range_that_is_too_short_is_refused_with_the_one_that_is_needed() -> None:
    flight = flown("T38", "preview", "calm", seed=1, range_radii=2.2)
    assert (flight.outcome, flight.good) == ("refused", False)
    assert re.search(r"must be at least \d+, to see room for a safe turn ahead", flight.reason)
