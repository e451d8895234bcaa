"""Flights do not depend on what was flown before: a card in the cache belongs to all that it was measured with."""

import shutil
from pathlib import Path

import pytest

import wayproof
from aircraft import airframes, law_cards
from aircraft.model_files import model_files


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    _forget()


def _forget() -> None:
    airframes._airframe.cache_clear()
    law_cards._cards.clear()


def _digest(**changes: object) -> str:
    """Of a flight in a process that has only the cache of files to go by."""
    _forget()
    return wayproof.fly(wayproof.load_scenario("aerosonde_forest").with_(changes)).digest


@pytest.mark.flights
@pytest.mark.usefixtures("own_cache")
def test_a_copy_of_a_shipped_aircraft_that_is_flown_first_changes_nothing(tmp_path: Path) -> None:
    shipped = airframes.airframe("aerosonde").cruise_mps
    shutil.rmtree(tmp_path / "cache")
    copy = tmp_path / "my_plane"
    shutil.copytree(model_files("aerosonde").model.parent, copy)
    _forget()
    airframes.airframe(str(copy))
    _forget()
    assert not airframes.is_surveyed("aerosonde")
    assert airframes.airframe("aerosonde").cruise_mps == shipped


@pytest.mark.flights
@pytest.mark.usefixtures("own_cache")
def test_a_law_is_surveyed_with_the_autopilot_that_flies(tmp_path: Path) -> None:
    gentle = {"guidance.kind": "l1", "aircraft.autopilot.bank_limit_deg": 25}
    alone = _digest(**gentle)
    shutil.rmtree(tmp_path / "cache")
    _digest(**{"guidance.kind": "l1"})
    assert _digest(**gentle) == alone


@pytest.mark.flights
@pytest.mark.usefixtures("own_cache")
def test_a_model_that_is_edited_is_surveyed_anew(tmp_path: Path) -> None:
    copy = tmp_path / "aerosonde"
    shutil.copytree(model_files("aerosonde").model.parent, copy)
    before = airframes.airframe(str(copy)).mass_kg
    text = (copy / "aerosonde.xml").read_text()
    (copy / "aerosonde.xml").write_text(text.replace(">11.0</emptywt>", ">14.0</emptywt>"))
    assert airframes.airframe(str(copy)).mass_kg == pytest.approx(before + 3.0)
