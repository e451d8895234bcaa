"""What flying a model tells of it, and models that cannot be flown."""

import math
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

import aircraft
import aircraft.survey
from aircraft.airframe import AirframeEntry
from aircraft.airframes import AircraftError, aircraft_names, airframe, surface_travels
from aircraft.autopilot import gains
from aircraft.jsbsim_loading import linearised, mass_kg, trimmed
from aircraft.model_files import model_files
from aircraft.survey import survey
from aircraft.trials import in_flight, not_held, weaving_error_m
from tests.longer import longer

AEROSONDE = Path(aircraft.__path__[0], "aerosonde")


def test_the_aerosonde_is_what_its_book_says() -> None:
    """Beard and McLain: 11 kg; level flight from 17.3 to 32.4 m/s, of which some is needed for control."""
    frame = airframe("aerosonde")
    low, high = frame.airspeed_range_mps
    assert frame.mass_kg == 11.0
    assert 17.3 <= low <= 18.0
    assert 31.5 <= high <= 32.4
    # A quarter of 1.4 |Lp|, the book's Lp being -22.6 1/s; 27 of 30 degrees take 2.3 time constants.
    assert frame.roll_lag_s == pytest.approx(4.0 / (1.4 * 22.6), rel=0.1)
    assert frame.roll_in_s == pytest.approx(2.3 * frame.roll_lag_s + frame.roll_delay_s, abs=0.05)
    assert frame.level_bank_deg(25.0) == frame.bank_limit_deg == 45.0


@pytest.mark.flights
def test_an_aircraft_that_slips_in_turns_banks_for_it() -> None:
    """The F-16's yaw damper makes it slip by a degree, and the side force takes a tenth of its turn rate."""
    frame = airframe("f16")
    assert 0.85 < frame.turn_rate_share < 0.95
    assert frame.guidance_limits().turn_rate_share == frame.turn_rate_share
    assert frame.weave_error_m < 4.0
    assert weaving_error_m(replace(frame, turn_rate_share=1.0), frame.cruise_mps) > 1.3 * frame.weave_error_m


def test_an_aircraft_that_hardly_turns_when_it_banks_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aircraft.survey, "turn_rate_share", lambda frame, speed: 0.4)
    files = model_files("aerosonde")
    with pytest.raises(AircraftError, match=r"cannot be held at 25 m/s: it turns at 0\.4 of the rate of a coordinated"):
        survey(AirframeEntry(files.name, "", 25.0), files)


def test_a_speed_at_the_edge_is_held_and_one_beyond_is_not() -> None:
    frame = airframe("aerosonde")
    low, high = frame.airspeed_range_mps
    assert not_held(frame, low) is None
    assert not_held(frame, high) is None
    assert "cannot hold" in (not_held(frame, 0.96 * low) or "")


def own_model(folder: Path, name: str, *changes: tuple[str, str]) -> Path:
    home = folder / name
    shutil.copytree(AEROSONDE, home)
    text = (home / "aerosonde.xml").read_text("utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (home / "aerosonde.xml").unlink()
    (home / f"{name}.xml").write_text(text, "utf-8")
    return home


def test_a_folder_with_a_model_is_an_aircraft(tmp_path: Path) -> None:
    frame = airframe(str(own_model(tmp_path, "mine")))
    known = airframe("aerosonde")
    assert (frame.name, frame.verified) == ("mine", False)
    assert frame.mass_kg == known.mass_kg
    assert frame.airspeed_range_mps == pytest.approx(known.airspeed_range_mps, rel=0.03)
    assert frame.airspeed_range_mps[0] < frame.cruise_mps < frame.airspeed_range_mps[1]
    in_flight(frame, frame.cruise_mps).advance(10)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("L17", "L17: the model cannot be started: .*fcs/flaps"),
        *longer(
            [
                ("SGS", "SGS cannot be trimmed for level flight at any speed from 8 to 300 m/s"),
                ("XB-70", "XB-70 cannot be held at .* m/s: "),
            ]
        ),
    ],
)
def test_a_model_that_cannot_be_flown_says_why(name: str, message: str) -> None:
    with pytest.raises(AircraftError, match=message):
        airframe(name)


def test_a_model_that_loses_control_says_how(tmp_path: Path) -> None:
    """Its centre of gravity far aft, it is unstable in pitch."""
    home = own_model(tmp_path, "tail_heavy", ("-2.74", "2.74"))
    with pytest.raises(AircraftError, match="tail_heavy cannot be held at 25 m/s: unstable in pitch"):
        survey(AirframeEntry("tail_heavy", "", 25.0), model_files(str(home)))


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({}, "holds no JSBSim model; must hold odd.xml"),
        ({"a.xml": "<fdm_config/>", "b.xml": "<fdm_config/>"}, "holds 2 JSBSim models"),
        ({"a.xml": "<other/>", "b.xml": "not XML"}, "holds no JSBSim model"),
        ({"odd.xml": "<fdm_config>"}, "odd: the model cannot be loaded: .* is not well-formed XML"),
    ],
)
def test_a_folder_of_no_sound_model_is_refused(tmp_path: Path, files: dict[str, str], message: str) -> None:
    (home := tmp_path / "odd").mkdir()
    for name, text in files.items():
        (home / name).write_text(text, "utf-8")
    with pytest.raises(AircraftError, match=message):
        airframe(str(home))


@pytest.mark.parametrize("name", ["engine.xml", "notes.txt"])
def test_a_file_link_that_leads_out_of_the_folder_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "secret").write_text("<electric_engine/>")
    home = own_model(tmp_path, "mine")
    (home / name).symlink_to(tmp_path / "secret")
    with pytest.raises(AircraftError, match=rf"{name}: is a link that leads out of the folder; must be a file"):
        airframe(str(home))
    (home / name).unlink()
    (home / name).symlink_to("inner.txt")
    (home / "inner.txt").write_text("")
    assert model_files(str(home)).name == "mine", "a link to a file beside it is one of the folder's own"
    (home / "inner.txt").unlink()
    assert surface_travels(model_files(str(home)))["rudder"], "of an editor, a link to nothing"


@pytest.mark.parametrize("names", [("mesh.ac",), ("a.png", "sub/b.png")])
def test_a_folder_of_too_many_bytes_is_refused_before_they_are_read(tmp_path: Path, names: tuple[str, ...]) -> None:
    """The files are sparse: they need no room, but reading them would take minutes and gigabytes."""
    home = own_model(tmp_path, "mine")
    for name in names:
        (home / name).parent.mkdir(exist_ok=True)
        with (home / name).open("wb") as file:
            file.truncate(2**32 if len(names) == 1 else 150_000_000)
    with pytest.raises(AircraftError, match=r" MB; must be at most 200 MB together"):
        airframe(str(home))


def test_the_digest_changes_with_every_file_of_the_model_and_engines_beside_it(tmp_path: Path) -> None:
    home, beside = own_model(tmp_path, "mine"), tmp_path / "engine" / "motor.xml"
    beside.parent.mkdir()
    beside.write_text("<electric_engine/>")
    files = replace(model_files(str(home)), engines=((beside.name, beside),))
    digests = [files.digest(), files.digest()]
    for path, text in ((beside, "<electric_engine />"), (home / "motor.xml", "<system/>"), (home / "more.xml", "")):
        path.write_text(text, "utf-8")
        digests.append(files.digest())
    assert len(set(digests)) == 4


def test_each_engine_and_propeller_beside_a_model_goes_before_one_of_jsbsim(tmp_path: Path) -> None:
    """The propeller stays JSBSim's. An engine of half the displacement needs more air for the same power."""
    wheel = model_files("c172p").model.parents[2]
    home = Path(shutil.copytree(wheel / "aircraft" / "c172p", tmp_path / "c172p"))
    engine = wheel / "engine" / "eng_io320.xml"
    (home / engine.name).write_text(engine.read_text().replace("320.0", "160.0"))
    usual, small = (trimmed(model_files(name), 40.0) for name in ("c172p", str(home)))
    assert small["propulsion/engine/power-hp"] == pytest.approx(usual["propulsion/engine/power-hp"], rel=0.01)
    assert small["propulsion/engine/map-inhg"] > 1.3 * usual["propulsion/engine/map-inhg"]


@pytest.mark.flights
def test_loops_are_as_fast_as_the_weave_allows() -> None:
    """The T-37's control laws take phase: at full pace its roll swings."""
    aerosonde, tweet = airframe("aerosonde"), airframe("T37")
    assert tweet.guidance_bandwidth_radps == pytest.approx(0.36 * tweet.gains.roll)
    # Half a second more of delay: atan(1.8 x) / x of it all, with x = sqrt(1.62 + sqrt(3.6244)) of the damping 0.9.
    late_s, x = 0.5 + aerosonde.roll_delay_s + 0.05, math.sqrt(1.62 + math.sqrt(3.6244))
    assert aerosonde.guidance_bandwidth_radps == pytest.approx(math.atan(1.8 * x) / x / late_s, rel=0.01)
    assert weaving_error_m(aerosonde, 25.0) == pytest.approx(aerosonde.weave_error_m, rel=0.01)
    assert tweet.gains.roll == pytest.approx(0.7 * 2.5)
    at = linearised(trimmed(tweet.files, tweet.cruise_mps))
    swinging = replace(tweet, gains=gains(at), roll_lag_s=0.4, guidance_bandwidth_radps=0.9)
    assert weaving_error_m(swinging, tweet.cruise_mps) > 1.5 * tweet.weave_error_m


def test_no_fuel_is_burnt() -> None:
    model = in_flight(airframe("c172p"), 50.0)
    before = mass_kg(model._fdm)
    model.advance(60 * 300)
    assert mass_kg(model._fdm) == pytest.approx(before, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", aircraft_names())
def test_everything_in_the_table_is_held_at_cruise(name: str) -> None:
    frame = airframe(name)
    assert not_held(frame, frame.cruise_mps) is None
    assert frame.level_bank_deg(frame.cruise_mps) >= 20.0
    low, high = frame.airspeed_range_mps
    assert 1.15 * low < frame.cruise_mps < high


def test_a_trim_is_sought_short_of_the_stall(tmp_path: Path) -> None:
    assert trimmed(model_files("737"), 88.0)["aero/alpha-deg"] < 13.0
    wide = Path(shutil.copytree(AEROSONDE.parent / "x8", tmp_path / "x8"), "x8.xml")
    wide.write_text(wide.read_text().replace("<max>0.24<", "<max>0.35<"))
    assert trimmed(model_files(str(wide.parent)), 14.0)["aero/alpha-deg"] == pytest.approx(4.31, abs=0.02)
