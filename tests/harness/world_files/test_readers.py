"""Every kind of world file: what is read of it, and that its kind is told from what stands in it."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.world_files.kinds import kind_of, read
from harness.world_files.parts import FOOT_M, NO_BOTTOM, NO_TOP, Datum, FileSpec, Limit
from harness.world_files.plane import Mapping, Place
from harness.world_files.readers.limits import limit_of
from tests.harness.run.given import written
from tests.harness.world_files.making import SQUARE, feature, geojson, osm, read_any, scenario_with, zipped
from wayproof import InputError


def test_an_ascii_grid_has_rows_from_the_north(tmp_path: Path) -> None:
    head = "ncols 3\nnrows 2\nxllcorner 100\nyllcorner 200\ncellsize 10\nNODATA_value -9999\n"
    path = written(tmp_path / "a.asc", f"{head}1 2 3\n4 -9999 6\n")
    found = read_any(path)
    assert found.kind == "ascii_grid"
    assert found.terrain is not None
    x, y = found.terrain.places(np.array([0.0]), np.array([0.0]))
    assert (x[0], y[0]) == (100.0, 220.0)
    assert found.terrain.values[1, 0] == 4.0
    assert np.isnan(found.terrain.values[1, 1])
    text = path.read_text().replace("200\ncellsize 10", "20\ncellsize 0.01")
    assert "taken as degrees" in read_any(written(tmp_path / "b.asc", text)).notes[0]
    text = path.read_text().replace("-9999", "nan", 1).replace("-9999", "NaN")
    void = read_any(written(tmp_path / "c.asc", text))
    np.testing.assert_array_equal(getattr(void.terrain, "values", None), found.terrain.values)
    scaled = read_any(path, metres_per_cell=50.0).terrain
    assert scaled is not None
    assert scaled.affine == (50.0, 0.0, 500.0, 0.0, -50.0, 1100.0)


@pytest.mark.parametrize("packed", ["plain", "zip"])
def test_an_srtm_tile_lies_where_its_name_says(packed: str, tmp_path: Path) -> None:
    tile = np.full((1201, 1201), 7, dtype=">i2")
    tile[0, 0], tile[-1, -1] = 100, -32768
    data = tile.tobytes()
    path = tmp_path / {"plain": "S36E149.hgt", "zip": "S36E149.SRTMGL3.hgt.zip"}[packed]
    if packed == "zip":
        zipped(path, S36E149__hgt=data)
    else:
        path.write_bytes(data)
    found = read_any(path)
    assert found.kind == "srtm"
    assert found.terrain is not None
    x, y = found.terrain.places(np.array([0.5, 1200.5]), np.array([0.5, 1200.5]))
    assert (x.tolist(), y.tolist()) == (pytest.approx([149.0, 150.0]), pytest.approx([-35.0, -36.0]))
    assert found.terrain.values[0, 0] == 100.0
    assert np.isnan(found.terrain.values[-1, -1])


GX = 'xmlns:gx="http://www.google.com/kml/ext/2.2"'
RING = [(8.0, 47.0), (8.001, 47.0), (8.001, 47.001), (8.0, 47.001)]


@pytest.mark.parametrize(
    ("tags", "bottom_m", "top_m"),
    [
        ({"building": "yes", "height": "12.5"}, -math.inf, 12.5),
        ({"building": "yes", "height": "40 ft"}, -math.inf, 40 * FOOT_M),
        ({"building": "yes", "height": "6'6''"}, -math.inf, 6.5 * FOOT_M),
        ({"building": "yes", "height": "12,5 m"}, -math.inf, 12.5),
        ({"building": "yes", "height": "0.3 km"}, -math.inf, 300.0),
        ({"building": "yes", "height_ft": "40", "min_height_m": "5"}, 5.0, 40 * FOOT_M),
        ({"building": "yes", "height": "40", "units": "Feet", "building:levels": "3"}, -math.inf, 40 * FOOT_M),
        ({"building": "yes", "height": "40 m", "unit": "ft", "min_height_m": "5"}, 5.0, 40.0),
        ({"building": "yes", "levels": "4", "units": "feet"}, -math.inf, 12.0),
        ({"building": "yes", "storeysAboveGround": "4"}, -math.inf, 12.0),
        ({"building": "yes", "building:levels": "4"}, -math.inf, 12.0),
        ({"building": "yes", "building:levels": "4", "roof:levels": "1"}, -math.inf, 15.0),
        ({"building": "yes", "building:levels": "0", "roof:levels": "11"}, -math.inf, 33.0),
        ({"building": "yes", "building:levels": "4", "roof:height": "5", "roof:levels": "2"}, -math.inf, 17),
        ({"building": "yes", "height": "12", "roof:height": "5"}, -math.inf, 12.0),
        ({"building": "yes", "height": "no idea"}, -math.inf, 6.0),
        ({"building": "yes", "roof:height": "50 m", "min_height": "5"}, 5.0, 55.0),
        ({"building:part": "yes", "height": "30", "min_height": "20"}, 20.0, 30.0),
        ({"building:part": "yes", "building:levels": "9", "building:min_level": "2"}, 6.0, 27.0),
        ({"building:part": "yes", "min_height": "18", "roof:height": "5"}, 18.0, 24.0),
    ],
)
def test_heights_of_buildings_follow_the_rule(
    tags: dict[str, str], bottom_m: float, top_m: float, tmp_path: Path
) -> None:
    others = (("highway", "path"), ("power", "line"), ("aerialway", "gondola"), ("man_made", "crane"))
    cellar = {"building": "yes", "height": "9", "location": "underground"}
    objects = [(each, RING) for each in (tags, cellar, *({k: v} for k, v in others))]
    found = read_any(osm(tmp_path / "a.osm", objects))
    assert found.kind == "osm"
    assert found.notes[-2].startswith("3 objects that")
    assert found.notes[-1] == "1 object underground passed over"
    (part,) = found.parts
    assert (part.rigid, part.top.datum) == (True, Datum.GROUND)
    assert part.top.height_m == pytest.approx(top_m)
    assert part.bottom.height_m == pytest.approx(bottom_m)
    same = read_any(geojson(tmp_path / "a.geojson", feature(tags))).parts
    assert [(each.bottom, each.top) for each in same] == [(part.bottom, part.top)]


def test_a_multipolygon_of_pieces_has_its_courtyard(tmp_path: Path) -> None:
    corners = [(0, 0), (4, 0), (4, 4), (0, 4), (1, 1), (3, 1), (3, 3), (1, 3)]
    nodes = "".join(f'<node id="{k}" lon="{8 + x / 1e3}" lat="{47 + y / 1e3}"/>' for k, (x, y) in enumerate(corners))
    ways = {1: (0, 1, 2), 2: (2, 3, 0), 3: (4, 5, 6, 7, 4)}
    refs = {number: "".join(f"<nd ref='{ref}'/>" for ref in way) for number, way in ways.items()}
    lines = "".join(f"<way id='{number}'>{inner}</way>" for number, inner in refs.items())
    roles = {1: "outer", 2: "outer", 3: "inner"}
    members = "".join(f"<member type='way' ref='{ref}' role='{role}'/>" for ref, role in roles.items())
    tags = '<tag k="type" v="multipolygon"/><tag k="building" v="yes"/>'
    text = f"<osm version='0.6'>{nodes}{lines}<relation id='9'>{members}{tags}</relation></osm>"
    (part,) = read_any(written(tmp_path / "a.osm", text)).parts
    assert part.footprint.area == pytest.approx(12e-6)
    assert len(part.footprint.interiors) == 1


def test_city_objects_stand_between_their_vertices(tmp_path: Path) -> None:
    box = [[x, y, z] for z in (5000, 17000) for x, y in ((0, 0), (10000, 0), (10000, 8000), (0, 8000))]
    walls = [[[k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4]] for k in range(4)]
    solid = {"type": "Solid", "lod": "1", "boundaries": [[[[3, 2, 1, 0]], [[4, 5, 6, 7]], *walls]]}
    flat = {"type": "MultiSurface", "lod": "0", "boundaries": [[[0, 1, 2, 3]]]}
    content = {
        "type": "CityJSON",
        "version": "2.0",
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415"},
        "transform": {"scale": [0.001, 0.001, 0.001], "translate": [84000.0, 446000.0, 0.0]},
        "CityObjects": {
            "b": {"type": "Building", "geometry": [flat, solid]},
            "w": {"type": "WaterBody", "geometry": [flat]},
        },
        "vertices": box,
    }
    found = read_any(written(tmp_path / "a.city.json", json.dumps(content)))
    assert (found.kind, found.crs) == ("cityjson", "EPSG:7415")
    (part,) = found.parts
    assert part.footprint.bounds == pytest.approx((84000.0, 446000.0, 84010.0, 446008.0))
    assert (part.bottom, part.top) == (Limit(5.0), Limit(17.0))
    assert found.notes == ("passed over: 1 WaterBody",)


@pytest.mark.parametrize(
    ("text", "limit"),
    [("SFC", NO_BOTTOM), ("GND", NO_BOTTOM), ("0", NO_BOTTOM), ("UNLIM", NO_TOP), ("UNL FT", NO_TOP),
     ("2500 ft", Limit(2500 * FOOT_M)), ("2500FT AMSL", Limit(2500 * FOOT_M)),
     ("1000 ft AGL", Limit(1000 * FOOT_M, Datum.GROUND)), ("100m GND", Limit(100.0, Datum.GROUND)),
     ("3000m AMSL", Limit(3000.0)), ("450m", Limit(450.0)), ("FL 65", Limit(6500 * FOOT_M)),
     ("FL140", Limit(14000 * FOOT_M)), ("5000 STD", Limit(5000 * FOOT_M)), ("BY NOTAM", None), ("2.500ft", None)],
)  # fmt: skip
def test_limits_are_read_as_airspace_files_write_them(text: str, limit: Limit | None) -> None:
    found = limit_of(text)
    assert (found and found.datum) == (limit and limit.datum)
    assert (found and found.height_m) == pytest.approx(limit and limit.height_m)


def in_plane(shape: Any, longitude: float, latitude: float) -> Any:
    return Mapping("EPSG:4326", Place(latitude, longitude)).geometries(shape)


def test_an_arc_goes_round_its_centre_the_way_it_is_told(tmp_path: Path) -> None:
    text = "AC R\nAN half\nAL SFC\nAH 2000 ft\nV X=47:00:00 N 008:00:00 E\nV D={}\nDA 5,0,180\n"
    areas = {}
    for sign, side in (("+", 1), ("-", -1)):
        (part,) = read_any(written(tmp_path / "a.txt", text.format(sign))).parts
        shape = in_plane(part.footprint, 8.0, 47.0)
        assert math.copysign(1.0, shape.centroid.x) == side
        areas[sign] = shape.area
    assert areas["+"] == pytest.approx(math.pi * (5 * 1852.0) ** 2 / 2, rel=1e-3)
    assert areas["-"] == pytest.approx(areas["+"], rel=1e-6)


def test_ed269_zones_have_their_own_unit_and_reference(tmp_path: Path) -> None:
    volume = {
        "uomDimensions": "FT",
        "horizontalProjection": {"type": "Circle", "center": [8.0, 47.0], "radius": 500},
        **{"lowerLimit": 100, "lowerVerticalReference": "AMSL"},
        **{"upperLimit": 400, "upperVerticalReference": "AGL"},
    }
    zones = [{"restriction": kind, "geometry": [volume]} for kind in ("PROHIBITED", "NO_RESTRICTION")]
    found = read_any(written(tmp_path / "a.json", json.dumps({"features": zones})))
    assert found.kind == "ed269"
    (part,) = found.parts
    assert (part.bottom.height_m, part.top.height_m) == pytest.approx((100 * FOOT_M, 400 * FOOT_M))
    assert (part.bottom.datum.name, part.top.datum.name) == ("SEA", "GROUND")
    assert in_plane(part.footprint, 8.0, 47.0).area == pytest.approx(math.pi * 500.0**2, rel=1e-3)


def test_ed318_layers_and_extents(tmp_path: Path) -> None:
    layer = {"upper": 150, "upperReference": "AMSL", "lower": 50, "lowerReference": "AMSL", "uom": "m"}
    extent = {"subType": "Circle", "radius": 900}
    round_ = {"type": "Point", "coordinates": [8, 47], "extent": extent, "layer": layer}
    square = {"type": "Polygon", "coordinates": [SQUARE], "layer": {**layer, "upper": 500, "uom": "ft"}}
    both = {"type": "GeometryCollection", "geometries": [round_, square]}
    path = written(tmp_path / "a.json", json.dumps({"type": "Feature", "properties": {}, "geometry": both}))
    found = read_any(path)
    assert found.kind == "ed318"
    assert [part.top.height_m for part in found.parts] == pytest.approx([150.0, 500 * FOOT_M])


def test_kml_polygons_reach_from_the_ground_to_their_altitude(tmp_path: Path) -> None:
    ring = " ".join(f"{x},{y},570" for x, y in SQUARE)
    places = "".join(
        f"<Placemark><name>{mode}</name><Polygon><altitudeMode>{mode}</altitudeMode><outerBoundaryIs><LinearRing>"
        f"<coordinates>{ring}</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>"
        for mode in ("absolute", "relativeToGround", "clampToGround")
    )
    document = f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{places}</Document></kml>'
    path = written(tmp_path / "a.kml", document)
    found = read_any(path)
    assert [part.top for part in found.parts] == [Limit(570.0), Limit(570.0, Datum.GROUND), NO_TOP]
    with pytest.raises(InputError, match=r"is of the kind kml; crs is used by geotiff, .*, geojson only"):
        scenario_with(path, crs="EPSG:2056")
    bare = written(tmp_path / "b.kml", document.replace(",570", ""))
    assert [part.top for part in read_any(bare).parts] == [NO_TOP] * 3
    offset = "<gx:altitudeOffset>30</gx:altitudeOffset>"
    lifted = document.replace("<Polygon>", f"<Polygon>{offset}").replace("<kml ", f"<kml {GX} ")
    with pytest.raises(InputError, match="has gx:altitudeOffset, which is not read"):
        scenario_with(written(bare, lifted))
    limits = '<ExtendedData><Data name="upper"><value>2500 ft AMSL</value></Data></ExtendedData>'
    limited = read_any(written(tmp_path / "c.kml", document.replace("<Polygon>", f"{limits}<Polygon>")))
    assert [part.top for part in limited.parts] == [Limit(2500 * FOOT_M)] * 3
    assert limited.notes == ("3 parts, absolute the first: its lower limit is not known; taken as without",)
    packed = zipped(tmp_path / "a.kmz", doc__kml=path.read_bytes())
    assert [part.top for part in read_any(packed).parts] == [part.top for part in found.parts]


def test_fences_keep_in_and_out(tmp_path: Path) -> None:
    ring = [[47.0, 8.0], [47.0, 8.01], [47.01, 8.01]]
    lines = written(tmp_path / "fence.txt", "47.005 8.005\n47.0 8.0\n47.0 8.01\n47.01 8.01\n47.0 8.0\n")
    (part,) = read_any(lines).parts
    assert part.keep_in
    assert part.footprint.bounds == (8.0, 47.0, 8.01, 47.01)
    rows = [f"{k}\t0\t3\t5002\t3\t0\t0\t0\t{x}\t{y}\t0\t1" for k, (x, y) in enumerate(ring)]
    items = written(tmp_path / "fence.waypoints", "QGC WPL 110\n" + "\n".join(rows) + "\n")
    assert [part.keep_in for part in read_any(items).parts] == [False]


def test_a_moving_ai_map_is_as_large_as_its_cells(tmp_path: Path) -> None:
    path = written(tmp_path / "a.map", "type octile\nwidth 3\nheight 2\nmap\n.@.\nTTG\n")
    found = read_any(path, metres_per_cell=20.0).raster
    assert found is not None
    assert found.values.tolist() == [[0, 1, 0], [1, 1, 0]]
    assert found.affine == (20.0, 0.0, 0.0, 0.0, -20.0, 40.0)


def test_kinds_are_told_from_what_stands_in_a_file(tmp_path: Path) -> None:
    for text, kind in (
        ("ncols 2\nnrows 2\n", "ascii_grid"),
        ("type octile\nheight 1\nwidth 1\nmap\n.\n", "moving_ai"),
        ("* comment\nAC R\nAN x\n", "openair"),
        ('{"UASZoneList": []}', "ed269"),
        ('{"type": "FeatureCollection", "features": []}', "geojson"),
        ('{"type": "LineString", "layer": {"id": 1}, "coordinates": []}', "geojson"),
        ("<?xml version='1.0'?><osm/>", "osm"),
        ("<?xml version='1.0'?>\n<!-- of <club> -->\n<!-- 2026 -->\n<kml/>", "kml"),
        ("image: a.pgm\nresolution: 1\n", "ros_map"),
        ("QGC WPL 110\n0\n", "ardupilot_fence"),
    ):
        assert kind_of(written(tmp_path / "nothing.says", text)) == kind


def test_the_name_of_a_group_stands_for_its_kinds_and_no_others(tmp_path: Path) -> None:
    path = written(tmp_path / "map.txt", "type octile\nheight 1\nwidth 1\nmap\n@\n")
    assert read(FileSpec(path, "occupancy")).kind == "moving_ai"
    with pytest.raises(InputError, match="is of the kind moving_ai, not terrain; leave kind out"):
        scenario_with(path, kind="terrain")
