"""Cards of guidance laws, and what planning makes of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

import pytest

from aircraft import law_cards
from aircraft.airframes import airframe
from aircraft.envelope import LawCard, WindPoint, performance
from aircraft.guidance.interface import GuidanceLimits, GuidanceOutput
from aircraft.guidance.progress import RouteProgress
from aircraft.guidance.registry import GuidanceKind
from aircraft.interface import AircraftState, Route
from aircraft.model_files import AircraftError
from harness.scenario.kinds import guidance_kinds
from tests.longer import longer

AEROSONDE = airframe("aerosonde")


@pytest.fixture(autouse=True)
def _own_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(law_cards, "_cards", {})


@pytest.fixture
def _calm_only(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(law_cards, "WIND_SHARES", (0.0,))


@dataclass(frozen=True)
class NoKeys:
    def resolved(self, limits: GuidanceLimits) -> NoKeys:
        return self


class Straight:
    def __init__(self, config: Any, limits: GuidanceLimits) -> None:
        self.lock = Lock()  # cannot be copied

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        self.progress = RouteProgress(route, arc_length_m)

    def update(self, state: AircraftState) -> GuidanceOutput:
        point = self.progress.nearest(state.east_m, state.north_m)
        return GuidanceOutput(0.0, point.cross_track_m, point.arc_length_m, False, past_end=True)  # it is not


@pytest.mark.usefixtures("_calm_only")
def test_preview_at_its_defaults_has_the_card_of_the_survey() -> None:
    preview = guidance_kinds()["preview"]
    assert law_cards.law_card(AEROSONDE, preview, preview.config()) is None
    slow = law_cards.law_card(AEROSONDE, preview, preview.config(bandwidth_radps=0.7))
    assert slow is not None
    assert slow.points[0].error_m > AEROSONDE.weave_error_m


@pytest.mark.parametrize("kind", ["pure_pursuit", *longer(["npfg", "l1", "vector_field"])])
def test_laws_that_autopilots_fly_track_and_their_error_is_kept_from_obstacles(kind: str) -> None:
    law = guidance_kinds()[kind]
    card = law_cards.law_card(AEROSONDE, law, law.config())
    assert card is not None
    assert [point.wind_share for point in card.points] == [0.0, 0.3, 0.6]
    for wind_mps in (0.0, 7.5):
        usual = performance(AEROSONDE, 25.0, wind_mps)
        planned = performance(AEROSONDE, 25.0, wind_mps, law=card)
        assert planned.turn_radius_m >= usual.turn_radius_m
        _, error_m = card.at(wind_mps / 25.0)
        assert 0.5 < error_m < 0.1 * planned.turn_radius_m
        assert planned.tracking_error_m > usual.tracking_error_m + error_m


def test_between_winds_a_card_is_linear_and_beyond_them_its_error_grows() -> None:
    card = LawCard("mine", (WindPoint(0.0, 1.0, 2.0), WindPoint(0.3, 1.25, 4.0), WindPoint(0.6, 1.25, 4.0)))
    assert card.at(0.15) == (1.125, 3.0)
    assert card.at(0.6) == (1.25, 4.0)
    assert card.at(0.9) == (1.25, 8.0)
    wide = performance(AEROSONDE, 25.0, 7.5, law=card)
    assert wide.turn_radius_m == pytest.approx(1.25 * performance(AEROSONDE, 25.0, 7.5).turn_radius_m)


@pytest.mark.flights
@pytest.mark.usefixtures("_calm_only")
def test_a_slow_law_gets_wider_turns() -> None:
    l1 = guidance_kinds()["l1"]
    usual, slow = (law_cards.law_card(AEROSONDE, l1, l1.config(period_s=period)) for period in (17.0, 60.0))
    assert usual is not None
    assert slow is not None
    assert slow.points[0].radius_factor > usual.points[0].radius_factor


@pytest.mark.flights
@pytest.mark.usefixtures("_calm_only")
def test_a_law_that_does_not_track_is_refused() -> None:
    kind = GuidanceKind("straight", "never turns at all", NoKeys, Straight)
    with pytest.raises(AircraftError, match="the guidance law straight does not track with aerosonde: on turns"):
        law_cards.law_card(AEROSONDE, kind, NoKeys())


@pytest.mark.usefixtures("_calm_only")
def test_a_card_is_kept_and_one_of_wrong_content_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kind = guidance_kinds()["pure_pursuit"]
    card = law_cards.law_card(AEROSONDE, kind, kind.config())
    (file,) = (tmp_path / "wayproof").glob("*law*.json")
    monkeypatch.setattr(law_cards, "_cards", {})
    with monkeypatch.context() as patched:
        patched.setattr(law_cards, "weave", None)  # nothing is flown
        assert law_cards.law_card(AEROSONDE, kind, kind.config()) == card
    file.write_text(file.read_text().replace('"error_m": ', '"error_m": -'))
    monkeypatch.setattr(law_cards, "_cards", {})
    assert law_cards.law_card(AEROSONDE, kind, kind.config()) == card
