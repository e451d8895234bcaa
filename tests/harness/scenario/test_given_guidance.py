"""Guidance laws that somebody hands over in Python."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import pytest

from aircraft.airframes import airframe
from aircraft.guidance import registry
from aircraft.guidance.interface import GuidanceLaw, GuidanceLimits, GuidanceOutput
from aircraft.guidance.registry import GuidanceKind, guidance_kinds
from aircraft.interface import AircraftState, Route
from harness.api.flights import fly
from harness.flight.record import Outcome
from harness.scenario.given import GUIDANCE
from harness.scenario.given import kind_of as kind_of_part
from harness.scenario.given import registered as registered_part
from harness.scenario.scenario import load_scenario

LIMITS = airframe("aerosonde").guidance_limits()
kind_of, registered = partial(kind_of_part, part=GUIDANCE), partial(registered_part, part=GUIDANCE)


@pytest.fixture(autouse=True)
def _own_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_registered", {})


def preview(limits: GuidanceLimits) -> GuidanceLaw:
    """The default law, made by a function."""
    return guidance_kinds()["preview"].law(limits)


class Failing:
    """Flies as preview does, and raises after some time."""

    def __init__(self) -> None:
        self.law = preview(LIMITS)

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        self.law.follow(route, arc_length_m)

    def update(self, state: AircraftState) -> GuidanceOutput:
        if state.north_m > 0.0 and state.time_s > 20.0 and abs(state.up_m - 120.0) < 30.0:
            raise RuntimeError("no idea")
        return self.law.update(state)


@pytest.mark.parametrize("given", [preview, Failing, Failing()])
def test_functions_classes_and_objects_make_a_law(given: object) -> None:
    kind = kind_of(given)
    assert isinstance(kind, GuidanceKind)
    assert callable(kind.law(LIMITS).update)
    assert registered(given) == registered(kind) == kind.kind
    assert kind.kind in guidance_kinds()


def test_names_stay_names_and_what_steers_nothing_is_told() -> None:
    assert registered("l1") == "l1"
    with pytest.raises(ValueError, match="a guidance law must be a kind, a class"):
        registered(3.0)
    with pytest.raises(ValueError, match="needs one, two; must need the limits alone"):
        registered(lambda one, two: None)
    with pytest.raises(ValueError, match="there is a guidance law called l1 already"):
        registered(replace(kind_of(preview), kind="l1"))


def test_a_flight_is_flown_under_a_given_law() -> None:
    scenario = load_scenario("aerosonde_forest").with_({"mission.time_limit_s": 10.0})
    run = fly(scenario, guidance=preview)
    assert run.scenario.guidance.kind.endswith(":preview")
    worst_m = run.metrics.cross_track_m.max
    assert worst_m is not None
    assert worst_m < 1.0


def test_what_a_law_raises_ends_the_flight_and_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.scenario.performance.card_of", lambda *_: None)
    scenario = load_scenario("aerosonde_forest").with_({"mission.altitude_m": 120.0})
    run = fly(scenario, guidance=Failing())
    assert run.outcome == Outcome.LOST_CONTROL.value
    assert "the guidance law raised RuntimeError: no idea" in run.reason
