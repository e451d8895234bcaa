"""The envelope card: figures that are flown, kept, and hold for planning."""

import json
import math
import re
from pathlib import Path

import pytest

from aircraft import trials
from aircraft.airframes import airframe
from aircraft.envelope import performance
from harness.bench import envelope_card as module
from harness.bench.envelope_card import envelope_card, flown_turn, tightest
from harness.cli.app import main
from tests.refusals import refused
from wayproof import AircraftError


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "wayproof"


@pytest.mark.parametrize("bank_deg", [15.0, 30.0, 45.0])
def test_a_flown_turn_is_the_coordinated_turn(bank_deg: float) -> None:
    """R = V^2 / (g tan(bank)); a little less, since thrust has a part that points inwards."""
    turn = flown_turn(airframe("aerosonde"), 25.0, bank_deg)
    assert turn["radius_m"] == pytest.approx(25.0**2 / (9.80665 * math.tan(math.radians(bank_deg))), rel=0.03)
    # The greatest, which it has a moment after a step of the roll command.
    assert turn["load_factor"] == pytest.approx(1.0 / math.cos(math.radians(bank_deg)), rel=0.08)
    assert turn["altitude_lost_m"] is not None
    assert 0.0 <= turn["altitude_lost_m"] < 0.2


def test_a_turn_in_which_control_is_lost_has_no_radius() -> None:
    turn = flown_turn(airframe("c172p"), 26.0, 60.0)
    assert turn["radius_m"] is None
    assert turn["altitude_lost_m"] is not None


@pytest.mark.flights
@pytest.mark.parametrize("wind", [0.0, 7.5])
def test_planning_keeps_a_margin_over_the_tightest_path(wind: float) -> None:
    found = tightest(airframe("aerosonde"), 25.0, wind)
    at_the_limit = (25.0 + wind) ** 2 / (9.80665 * math.tan(math.radians(45.0)))
    assert found["planned_radius_m"] == performance(airframe("aerosonde"), 25.0, wind).turn_radius_m
    assert found["tightest_radius_m"] is not None
    assert found["planned_radius_m"] is not None
    assert at_the_limit < found["tightest_radius_m"] < 0.95 * found["planned_radius_m"]


def test_where_not_even_the_plan_is_tracked_there_is_no_tightest(monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(*_: object) -> None:
        raise ArithmeticError("control is lost")

    monkeypatch.setattr(module, "fly_course", lost)
    assert tightest(airframe("aerosonde"), 25.0, 0.0)["tightest_radius_m"] is None


@pytest.mark.flights
def test_the_command_prints_the_card_and_measures_once(
    cache: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["envelope", "aerosonde", "--wind", "5", "--json"]) == 0
    card = json.loads(capsys.readouterr().out)
    assert card["airspeed_range_mps"] == list(airframe("aerosonde").airspeed_range_mps)
    (page,) = card["at"]
    assert page["roll_in_s"] == airframe("aerosonde").roll_in_s
    assert [each["wind_mps"] for each in page["tracked"]] == [0.0, 5.0]
    radii = [turn["radius_m"] for turn in page["turns"]]
    assert radii == sorted(radii, reverse=True)

    (file,) = cache.glob("aerosonde-envelope-*.json")
    with monkeypatch.context() as patch:
        patch.setattr(trials, "in_flight", None)
        assert envelope_card("aerosonde", winds_mps=[5.0]) == card
    file.write_text("wreck", "utf-8")
    assert envelope_card("aerosonde", winds_mps=[5.0]) == card


@pytest.mark.flights
def test_the_table_fits_and_names_the_figures(cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["envelope", "aerosonde", "--airspeed-mps", "20", "--wind", "0"]) == 0
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= 80
    for text in ("11 kg", "turns at 20 m/s", "airspeed lost m/s", "tightest radius m"):
        assert text in shown
    (level,) = re.findall(r"level flight +([\d.]+) to ([\d.]+) m/s", shown)
    # 17.3 to 32.4 m/s by an independent trim of the same published figures.
    assert [float(speed) for speed in level] == pytest.approx([17.3, 32.4], abs=0.3)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["kite"], "unknown aircraft 'kite'"),
        (["aerosonde", "--airspeed-mps", "90"], "aerosonde cannot hold 90 m/s"),
        (["aerosonde", "--airspeed-mps", "-1"], "-1 is not a speed"),
        (["aerosonde", "--wind", "nan"], "nan is not a speed"),
        (["aerosonde", "--wind", "30"], "cannot make way against a wind of 30 m/s"),
    ],
)
def test_what_cannot_be_measured_is_refused(arguments: list[str], said: str, cache: Path) -> None:
    assert said in refused("envelope", *arguments)
    assert not list(cache.glob("*-envelope-*"))


def test_a_speed_at_which_it_cannot_turn_is_refused() -> None:
    with pytest.raises(AircraftError, match="cannot hold 17 m/s"):
        envelope_card("aerosonde", [17.0])
