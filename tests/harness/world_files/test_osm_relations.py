"""Relations of OpenStreetMap that are buildings, in all three forms of its files."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import shapely

from harness.world_files.kinds import read
from harness.world_files.parts import Contents, Reading


def read_any(path: Path) -> Contents:
    return read(path, None, Reading())


def osm_building(folder: Path, form: str, members: str, ways: dict[int, str], relation_tags: str) -> Path:
    """Squares of 0.001 degrees in a row, one a way, and a relation of `type=building` over them."""
    body, number = "", 100
    lines = ""
    for way, (identity, tags) in enumerate(ways.items()):
        refs = [number + k for k in (0, 1, 2, 3, 0)]
        for k, (x, y) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
            body += (
                f'<node id="{number + k}" version="1" lon="{8 + (2 * way + x) / 1e3}" lat="{47 + y / 1e3}"/>'
            )
        nds = "".join(f'<nd ref="{ref}"/>' for ref in refs)
        lines += f'<way id="{identity}" version="1">{nds}{tags}</way>'
        number += 4
    path = folder / "a.osm"
    path.write_text(
        f'<osm version="0.6">{body}{lines}<relation id="9" version="1">{members}{relation_tags}</relation></osm>'
    )
    return as_form(path, form)


def as_form(path: Path, form: str) -> Path:
    """An OpenStreetMap XML file in another form."""
    other = path.with_name(f"{path.stem}.{form}")
    if form == "osm.pbf":
        osmium = pytest.importorskip("osmium")
        with osmium.SimpleWriter(str(other), overwrite=True) as writer:
            for each in osmium.FileProcessor(str(path)):
                writer.add(each)
    if form == "json":
        other.write_text(json.dumps({"elements": overpass_of(path)}))
    return other


def overpass_of(path: Path) -> list[dict[str, Any]]:
    """The elements of an OpenStreetMap XML file as Overpass has them in JSON."""
    elements: list[dict[str, Any]] = []
    for each in ElementTree.parse(path).getroot():
        found: dict[str, Any] = {"type": each.tag, "id": int(each.attrib["id"])}
        found["tags"] = {tag.attrib["k"]: tag.attrib["v"] for tag in each.iter("tag")}
        if each.tag == "node":
            found |= {"lat": float(each.attrib["lat"]), "lon": float(each.attrib["lon"])}
        elif each.tag == "way":
            found["nodes"] = [int(nd.attrib["ref"]) for nd in each.iter("nd")]
        else:
            found["members"] = [
                {"type": m.attrib["type"], "ref": int(m.attrib["ref"]), "role": m.attrib["role"]}
                for m in each.iter("member")
            ]
        elements.append(found)
    return elements


TYPE_BUILDING = '<tag k="type" v="building"/>'


@pytest.mark.parametrize("form", ["osm", "json", "osm.pbf"])
def test_outlines_and_parts_without_tags_are_those_of_their_building(form: str, tmp_path: Path) -> None:
    """https://wiki.openstreetmap.org/wiki/Relation:building; ways 1 and 3 have no building's tags."""
    members = "".join(
        f'<member type="{kind}" ref="{ref}" role="{role}"/>'
        for kind, ref, role in (
            ("way", 1, "outline"),
            ("way", 2, "part"),
            ("way", 3, "part"),
            ("way", 4, "outline"),
            ("node", 100, "entrance"),
        )
    )
    ways = {
        1: '<tag k="name" v="hall"/>',
        2: '<tag k="building:part" v="yes"/><tag k="height" v="30"/>',
        3: '<tag k="building:levels" v="9"/>',
    }
    path = osm_building(tmp_path, form, members, ways, f'{TYPE_BUILDING}<tag k="building:levels" v="4"/>')
    found = read_any(path)
    tops = {round((part.footprint.centroid.x - 8) * 1e3 - 0.5) / 2: part.top.height_m for part in found.parts}
    assert tops == {0: 12.0, 1: 30.0, 2: 27.0}
    assert [part.footprint.area for part in found.parts] == pytest.approx([1e-6] * 3)


@pytest.mark.parametrize("form", ["osm", "json", "osm.pbf"])
def test_an_outline_that_is_a_building_itself_is_taken_once(form: str, tmp_path: Path) -> None:
    ways = {1: '<tag k="building" v="yes"/><tag k="height" v="20"/>'}
    member = '<member type="way" ref="1" role="outline"/>'
    path = osm_building(tmp_path, form, member, ways, f'{TYPE_BUILDING}<tag k="height" v="99"/>')
    assert [part.top.height_m for part in read_any(path).parts] == [20.0]
    path = osm_building(tmp_path, form, member, {1: ""}, f'{TYPE_BUILDING}<tag k="height" v="99"/>')
    assert [part.top.height_m for part in read_any(path).parts] == [99.0]


@pytest.mark.parametrize("form", ["osm", "json", "osm.pbf"])
def test_an_outline_that_is_a_multipolygon_without_tags_has_its_courtyard(form: str, tmp_path: Path) -> None:
    path = osm_building(
        tmp_path, "osm", '<member type="relation" ref="10" role="outline"/>', {1: "", 2: ""}, TYPE_BUILDING
    )
    inside = "".join(
        f'<member type="way" ref="{ref}" role="{role}"/>' for ref, role in ((1, "outer"), (2, "inner"))
    )
    other = f'<relation id="10" version="1">{inside}<tag k="type" v="multipolygon"/></relation>'
    site = '<relation id="11" version="1"><tag k="type" v="site"/><tag k="building" v="yes"/></relation>'
    text = path.read_text().replace("</osm>", f"{other}{site}</osm>")
    # The second way is moved into the first.
    for k, (x, y) in enumerate(((0.2, 0.2), (0.8, 0.2), (0.8, 0.8), (0.2, 0.8))):
        text = re.sub(
            rf'(<node id="{104 + k}" version="1") [^/]*/',
            rf'\1 lon="{8 + x / 1e3}" lat="{47 + y / 1e3}"/',
            text,
        )
    path.write_text(text)
    found = read_any(as_form(path, form))
    (part,) = found.parts
    assert part.footprint.area == pytest.approx(0.64e-6, rel=1e-5)
    assert "1 relation of buildings that is no area passed over (type site)" in found.notes


@pytest.mark.parametrize("form", ["osm", "json", "osm.pbf"])
def test_ways_with_a_height_that_are_no_building_are_counted(form: str, tmp_path: Path) -> None:
    """A mast as an area, a crane, a wall: they stand there, and nobody said that they are solid."""
    ways = {
        1: '<tag k="building" v="yes"/><tag k="height" v="9"/>',
        2: '<tag k="power" v="tower"/><tag k="height" v="60"/>',
        3: '<tag k="barrier" v="wall"/><tag k="height" v="3 m"/>',
        4: '<tag k="highway" v="service"/><tag k="maxheight" v="4"/>',
    }
    path = osm_building(tmp_path, form, "", ways, '<tag k="type" v="route"/>')
    found = read_any(path)
    assert [part.name for part in found.parts] == ["way 1"]
    assert found.notes == ("2 ways with a height that are no building passed over, the highest 60 m",)


@pytest.mark.parametrize("form", ["osm", "json", "osm.pbf"])
def test_relations_with_a_height_that_are_no_building_are_counted(form: str, tmp_path: Path) -> None:
    """A bridge, or a tower that nobody calls one; a tower that is called one is taken, as a way is."""
    ways = {1: '<tag k="building" v="yes"/><tag k="height" v="9"/>', 2: "", 3: ""}
    bridge = '<tag k="type" v="multipolygon"/><tag k="man_made" v="bridge"/><tag k="height" v="~40"/>'
    path = osm_building(tmp_path, "osm", '<member type="way" ref="2" role="outer"/>', ways, bridge)
    member = '<member type="way" ref="3" role="outer"/><tag k="type" v="multipolygon"/>'
    pylon = '<relation id="10" version="1"><tag k="type" v="site"/><tag k="height" v="60\'"/></relation>'
    tower = f'<relation id="11" version="1">{member}<tag k="man_made" v="tower"/><tag k="height" v="50"/></relation>'
    path.write_text(path.read_text().replace("</osm>", f"{pylon}{tower}</osm>"))
    found = read_any(as_form(path, form))
    assert {part.name: part.top.height_m for part in found.parts} == {"way 1": 9.0, "relation 11": 50.0}
    assert found.notes == ("2 relations with a height that are no building passed over, the highest 40 m",)


@pytest.mark.parametrize("form", ["osm", "json", "osm.pbf"])
def test_a_relation_that_is_an_outline_of_a_building_is_not_counted_beside_it(
    form: str, tmp_path: Path
) -> None:
    member = '<member type="relation" ref="10" role="outline"/>'
    path = osm_building(tmp_path, "osm", member, {1: ""}, TYPE_BUILDING)
    outline = (
        '<member type="way" ref="1" role="outer"/><tag k="type" v="multipolygon"/><tag k="height" v="30"/>'
    )
    path.write_text(
        path.read_text().replace("</osm>", f'<relation id="10" version="1">{outline}</relation></osm>')
    )
    found = read_any(as_form(path, form))
    assert ([part.top.height_m for part in found.parts], found.notes) == ([30.0], ())


def test_buildings_of_several_ways_are_made_all_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One by one, 100,000 of them took twice as long as 100,000 buildings of one way."""
    path = osm_building(tmp_path, "osm", "", dict.fromkeys(range(1, 41), ""), '<tag k="type" v="route"/>')
    tags = '<tag k="type" v="multipolygon"/><tag k="building" v="yes"/><tag k="height" v="9"/>'
    more = "".join(
        f'<relation id="{100 + k}" version="1"><member type="way" ref="{k}" role="outer"/>{tags}</relation>'
        for k in range(1, 41)
    )
    path.write_text(path.read_text().replace("</osm>", f"{more}</osm>"))
    calls: list[int] = []
    make_valid = shapely.make_valid

    def counted(shapes: Any, **options: Any) -> Any:
        calls.append(1)
        return make_valid(shapes, **options)

    monkeypatch.setattr(shapely, "make_valid", counted)
    parts = read_any(path).parts
    assert [part.footprint.area for part in parts] == [pytest.approx(1e-6)] * 40
    assert len(calls) < 5


@pytest.mark.parametrize("form", ["osm", "json", "osm.pbf"])
def test_points_with_a_height_that_are_no_building_are_counted(form: str, tmp_path: Path) -> None:
    """A crane, a flagpole: as a way they were counted, as a point they were not."""
    ways = {1: '<tag k="building" v="yes"/><tag k="height" v="9"/>', 2: '<tag k="height" v="3"/>'}
    path = osm_building(tmp_path, "osm", "", ways, '<tag k="type" v="route"/>')
    nodes = "".join(
        f'<node id="{number}" version="1" lon="8" lat="47"><tag k="man_made" v="{kind}"/>{tag}</node>'
        for number, kind, tag in (
            (1, "crane", '<tag k="height" v="~80 m"/>'),
            (2, "flagpole", '<tag k="height" v="12"/>'),
            (3, "flagpole", ""),
            (4, "mast", '<tag k="height" v="70"/>'),
        )
    )
    path.write_text(path.read_text().replace('<osm version="0.6">', f'<osm version="0.6">{nodes}'))
    notes = read_any(as_form(path, form)).notes
    (high,) = [note for note in notes if "with a height that are no building" in note]
    assert {*high.split(" with ")[0].split(" and ")} == {"2 points", "1 way"}
    assert high.endswith("passed over, the highest 80 m")
    assert any(note.startswith("1 point for towers, masts or buildings") for note in notes)
