"""Models that cannot be flown say why, in a process that goes on."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import jsbsim
import pytest

from aircraft.airframes import airframe
from aircraft.deviation import Deviation
from aircraft.jsbsim_loading import trimmed
from aircraft.model_files import OWN_FOLDER, TrimError, model_files
from tests.processes import python
from wayproof import InputError, load_scenario

RUDDER = r'      <aerosurface_scale name="rudder">.*?</aerosurface_scale>\n'
TANK = '<tank type="FUEL"><capacity unit="KG">2</capacity><contents unit="KG">1</contents></tank>'
BY_RUDDER = r"\s*<product><value>-?[0-9.]+</value><property>fcs/rudder-pos-rad</property></product>"


def aerosonde_with(folder: Path, change: tuple[str, str] = ("", ""), without: str = "") -> Path:
    """A folder with the aerosonde's model under another name, a pattern of its XML replaced, a file left out."""
    made = folder / "mine"
    shutil.copytree(OWN_FOLDER / "aerosonde", made)
    text = (made / "aerosonde.xml").read_text().replace('name="aerosonde"', 'name="mine"')
    (made / "aerosonde.xml").unlink()
    (made / "mine.xml").write_text(re.sub(*change, text, flags=re.DOTALL) if change[0] else text)
    if without:
        (made / without).unlink()
    return made


@pytest.mark.parametrize(
    ("change", "without", "said"),
    [
        (("", ""), "unpowered_engine.xml", "JSBSim refuses the model: Could not open file: unpowered_engine"),
        (("", ""), "motor.xml", "JSBSim refuses the model: Could not open file: motor"),
        (("<input>fcs/aileron-cmd-norm<", "<input>fcs/nothing<"), "", "property fcs/nothing does not exist"),
        (("<property>fcs/elevator-pos-rad<", "<property>fcs/nothing<"), "",
            "its functions read the property fcs/nothing, which does not exist"),
        (('KG">11.0<', 'KG">400.0<'), "", "cannot be trimmed .*: no throttle makes its thrust as large as its drag"),
        (('KG">11.0<(.*)</propulsion>', rf'KG">400.0<\1{TANK}</propulsion>'), "", "no throttle makes its thrust as"),
        (('M2">0.55<', 'M2">0.0<'), "", "cannot be trimmed .*: at no angle of attack it lifts its weight"),
        (("<input>fcs/pitch-trim-cmd-norm<", "<input>fcs/elevator-cmd-norm<"), "",
            "fcs/pitch-trim-cmd-norm, by which JSBSim trims, does not hold its pitch"),
        (("unpowered_thruster(.*)<force .*</force>", r"APC_18x8E\1"), "",
            "no throttle makes its thrust as large as its drag"),
    ],
)  # fmt: skip
def test_what_a_model_lacks_is_told(tmp_path: Path, change: tuple[str, str], without: str, said: str) -> None:
    with pytest.raises(InputError, match=f"aircraft.model: .*{said}"):
        load_scenario("paper_circles").with_({"aircraft.model": aerosonde_with(tmp_path, change, without)})


@pytest.mark.parametrize(
    ("file", "number", "said"),
    [("APC_18x8E.xml", "ixx", r"APC_18x8E.xml: has no ixx; must have one"),
     ("APC_18x8E.xml", "0.0822", r"APC_18x8E.xml: tableData has 'far'; must be a number"),
     ("APC_18x8E.xml", "1.269e-03", r"APC_18x8E.xml: ixx has 'far'; must be a number"),
     ("APC_18x8E.xml", "</propeller>", r"APC_18x8E.xml is not well-formed XML: .*line"),
     ("Zenoah_G-26A.xml", "2207.27", "JSBSim refuses the model: Expecting a numeric attribute value, but got: far")],
)  # fmt: skip
def test_a_number_of_an_engine_that_is_none_is_told(tmp_path: Path, file: str, number: str, said: str) -> None:
    made = aerosonde_with(tmp_path, ("unpowered_engine(.*)unpowered_thruster", r"Zenoah_G-26A\1APC_18x8E"))
    (made / file).write_text(Path(jsbsim.__path__[0], "engine", file).read_text().replace(number, "far"))
    with pytest.raises(InputError, match=said):
        load_scenario("paper_circles").with_({"aircraft.model": made})


def test_a_broken_file_of_a_system_is_named_where_it_lies(tmp_path: Path) -> None:
    made = aerosonde_with(tmp_path)
    (made / "motor.xml").write_text("<system>\n<channel")
    with pytest.raises(InputError, match=f"In file {made / 'motor.xml'}: line 2"):
        load_scenario("paper_circles").with_({"aircraft.model": str(made)})


def test_dry_tanks_are_not_why_an_aircraft_stalls(tmp_path: Path) -> None:
    cub = shutil.copytree(Path(jsbsim.__path__[0], "aircraft", "J3Cub"), tmp_path / "J3Cub")
    model = cub / "J3Cub.xml"
    model.write_text(re.sub("(<contents[^>]*>)[^<]*", r"\g<1>0", model.read_text()))
    with pytest.raises(TrimError, match="at no angle of attack it lifts its weight"):
        trimmed(model_files(str(cub)), 14.0)


@pytest.mark.flights
def test_an_engine_that_does_not_run_is_told() -> None:
    with pytest.raises(InputError, match=r"pa28 cannot be trimmed .*: none of its engines runs"):
        load_scenario("paper_circles").with_({"aircraft.model": "pa28"})


def apart(folder: Path, *sections: str) -> Path:
    """Moves sections of a folder's model into files of their own."""
    model = folder / f"{folder.name}.xml"
    for name in sections:
        if (found := re.search(f"<{name}.*?</{name}>", model.read_text(), re.DOTALL)) is not None:
            (folder / f"{name}.xml").write_text(found[0])
            model.write_text(model.read_text().replace(found[0], f'<{name} file="{name}"/>'))
    return folder


@pytest.mark.parametrize("negated", ["aero/alpha-rad|fcs/elevator-pos-rad", "aero/coefficient/[^<]*"])
def test_a_model_written_otherwise_has_the_same_days(tmp_path: Path, negated: str) -> None:
    """Sections in files of their own, and properties with a sign: masses, lift, effects of the controls, thrust."""
    day = Deviation(0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.01)
    twice = rf"<property>({negated})</property>", r"<difference><value>0</value><p>-\1</p></difference>"
    folder = apart(aerosonde_with(tmp_path, twice), "mass_balance", "propulsion", "aerodynamics")
    names = "aerosonde", str(folder)
    whole, found = (trimmed(replace(model_files(name), deviation=day), 25.0) for name in names)
    for each in ("inertia/weight-lbs", "aero/alpha-deg", "fcs/elevator-pos-rad", "fcs/throttle-cmd-norm"):
        assert found[each] == pytest.approx(whole[each], rel=1e-9)


@pytest.mark.parametrize("file", ["aerodynamics.xml", "unpowered_engine.xml"])
def test_a_missing_property_ends_with_status_2(tmp_path: Path, file: str) -> None:
    """JSBSim ends the process when it takes such a model down (SIGABRT, 134)."""
    folder = apart(aerosonde_with(tmp_path), "aerodynamics")
    reads = r'<function name="test/f"><property>fcs/nothing</property></function>\1'
    (folder / file).write_text(re.sub(r"(</\w+>\s*)$", reads, (folder / file).read_text()))
    told = python("-m", "wayproof", "envelope", str(folder))
    assert told.returncode == 2
    assert "read the property fcs/nothing" in " ".join(told.stderr.split())


@pytest.mark.flights
def test_an_aircraft_without_a_rudder_is_flown(tmp_path: Path) -> None:
    folder = aerosonde_with(tmp_path, (f"{RUDDER}|{BY_RUDDER}", ""))
    assert "rudder-pos" not in (folder / "mine.xml").read_text()
    frame = airframe(str(folder))
    low, high = frame.airspeed_range_mps
    assert low < 18.0 < 31.0 < high
    assert frame.gains.rudder_r == 0.0
