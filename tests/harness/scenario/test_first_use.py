"""The first use of an aircraft, when nothing has been measured and nothing compiled."""

from __future__ import annotations

import pytest

from harness.scenario import craft
from harness.scenario.sections import AircraftSpec


@pytest.mark.parametrize(("surveyed", "begun"), [(False, [craft.SURVEY_BYTES]), (True, [])])
def test_planners_are_compiled_while_an_aircraft_is_surveyed(
    surveyed: bool, begun: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    monkeypatch.setattr(craft, "begin_compiling", asked.append)
    monkeypatch.setattr("aircraft.airframes.is_surveyed", lambda name: surveyed)
    craft._prepare.cache_clear()
    for _ in range(2):
        assert craft.airframe_of(AircraftSpec(model="aerosonde")).name == "aerosonde"
    assert asked == begun
