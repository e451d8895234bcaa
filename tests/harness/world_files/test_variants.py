"""Files as other programs write them: what is read agrees with what pyproj, rasterio and arithmetic say."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from harness.world_files.parts import FOOT_M, NO_BOTTOM, NO_TOP, Datum, Limit
from tests.harness.run.given import written
from tests.harness.world_files.making import feature, geojson, read_any, scenario_with
from wayproof import InputError

pytestmark = pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")  # of rasterio's own

CORNERS = [(8.0, 47.0), (8.001, 47.0), (8.001, 47.001), (8.0, 47.001)]
RING = [*CORNERS, CORNERS[0]]


def openaip(*limit: int | str) -> dict[str, int | str]:
    return dict(zip(("value", "unit", "referenceDatum"), limit, strict=True))


def same(found: Limit, wanted: Limit) -> bool:
    return found.datum is wanted.datum and bool(found.height_m == pytest.approx(wanted.height_m))


@pytest.mark.parametrize(
    ("how", "metres"),
    [
        ({"units": ("ft",)}, None),
        ({"units": ("metre",)}, 1000.0),
        ({"scales": (0.1,), "offsets": (-50.0,)}, 50.0),
        ({"crs": "EPSG:26916+6360"}, None),
        ({"crs": "EPSG:2263"}, None),
        ({"crs": "EPSG:32632+5773"}, 1000.0),
    ],
)
def test_a_geotiffs_heights_are_metres_or_it_is_refused(
    how: dict[str, Any], metres: float | None, tmp_path: Path
) -> None:
    rasterio = pytest.importorskip("rasterio")
    path = tmp_path / "a.tif"
    profile = {"driver": "GTiff", "height": 4, "width": 5, "count": 1, "dtype": "int16", "nodata": -32768}
    place = rasterio.transform.from_origin(400_000.0, 5_200_000.0, 10.0, 10.0)
    heights = np.full((4, 5), 1000, dtype="int16")
    heights[1, 2] = -32768
    with rasterio.open(path, "w", crs=how.get("crs", "EPSG:32632"), transform=place, **profile) as file:
        file.write(heights, 1)
        for name in ("units", "scales", "offsets"):
            if name in how:
                setattr(file, name, how[name])
    if metres is None:
        with pytest.raises(InputError, match=r"has heights in (ft|US survey foot); make them metres"):
            scenario_with(path)
        return
    terrain = read_any(path).terrain
    assert terrain is not None
    assert terrain.values[0, 0] == pytest.approx(metres)
    assert np.argwhere(np.isnan(terrain.values)).tolist() == [[1, 2]]


def nodes() -> str:
    return "".join(f'<node id="{k}" lon="{x}" lat="{y}"/>' for k, (x, y) in enumerate(CORNERS, 1))


WAY = (
    '<way id="7"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="1"/>'
    '<tag k="building" v="yes"/><tag k="height" v="12 m"/></way>'
)


@pytest.mark.parametrize("body", [nodes() + WAY, WAY + nodes()], ids=["nodes first", "nodes last"])
def test_openstreetmap_in_any_order(body: str, tmp_path: Path) -> None:
    found = read_any(written(tmp_path / "a.osm", f'<?xml version="1.0"?>\n<osm version="0.6">{body}</osm>'))
    (part,) = found.parts
    assert (part.footprint.area, part.top) == (pytest.approx(1e-6), Limit(12.0, Datum.GROUND))
    assert found.notes == ()
    bow = body.replace('"2"/><nd ref="3"', '"3"/><nd ref="2"')
    (note,) = read_any(written(tmp_path / "b.osm", f'<osm version="0.6">{bow}</osm>')).notes
    assert note == "1 building whose outline crosses itself or misses a corner"


@pytest.mark.parametrize(
    ("tags", "bottom_m", "top_m", "said"),
    [
        ({"building": "yes", "height": -1}, -math.inf, 6.0, True),
        ({"building": "yes", "height": "20?", "building:levels": "5"}, -math.inf, 20.0, True),
        ({"HEIGHT": 21.5}, -math.inf, 21.5, False),
        ({"num_floors": 3, "height": None}, -math.inf, 9.0, False),
        # A list, a range or a guess is as high as its largest number, and begins at the ground.
        ({"height": "~15"}, -math.inf, 15.0, True),
        ({"building": "yes", "height": "15;18"}, -math.inf, 18.0, True),
        ({"building": "yes", "building:levels": "3-4"}, -math.inf, 12.0, True),
        ({"building": "yes", "height": "20", "min_height": "~3-4"}, -math.inf, 20.0, True),
    ],
)
def test_a_height_that_is_no_plain_length_is_told(
    tags: dict[str, Any], bottom_m: float, top_m: float, said: bool, tmp_path: Path
) -> None:
    found = read_any(geojson(tmp_path / "a.geojson", feature(tags)))
    (part,) = found.parts
    assert part.bottom.height_m == bottom_m
    assert part.top.height_m == pytest.approx(top_m)
    assert any("no plain length" in note for note in found.notes) == said


SPACE = "AC R\nAN one\nAL {}\nAH {}\nDP 47:00:00 N 008:00:00 E\nDP 47:00:00 N 008:01:00 E\nDP 47:01:00 N 008:01:00 E\n"


@pytest.mark.parametrize(
    "place",
    ["47:26:36 N 007:03:42 E", "47:26:36N 007:03:42E", "47 26 36 N 007 03 42 E", "47 26 36N, 7 03 42E",
     "47\N{DEGREE SIGN}26'36\"N , 007\N{DEGREE SIGN}03'42\"E", "47:26.6N 007:03.7E", "N 47 26 36 E 007 03 42",
     "N47:26:36 E007:03:42", "472636N 0070342E", "472636.00N 0070342.00E", "N472636.00 E0070342.00",
     "4726.6N 00703.7E"],
)  # fmt: skip
def test_places_of_openair(place: str, tmp_path: Path) -> None:
    text = (
        f"AC R\nAN A\nAL GND\nAH 900m MSL\nDP\t{place}\nDP47:40:00 N 007:10:00 E\nDP 47:40:00 N 007:30:00 E\n"
        "TC a lake, and no airspace\nSP 0,1,0,0,255\nDP 47:00:00 N 007:00:00 E\n"
    )
    (part,) = read_any(written(tmp_path / "a.txt", text)).parts
    assert part.footprint.bounds[:2] == pytest.approx((7.0 + 3.7 / 60, 47.0 + 26.6 / 60), abs=1e-9)


@pytest.mark.parametrize(
    ("more", "bottom", "top", "notes"),
    [
        ("AL FL20\nAH FL65\n", Limit(2000 * FOOT_M), Limit(6500 * FOOT_M), []),
        ("AL FL20\nAH FL50\nAH FL65\n", Limit(2000 * FOOT_M), NO_TOP, ["upper limit is not known"]),
        ("", NO_BOTTOM, NO_TOP, ["lower limit is not known", "upper limit is not known"]),
    ],
)
def test_limits_of_openair_that_are_missing_or_come_twice(
    more: str, bottom: Limit, top: Limit, notes: list[str], tmp_path: Path
) -> None:
    found = read_any(written(tmp_path / "a.txt", SPACE.replace("AL {}\nAH {}\n", more)))
    (part,) = found.parts
    assert same(part.bottom, bottom)
    assert same(part.top, top)
    told = [note for note in found.notes if any(each in note for each in notes)]
    assert told == list(found.notes[: len(notes)])
    assert len(found.notes) == len(notes) + 1
    bare = read_any(written(tmp_path / "b.txt", SPACE.removeprefix("AC R\n").format("FL20", "FL65")))
    assert "at all times (no class): take out" in bare.notes[-1]  # it said ()


@pytest.mark.parametrize(
    ("name", "lines", "corner", "noted"),
    [
        ("a.txt", ["47.5 8.5", "47.0 8.0", "47.0 9.0", "48.0 9.0", "47.0 8.0"], False, False),
        ("a.fen", ["#saved", "47.5 8.5", "47.0 8.0", "47.0 9.0", "48.0 9.0", "47.0 8.0"], False, False),
        ("a.txt", ["48.5 8.5", "47.0 8.0", "47.0 9.0", "48.0 9.0", "48.5 8.5"], True, True),
        ("a.poly", ["#saved by Mission Planner", "48.5 8.5", "47.0 8.0", "47.0 9.0", "48.0 9.0"], True, True),
    ],
)
def test_a_fence_without_a_return_point_keeps_its_first_corner(
    name: str, lines: list[str], corner: bool, noted: bool, tmp_path: Path
) -> None:
    found = read_any(written(tmp_path / name, "\n".join(lines) + "\n"))
    assert found.parts[0].footprint.bounds[3] == (48.5 if corner else 48.0)
    assert ("has no return point: its first place is a corner" in found.notes) is noted


def city(crs: str, objects: dict[str, Any], vertices: list[list[float]], **more: Any) -> dict[str, Any]:
    metadata = {"referenceSystem": crs}
    return {
        "type": "CityJSON", "version": "1.1", "metadata": metadata, "CityObjects": objects, "vertices": vertices, **more
    }  # fmt: skip


def floor(kind: str = "MultiSurface", **attributes: Any) -> dict[str, Any]:
    geometry = [{"type": kind, "lod": "0", "boundaries": [[[0, 1, 2, 3]]]}]
    return {"type": "Building", "attributes": attributes, "geometry": geometry}


SQUARE_M = [[0.0, 0.0, 7.0], [10.0, 0.0, 7.0], [10.0, 10.0, 7.0], [0.0, 10.0, 7.0]]


def test_a_city_object_that_is_a_footprint_is_as_high_as_its_attributes_say(tmp_path: Path) -> None:
    objects = {"a": floor(measuredHeight=12.5), "b": floor(), "c": floor("MultiLineString")}
    text = json.dumps(city("urn:ogc:def:crs:EPSG::7415", objects, SQUARE_M))
    found = read_any(written(tmp_path / "a.city.json", text))
    assert [(part.name, part.bottom, part.top) for part in found.parts] == [
        ("a", Limit(7.0), Limit(19.5)),
        ("b", Limit(7.0), Limit(13.0)),
    ]
    assert found.crs == "EPSG:7415"
    assert any("1 building without height" in note for note in found.notes)


@pytest.mark.parametrize(
    ("tags", "bottom", "top"),
    [
        (  # Germany's DIPUL
            {
                "lower_limit_altitude": "0", "lower_limit_unit": "FT", "lower_limit_alt_ref": "AGL",
                "upper_limit_altitude": "2500", "upper_limit_unit": "FT", "upper_limit_alt_ref": "AMSL",
            },
            NO_BOTTOM, Limit(2500 * FOOT_M),
        ),
        (  # the FAA: -9998 stands for a limit that is not known
            {"LOWER_VAL": "0", "LOWER_UOM": "FT", "LOWER_CODE": "SFC", "UPPER_VAL": "-9998", "UPPER_UOM": ""},
            NO_BOTTOM, NO_TOP,
        ),
        ({"floor_ft": 100, "ceiling_ft": 400}, Limit(100 * FOOT_M), Limit(400 * FOOT_M)),
        ({"floor_m": 100, "ceil_m": 400}, Limit(100.0), Limit(400.0)),
        ({"upperLimit": 400, "uomUpper": "FT", "refUpper": "AGL"}, NO_BOTTOM, Limit(400 * FOOT_M, Datum.GROUND)),
        ({"minAlt": 27.432, "maxAlt": 120}, Limit(27.432), Limit(120.0)),
        ({"minAlt": 0, "maxAltitude": 9, "altitudeUnit": "m", "reference": "AGL"}, NO_BOTTOM, Limit(9, Datum.GROUND)),
        ({"floor_ft_agl": 100, "ceiling_ft_amsl": 400}, Limit(100 * FOOT_M, Datum.GROUND), Limit(400 * FOOT_M)),
        (
            {"minAltitude": 10, "minAltitudeType": "AGL", "maxAltitude": 500, "maxAltitudeType": "QNH"},
            Limit(10.0, Datum.GROUND), Limit(500.0),
        ),
        ({"lower": "GND", "upper": "UNLTD"}, NO_BOTTOM, NO_TOP),
        (
            {"lower": "200 ft AMSL", "lowerReference": "AGL", "upper": "FL 65", "upperReference": "AGL"},
            Limit(200 * FOOT_M), Limit(6500 * FOOT_M),
        ),
        (  # Spain's ENAIRE
            {"verticalLayer": {"lower": 305, "lowerReference": "AGL", "upper": "FL 65", "UOM": "M"}},
            Limit(305.0, Datum.GROUND), Limit(6500 * FOOT_M),
        ),
        (  # openAIP, with words, and with its API's codes
            {"lowerCeiling": openaip(9, "FT", "GND"), "upperLimit": openaip(95, 6, 2)},
            Limit(9 * FOOT_M, Datum.GROUND), Limit(9500 * FOOT_M),
        ),
        ({"lowerLimit": openaip(0, 1, 0), "upperCeiling": openaip(9, 0, 1)}, NO_BOTTOM, Limit(9.0)),
        ({"upper": {"value": 9, "uom": "m", "reference": "AGL"}}, NO_BOTTOM, Limit(9.0, Datum.GROUND)),
    ],
)  # fmt: skip
def test_limits_as_authorities_name_them(tags: Any, bottom: Limit, top: Limit, tmp_path: Path) -> None:
    found = read_any(geojson(tmp_path / "a.geojson", feature(tags)))
    assert [same(a.bottom, bottom) and same(a.top, top) for a in found.parts] == [True]


@pytest.mark.parametrize("reference", ["AGL", "AMSL"])
def test_a_zone_whose_upper_limit_is_0_is_not_lost(reference: str, tmp_path: Path) -> None:
    ring = [[8.0, 47.0], [8.01, 47.0], [8.01, 47.01], [8.0, 47.0]]
    volume: dict[str, Any] = {"horizontalProjection": {"type": "Polygon", "coordinates": [ring]}}
    volume |= {"uomDimensions": "M", "lowerLimit": 0, "upperLimit": 0}
    volume |= {"lowerVerticalReference": reference, "upperVerticalReference": reference}
    zones = [{"identifier": "A", "geometry": [volume], "applicability": {"schedule": [{"day": "MON"}]}}]
    found = read_any(written(tmp_path / "a.json", json.dumps({"features": zones})))
    assert [part.top for part in found.parts] == [NO_TOP]
    assert found.notes == (
        "A: its upper limit is 0, or the surface; taken as without",
        "1 zone that apply at times only taken as always there",
    )
    (part,) = read_any(written(tmp_path / "a.txt", SPACE.format("GND", "GND"))).parts
    assert part.top == NO_TOP


@pytest.mark.parametrize("place", [[2_600_000.0, 1_200_000.0], [8.0, 147.0], [-400.0, 47.0]])
def test_coordinates_that_are_no_degrees_ask_for_their_system(place: list[float], tmp_path: Path) -> None:
    ring = [place, [place[0] + 0.5, place[1]], [place[0], place[1] + 0.5], place]
    path = written(tmp_path / "a.geojson", json.dumps({"type": "Polygon", "coordinates": [ring]}))
    with pytest.raises(InputError, match="for a longitude and a latitude; must be degrees, or give crs"):
        scenario_with(path)
    if place[0] > 1e6:
        assert len(read_any(path, crs="EPSG:2056").parts) == 1


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ('<way id="7"><nd ref="1" lat="47" lon="8"/></way>', "has places inside its ways"),
        ((nodes() + WAY).replace('id="', 'id="-'), "has ways of JOSM that are new or deleted"),
        (nodes() + WAY.replace('id="7"', 'id="7" action="delete"'), "of JOSM that are new or deleted"),
    ],
)
def test_openstreetmap_that_osmium_passes_over_is_refused(body: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=sentence):
        scenario_with(written(tmp_path / "a.osm", f'<osm version="0.6">{body}</osm>'))


def test_a_city_is_in_metres_and_its_templates_are_told(tmp_path: Path) -> None:
    vertices = [[x, y, z] for z in (10.0, 40.0) for x, y in ((0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0))]
    shape = {"type": "MultiSurface", "lod": "1", "boundaries": [[[0, 1, 2, 3]], [[4, 5, 6, 7]]]}
    shapes = {"a": shape, "b": {"type": "GeometryInstance", "template": 0, "boundaries": [0]}}
    objects = {name: {"type": "Building", "geometry": [each]} for name, each in shapes.items()}
    path = written(tmp_path / "a.json", json.dumps(city("urn:ogc:def:crs:EPSG::2263", objects, vertices)))
    with pytest.raises(InputError, match="has heights in US survey foot; make them metres, or give a crs"):
        scenario_with(path)
    found = read_any(path, crs="EPSG:2263+5703")
    (part,) = found.parts
    assert (part.bottom.height_m, part.top.height_m) == (10.0, 40.0)
    assert found.notes == ("passed over: 1 GeometryInstance",)
    path.write_text(json.dumps(city("urn:ogc:def:crs:EPSG::4979", objects, vertices)))
    (note,) = set(read_any(path).notes) - set(found.notes)
    assert "has heights above the ellipsoid" in note


@pytest.mark.parametrize("white", [1, 100, 255, 1023, 65_535])
@pytest.mark.parametrize(("negate", "solid"), [(0, [1.0, 1.0, np.nan, 0.0]), (1, [0.0, 0.0, np.nan, 1.0])])
def test_a_grey_of_a_ros_map_is_a_share_of_its_images_white(
    white: int, negate: int, solid: list[float], tmp_path: Path
) -> None:
    """By netpbm's pgm(5); of greys 0, a fifth, a half and white, with thresholds of 0.65 and 0.25."""
    pytest.importorskip("rasterio")
    greys = [math.floor(share * white) for share in (0.0, 0.2, 0.5, 1.0)]
    known = [0, 3] if white == 1 else [0, 1, 2, 3]
    if white == 1:
        Image.fromarray(np.array([greys], dtype=np.bool_)).save(tmp_path / "a.pgm", format="PNG")
    else:
        data = np.array(greys, dtype=">u2" if white > 255 else "u1").tobytes()
        (tmp_path / "a.pgm").write_bytes(b"P5 # by hand\n4\n1 %d\n" % white + data)
    keys = f"image: a.pgm\nresolution: 1.0\nnegate: {negate}\norigin: [0, 0, 0]\n"
    raster = read_any(written(tmp_path / "a.yaml", keys), kind="ros_map").raster
    assert raster is not None
    assert np.array_equal(raster.values[0, known], np.array(solid)[known], equal_nan=True)


def test_a_ros_map_of_mode_scale_has_whole_percents_between_its_thresholds(tmp_path: Path) -> None:
    """As nav2's map_io.cpp: of greys 0, 127 and 254 the percents are 100, 50 and 0; all three were unknown."""
    pytest.importorskip("rasterio")
    (tmp_path / "a.pgm").write_bytes(b"P5\n3\n1 255\n\x00\x7f\xfe")
    keys = "image: a.pgm\nresolution: 1.0\norigin: [0, 0, 0]\nmode: scale\nfree_thresh: 0.0\noccupied_thresh: 1.0\n"
    raster = read_any(written(tmp_path / "a.yaml", keys)).raster
    assert raster is not None
    assert np.array_equal(raster.values, [[1.0, np.nan, 0.0]], equal_nan=True)
    Image.fromarray(np.zeros((9, 9), dtype=np.uint8)).save(tmp_path / "b.png")
    for torn in (b"P5\n3\n1 255\n\x00\x7f", (tmp_path / "b.png").read_bytes()[:-9]):
        (tmp_path / "a.pgm").write_bytes(torn)
        with pytest.raises(InputError, match=r"names the image a\.pgm: is torn; must be"):
            read_any(tmp_path / "a.yaml")


@pytest.mark.parametrize(
    ("command", "area"),
    [
        ("DC 3 NM", math.pi),
        ("DA 3,0,360", math.pi),
        ("DA 3,90,450", math.pi),
        ("DB 50:03:00 N 010:00:00 E, 50:03:00 N 010:00:00 E", math.pi),
        ("DA 3,0,180", math.pi / 2),
        ("V W=6\nDY 50:00:00 N 010:00:00 E\nDY 56:00:00 N 010:00:00 E", (240 + math.pi) * 1.07),
    ],
)
def test_arcs_all_the_way_round_and_airways_are_whole(command: str, area: float, tmp_path: Path) -> None:
    """It was lost, as its ends are one place; and an airway is as wide at its end as where it begins, in miles."""
    text = f"AC R\nAN round\nAL GND\nAH FL100\nV X=50:00:00 N 010:00:00 E\n{command}\n"
    (part,) = read_any(written(tmp_path / "a.txt", text)).parts
    assert part.footprint.area * 400.0 * math.cos(math.radians(50.0)) == pytest.approx(area, rel=0.01)


@pytest.mark.parametrize(
    ("uom", "upper", "top_m"),
    [("FL", 95, 2895.6), ("ft", 95, 28.956), ("FT", "95 ft", 28.956), ("m", "95", 95.0), (None, 95, 95.0)],
)
@pytest.mark.parametrize("form", ["ed318", "ed269"])
def test_limits_of_geozones_in_their_unit(form: str, uom: str | None, upper: Any, top_m: float, tmp_path: Path) -> None:
    """Flight levels were taken as feet, and a limit with a unit of its own was scaled twice."""
    shape: dict[str, Any] = {"type": "Polygon", "coordinates": [[[8, 47], [8.1, 47], [8.1, 47.1], [8, 47]]]}
    features: list[dict[str, Any]]
    if form == "ed318":
        shape["layer"] = {"lower": 0, "upper": upper, "upperReference": "AMSL", "uom": uom}
        features = [{"type": "Feature", "properties": {"name": "z"}, "geometry": shape}]
    else:
        says = {"lowerLimit": 0, "upperLimit": upper, "upperVerticalReference": "AMSL", "uomDimensions": uom}
        features = [{"identifier": "z", "geometry": [{"horizontalProjection": shape, **says}]}]
    content = {"type": "FeatureCollection", "features": features}
    found = read_any(written(tmp_path / "a.json", json.dumps(content)))
    assert [part.top.height_m for part in found.parts] == pytest.approx([top_m])
    assert found.notes == ()
    bare = written(tmp_path / "c.json", json.dumps(content).replace('"upper', '"was'))
    assert read_any(bare).notes == ("z: its upper limit is not known; taken as without",)
    with pytest.raises(InputError, match="has limits in 'nm'; must be in m, ft or FL"):
        scenario_with(written(tmp_path / "b.json", json.dumps(content).replace(json.dumps(uom), '"NM"')))


def test_a_map_whose_image_has_changed_is_read_anew(tmp_path: Path) -> None:
    path = written(tmp_path / "a.yaml", "image: b.pgm\nresolution: 100\norigin: [0, 0, 0]\n")
    for blocked in (0, 4):
        rows = [254] * 6400
        rows[3240 : 3240 + blocked] = [0] * blocked
        (tmp_path / "b.pgm").write_bytes(b"P5 80 80 255\n" + bytes(rows))
        assert len(scenario_with(path).obstacles) == (blocked > 0)
