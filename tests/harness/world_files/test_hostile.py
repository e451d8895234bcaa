"""World files that are broken, torn, huge or no world at all: one line each, and nothing flown or written."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.cli.app import main
from harness.world_files.kinds import read
from harness.world_files.parts import FileSpec
from tests.harness.run.given import written
from tests.harness.world_files import making
from tests.harness.world_files.making import SQUARE, feature, geojson, geotiff, npy, osm, zipped
from wayproof import InputError

BOMB = '<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "lol"><!ENTITY b "&a;&a;">]><osm>&b;</osm>'


def text(name: str, content: str | bytes) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
        return folder / name

    return make


def _torn_tiff(folder: Path) -> Path:
    path = geotiff(folder / "a.tif", np.ones((200, 200)), (0.0, 0.0), 10.0, 32632)
    path.write_bytes(path.read_bytes()[:5000])
    return path


RING = [(8.0, 47.0), (8.01, 47.0), (8.01, 47.01)]
GRID = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
HOSTILE: dict[str, tuple[Callable[[Path], Path], str]] = {
    "a folder": (lambda folder: folder, "is a folder, not a file; give the path of a file"),
    "empty": (text("a.tif", ""), "is empty"),
    "a picture": (text("a.png", b"\x89PNG\r\n\x1a\n" + bytes(50)), "is an image; give the YAML file"),
    "a program": (text("a.out", b"\x7fELF" + bytes(200)), "is of no kind that is known; give terrain"),
    "prose": (text("a.txt", "Once upon a time\n"), "is of no kind that is known"),
    "UTF-16": (text("a.txt", "AC R".encode("utf-16")), "is UTF-16; save it as UTF-8"),
    "a crs without its number": (text("a.json", '{"CityObjects": {}, "metadata": {"referenceSystem": "RD New"}}'),
        "has its crs as 'RD New', which is not read; give crs, as EPSG:N"),
    "the crs of an old CityJSON": (text("a.json", '{"CityObjects": {}, "metadata": {"crs": {"epsg": 28992}}}'),
        "has its crs as \"{'epsg': 28992}\", which is not read; give crs"),
    "torn JSON": (text("a.geojson", '{"type": "FeatureCollection", "features": [{"ty'), "is not whole JSON"),
    "deep JSON": (text("a.json", "[" * 100_000), "is nested too deeply"),
    "NaN": (text("a.json", '{"type": "Polygon",\n"coordinates": [[[NaN, 1]]]}'), "line 2: has the number NaN"),
    "a key twice": (text("a.json", '{"type": "Polygon",\n"type": "Feature"}'), "line 2: has the key 'type' twice in"),
    "no such shape": (text("a.json", '{"type": "Feature", "geometry": {"type": "x"}}'), "geometry.type: is 'x'; must"),
    "no features": (text("a.json", '{"type": "FeatureCollection", "features": []}'), "has no polygon"),
    "words for numbers": (
        lambda folder: geojson(folder / "a.json", feature({}, [["8.0", "47.0"], *SQUARE[1:]])),  # type: ignore[list-item]
        r"features\[0\].geometry.coordinates\[0\]\[0\]\[0\]: is '8.0'; must be a finite number without quotes"),
    "a ring of two": (lambda folder: geojson(folder / "a.json", feature({}, SQUARE[:2])), "has 2 places; a ring has"),
    "entities": (text("a.osm", BOMB), "cannot be read by osmium: XML entities are not supported"),
    "torn XML": (text("a.osm", "<osm><node id='1' lat='47'"), "cannot be read by osmium: Can not read file"),
    "a place that is no number": (text("a.osm", "<osm version='0.6'><node id='1' lat='47x' lon='8'/></osm>"),
        "cannot be read by osmium: characters after coordinate"),
    "no building": (lambda folder: osm(folder / "a.osm", [({"highway": "x"}, RING)]), "has no building"),
    "a ZIP bomb": (lambda folder: zipped(folder / "N46E009.hgt.zip", N46E009__hgt=bytes(64_000_000)),
        "cannot be read as a raster"),
    "a ZIP of something": (lambda folder: zipped(folder / "a.zip", readme__txt=b"hello"),
        "is a ZIP archive with 'readme.txt'"),
    "a torn tile": (text("N46E009.hgt", bytes(1000)), "it may be torn"),
    "a nameless tile": (text("tile.hgt", bytes(2 * 1201 * 1201)), "its name must say where it lies"),
    "a nameless ZIP": (lambda folder: zipped(folder / "a.zip", N46E009__hgt=b"\0"), "must say where it lies"),
    "a tile packed by gzip": (text("N46E009.hgt.gz", b"\x1f\x8b\0"), "is a packed file; unpack it"),
    "a sequence of cities": (text("a.city.jsonl", '{"CityObjects": {}}\n{"type": "CityJSONFeature"}'),
        "is a sequence of CityJSON features; make CityJSON of it"),
    "a torn TIFF": (_torn_tiff, "cannot be read"),
    "a torn grid": (text("a.asc", GRID + "1 2 3\n"), "it may be torn"),
    "a grid of 10^12 cells": (text("a.asc", GRID.replace("s 2", "s 1000000")), "cannot be read as a raster"),
    "a grid of nothing": (text("a.asc", GRID + "-9999 " * 4), "has no cell with a height"),
    "a height of None": (text("a.asc", GRID + "1 2\nNone 4\n"), "line 7: has something that is no number among its"),
    "half a corner": (text("a.asc", GRID.replace("yllcorner", "yllcenter") + "1 2 3 4\n"), "must have xllcorner and"),
    "cells below 0": (text("a.asc", GRID.replace("cellsize 1", "cellsize -1") + "1 2 3 4\n"), "is not above 0"),
    "a row too many": (text("a.map", "type octile\nheight 1\nwidth 2\nmap\n..\n@@@\n"), "in line 6, of 1 rows"),
    "half negated": (text("a.yaml", "image: a.pgm\nresolution: 1\nnegate: maybe\n"), "negate 'maybe'; must be one"),
    "no properties": (text("a.json", '{"type": "Feature", "properties": "x"}'), "properties: is 'x'; must be"),
    "a tag twice": (lambda folder: osm(folder / "a.osm", [({"building": "yes", "a": '1"/><tag k="a" v="2'}, RING)]),
        "has the tag 'a' twice; keep one"),
    "a node twice": (text("a.osm", "<osm><node id='1' lat='1' lon='2'/><node lon='3' lat='1' id='1'/>"), "1 twice"),
    "a pole": (lambda folder: osm(folder / "a.osm", [({"building": "yes"}, [*RING, (8.0, 95.0)])]), "at 95, 8; must"),
    "a mode": (text("a.kml", "<kml><Placemark><name>z</name><Polygon><altitudeMode>up</altitudeMode><outerBoundaryIs>"
        "<coordinates/></outerBoundaryIs></Polygon></Placemark></kml>"), "z: has the altitudeMode 'up'; must be"),
    "a fence of words": (text("a.txt", "47.0 8.0\n47.0 8.1\n47.1 8.1\n47.1 east\n"), "line 4: is 'east'; must be"),
    "a NumPy archive": (lambda folder: zipped(folder / "a.npz", elevation__npy=npy(np.array([1.0]))),
        "must have numbers `elevation`"),
    "a vector file": (text("a.gpkg", "SQLite"), "is a vector file; make GeoJSON of it"),
    "a Gazebo world": (text("a.world", "<sdf><world/></sdf>"), "is a Gazebo world; give its footprints as GeoJSON"),
    "a torn map": (text("a.map", "type octile\nheight 3\nwidth 3\nmap\n...\n..\n"), "line 6, of 3 rows"),
    "a map of a height of 5,000 digits": (text("a.map", f"type octile\nheight {'9' * 5000}\nwidth 3\nmap\n...\n"),
        "has no height, width and `map`"),
    "a radius in km": (text("a.txt", "AC R\nV X=47:00:00 N 008:00:00 E\nDC 2 km\n"), "line 3: has '2 km'; must be 1"),
    "a way round in words": (text("a.txt", "AC R\nV D=CCW\n"), r"line 2: has 'D=CCW'; must be D=\+ or D=-"),
    "an arc about nothing": (text("a.txt", "AC R\nDA 5,0,90\n"), "line 2: has an arc or circle before its centre"),
    "a place of words": (text("a.txt", "AC R\nDP here\n"), "line 2: has 'here'; must be a place"),
    "an airspace of nothing": (text("a.txt", "AC R\nAN x\n"), "has no airspace with an area"),
    "an empty fence": (text("a.plan", '{"fileType": "Plan", "geoFence": {}}'), "has an empty fence"),
    "a fence of a line": (text("fence.txt", "47.0 8.0\n47.0 8.0\n47.1 8.1\n47.0 8.0\n"), "fewer than three corners"),
    "a zone without a shape": (text("a.json", '{"UASZoneList": [{"geometry": [{}]}]}'), "without a horizontalPro"),
    "a circle without a radius": (text("a.json", '{"UASZoneList": [{"name": "Z", "geometry": [{"horizontalProjection":'
        '{"type": "Circle"}}]}]}'), "zone 'Z': has a circle without a radius"),
    "a circle in Sydney": (text("a.json", '{"UASZoneList": [{"geometry": [{"horizontalProjection": {"type": "Circle",'
        '"radius": 9, "center": [-33.8, 151.2]}}]}]}'), "has a place at 151.2, -33.8; must be degrees"),
}  # fmt: skip


@pytest.mark.parametrize(("make", "sentence"), HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_file_is_told_in_one_sentence(make: Callable[[Path], Path], sentence: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=sentence) as caught:
        making.scenario_with(make(tmp_path))
    assert "\n" not in str(caught.value)


def _scenario(folder: Path, file: str) -> Path:
    area = "{bounds_m: [0, 0, 9000, 9000], origin: {latitude_deg: 46.97, longitude_deg: 7.95}}"
    head = f"schema: wayproof/scenario/1\nname: s\narea: {area}\nobstacles:\n  - file: {file}\n"
    return written(folder / "s.yaml", head + "mission: {start_m: [1000, 1000], goal_m: [8000, 8000]}\n")


def test_the_command_and_the_scenario_say_it_with_status_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "a.geojson", tmp_path / "out.yaml"
    path.write_text("{")
    assert main(["world", str(path), "--altitude-m", "300", "--out", str(out)]) == 2
    assert not out.exists()
    assert f"{path}: line 1: is not whole JSON" in capsys.readouterr().err.splitlines()[-1]
    scenario = _scenario(tmp_path, "{path: a.geojson}")
    assert main(["validate", str(scenario)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{scenario}:5: obstacles[0].file: a.geojson line 1: is not whole JSON")


@pytest.mark.parametrize(
    ("key", "sentence"),
    [
        ("nodata: free", "is of the kind geojson; nodata is used by geotiff, ascii_grid, srtm, numpy_dem"),
        ("unknown: occupied", "is of the kind geojson; unknown is used by ros_map, moving_ai only"),
        ("metres_per_cell: 2", "has its place on earth, which metres_per_cell does not move"),
        ("shift_m: [0, 1]", "has its place on earth, which shift_m does not move"),
        ("ground_m: 3", None),
        ("crs: EPSG:4326", None),
    ],
)
def test_a_key_that_the_kind_of_a_file_does_not_use_is_refused_with_its_line(
    key: str, sentence: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    geojson(tmp_path / "a.geojson", feature({"building": "yes", "height": 400}))
    scenario = _scenario(tmp_path, f"\n      path: a.geojson\n      {key}")
    assert main(["validate", str(scenario)]) == (2 if sentence else 0)
    if sentence:
        name, said = key.partition(":")[0], capsys.readouterr().err
        assert said.startswith(f"{scenario}:7: obstacles[0].file.{name}: a.geojson {sentence}")


def test_a_pipe_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="is a pipe"):
        making.scenario_with(tmp_path / "pipe")


def test_a_numpy_archive_whose_crs_is_not_in_degrees_is_refused(tmp_path: Path) -> None:
    edges = {f"{n}__npy": npy(np.array(float(k))) for k, n in enumerate(("xmin", "xmax", "ymin", "ymax"))}
    path = zipped(tmp_path / "a.npz", elevation__npy=npy(np.ones((2, 2))), **edges)
    with pytest.raises(InputError, match=r"edges in degrees around it \(crs\)"):
        making.scenario_with(path, crs="EPSG:2263")


def test_a_self_crossing_ring_is_made_valid(tmp_path: Path) -> None:
    bow = [SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3], SQUARE[0]]
    spike = [*SQUARE[:2], (8.03, 46.99), *SQUARE[1:]]  # out of a corner and back
    contents = read(FileSpec(geojson(tmp_path / "a.json", feature({}, bow), feature({}, spike))))
    assert [p.footprint.area for p in contents.parts if p.footprint.is_valid] == pytest.approx([5e-5, 1e-4])
    assert contents.notes[1:] == ("of 1 polygon what has no area is passed over",)
