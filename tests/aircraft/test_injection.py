"""What is made of a model before JSBSim loads it."""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import aircraft
from aircraft.injection import with_autopilot

MODEL = Path(aircraft.__path__[0], "aerosonde", "aerosonde.xml")


def test_a_model_writes_no_files_of_its_own(tmp_path: Path) -> None:
    shutil.copytree(MODEL.parent, tmp_path / "aerosonde")
    model = tmp_path / "aerosonde" / MODEL.name
    told = (
        '<output name="left_behind.csv" type="CSV" rate="10"><property>attitude/phi-rad</property></output>'
    )
    model.write_text(model.read_text().replace("</fdm_config>", f"{told}</fdm_config>"))
    with with_autopilot(model) as folder:
        derived = ElementTree.parse(folder / "aerosonde" / MODEL.name).getroot()
    assert derived.find("output") is None
    # Those of the flight control components stay.
    assert derived.find(".//fcs_function/output") is not None
