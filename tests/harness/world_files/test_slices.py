"""What is solid at one altitude, held against independent readers: area, nothing missing, validity, ground."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from scipy.interpolate import RegularGridInterpolator

from aircraft.frames import LocalPlane
from harness.scenario.environment import GroundSpec
from harness.world_files import height_field, solids
from harness.world_files.expansion import Expanded, FileFault, expanded, loaded_file
from harness.world_files.parts import FileSpec
from harness.world_files.plane import Mapping, Place, geodetic
from harness.world_files.solids import outlines, simplified
from tests.harness.world_files.making import SHARED, SQUARE, feature, geojson, geotiff
from tests.longer import longer
from wayproof import InputError

AROUND = (-4000.0, -4000.0, 4000.0, 4000.0)

real = pytest.mark.skipif(not SHARED.is_dir(), reason="real files are not beside this checkout")


def cut(path: Path, altitude_m: float, **keys: Any) -> tuple[Expanded, Mapping]:
    """A file cut at an altitude, in a plane about its middle and an area as large as it is."""
    spec = FileSpec(path, **keys)
    contents = loaded_file(spec)
    place = Place(47.0, 8.0)
    if contents.crs:
        latitude, longitude = geodetic(contents.crs, *contents.corners)
        place = Place(*(round(float(each.min() + each.max()) / 2, 5) for each in (latitude, longitude)))
    mapping = Mapping(contents.crs, place)
    east, north = mapping.to_plane(*contents.corners)
    bounds = (float(east.min()), float(north.min()), float(east.max()), float(north.max()))
    return expanded([spec], place, bounds, altitude_m), mapping


def union(found: Expanded) -> Any:
    return shapely.union_all([each for source in found.sources for each in source.polygons])


def check_covers(found: Expanded, expected: Any, share: float = 0.01) -> None:
    """Nothing solid is missing, and what is added is less than a share."""
    solid = union(found)
    assert all(each.is_valid for source in found.sources for each in source.polygons)
    assert shapely.difference(expected, solid).area <= 1e-6 * expected.area + 1.0
    assert solid.area <= (1.0 + share) * expected.area + 1.0


@real
@pytest.mark.parametrize(
    ("name", "altitude_m", "share"),
    [
        ("davosdorf.tif", 2000, 0.01),
        ("davosdorf.tif", 1700, 0.01),
        *longer([("sertig_valley.tif", 2200, 0.01), ("S36E149.hgt.zip", 900, 0.03)]),
    ],
)
def test_terrain_is_what_rasterio_outlines(name: str, altitude_m: float, share: float) -> None:
    rasterio = pytest.importorskip("rasterio")
    features = pytest.importorskip("rasterio.features")
    path = SHARED / "terrain" / name
    with rasterio.open(f"zip://{path}!S36E149.hgt" if name.endswith(".zip") else str(path)) as dataset:
        heights, transform, crs = dataset.read(1), dataset.transform, dataset.crs.to_epsg()
    mask = (heights >= altitude_m - 10.0).astype(np.uint8)
    shapes = [shapely.geometry.shape(shape) for shape, _ in features.shapes(mask, mask > 0, transform=transform)]
    found, mapping = cut(path, altitude_m)
    dense = shapely.segmentize(np.array(shapes, dtype=object), 32 * abs(transform.a))
    outlined = shapely.union_all(Mapping(f"EPSG:{crs}", mapping.place).geometries(dense))
    check_covers(found, outlined, share)
    # The ground between middles reaches into the band for less than a cell beside a solid one; simplified by another.
    cell_m = abs(transform.e) * (111_320.0 if crs == 4326 else 1.0)
    beyond = shapely.buffer(outlined, 2.0 * cell_m, join_style="mitre")
    assert shapely.difference(union(found), beyond).area <= 1e-6 * outlined.area
    assert found.ground is not None


@real
def test_the_ground_is_rasterios_under_true_north() -> None:
    rasterio = pytest.importorskip("rasterio")
    found, mapping = cut(SHARED / "terrain" / "davosdorf.tif", 2000)
    assert found.ground is not None
    with rasterio.open(SHARED / "terrain" / "davosdorf.tif") as dataset:
        heights = dataset.read(1)
        rng = np.random.default_rng(2)
        rows, columns = rng.integers(5, 490, 200), rng.integers(5, 550, 200)
        x, y = rasterio.transform.xy(dataset.transform, rows, columns)
    east, north = mapping.to_plane(np.array(x), np.array(y))
    assert np.abs(found.ground.at(east, north) - heights[rows, columns]).max() < 0.02
    east, north = mapping.to_plane(np.array([782e3, 782e3]), np.array([187e3, 188e3]))
    turned_deg = math.degrees(math.atan2(float(east[1] - east[0]), float(north[1] - north[0])))
    assert turned_deg == pytest.approx(1.73, abs=0.05)  # grid north lies east of true north


def test_the_plane_is_the_one_that_is_flown_in_and_datums_are_shifted(tmp_path: Path) -> None:
    """Zimmerwald (swisstopo): LV03 602030.68, 191775.03 is 46 52 37.5405 N, 7 27 54.9835 E."""
    plane = LocalPlane(46.9, 7.4)
    mapping = Mapping("EPSG:21781", Place(46.9, 7.4))
    east, north = mapping.to_plane(np.array([602_030.68]), np.array([191_775.03]))
    assert (east[0], north[0]) == pytest.approx(plane.plane(46.877_094_6, 7.465_273_2), abs=2.0)
    back = mapping.from_plane(east, north, 600_000.0)
    assert (back[0][0], back[1][0]) == pytest.approx((602_030.68, 191_775.03), abs=0.01)
    # RFC 7946 has edges straight in degrees: the middle of this one lies 120 m beside the straight line.
    found, mapping = cut(geojson(tmp_path / "a.json", feature({}, [(8, 47), (9, 47), (9, 47.5)])), 300.0)
    assert union(found).boundary.distance(mapping.geometries(shapely.Point(8.5, 47.0))) < 0.2


@real
@pytest.mark.filterwarnings("ignore")  # GDAL warns of rings that are not closed, through pyogrio
@pytest.mark.parametrize(("name", "altitude_m"), [("Helsinki.osm.pbf", 20), ("osmnx_planet_10.068_48.135.osm", 10)])
def test_buildings_are_what_gdal_reads(name: str, altitude_m: float) -> None:
    """An independent reader: GDAL's OSM driver, with heights told from its tags once more."""
    pyogrio = pytest.importorskip("pyogrio")
    path = SHARED / "buildings" / name
    if name.endswith(".pbf"):
        pytest.importorskip("osmium")
    meta, _, geometries, columns = pyogrio.raw.read(path, layer="multipolygons")
    tags = dict(zip([str(each) for each in meta["fields"]], columns, strict=True))
    solid = []
    for row, wkb in enumerate(geometries):
        shape = shapely.from_wkb(wkb, on_invalid="ignore")
        other = str(tags["other_tags"][row] or "")
        if shape is None or not tags["building"][row] or shape.area == 0:
            continue
        found = dict(part.split('"=>"') for part in other.strip('"').split('","') if '"=>"' in part)
        height = found.get("height", "").replace(" m", "")
        levels = float(found.get("building:levels", 0)) + float(found.get("roof:levels", 0))
        top = float(height) if height else 3.0 * levels if "building:levels" in found else 6.0
        bottom = float(found.get("min_height", 3.0 * float(found.get("building:min_level", 0))))
        if top >= altitude_m - 10.0 and bottom <= altitude_m + 10.0:
            solid.append(shapely.make_valid(shape))
    cuts, mapping = cut(path, altitude_m)
    expected = shapely.union_all(mapping.geometries(np.array(solid, dtype=object)))
    assert shapely.difference(expected, union(cuts)).area <= 0.01 * expected.area
    assert len(solid) > 15


@pytest.mark.flights
@real
@pytest.mark.parametrize("altitude_m", [150.0, 500.0, 3000.0])
def test_airspace_is_what_aerofiles_reads(altitude_m: float) -> None:
    openair = pytest.importorskip("aerofiles.openair")
    path = SHARED / "airspace" / "openair_australia_2008.txt"
    place, bounds = Place(-33.9, 151.2), (-150e3, -150e3, 150e3, 150e3)
    found = expanded([FileSpec(path)], place, bounds, altitude_m)
    with path.open(encoding="latin-1") as file:
        records = [record for record, error in openair.Reader(file) if record and not error]
    mapping, low, high = Mapping("EPSG:4326", place), altitude_m - 10.0, altitude_m + 10.0
    window, solid = shapely.box(*bounds), []
    for record in records:
        corners = [each["location"] for each in record["elements"] if each["type"] == "point"]
        if len(corners) != len(record["elements"]) or len(corners) < 3:
            continue  # arcs and circles are ours alone
        bottom, top = (metres(str(record[key]), none) for key, none in (("floor", -1e9), ("ceiling", 1e9)))
        if bottom <= high and top >= low:
            ring = shapely.make_valid(shapely.Polygon([(lon, lat) for lat, lon in corners]))
            solid.append(shapely.intersection(mapping.geometries(ring), window))
    expected = shapely.union_all(solid)
    assert expected.area > 1e9
    assert shapely.difference(expected, union(found)).area <= 1e-5 * expected.area


def metres(text: str, none: float) -> float:
    """Metres of what this one file has: feet, flight levels, SFC, UNL, NOTAM, BCTA."""
    digits = "".join(filter(str.isdigit, text))
    return none if not digits or "SFC" in text else float(digits) * (30.48 if "FL" in text else 0.3048)


@real
@pytest.mark.parametrize("name", ["Boston_0_256.map", "random-32-32-10.map"])
def test_occupied_cells_are_solid_and_no_others(name: str) -> None:
    lines = (SHARED / "occupancy" / name).read_text().splitlines()[4:]
    boxes = [
        shapely.box(20.0 * x, 20.0 * (len(lines) - 1 - y), 20.0 * (x + 1), 20.0 * (len(lines) - y))
        for y, line in enumerate(lines)
        for x, cell in enumerate(line)
        if cell in "@OTW"
    ]
    found, _ = cut(SHARED / "occupancy" / name, 300.0, metres_per_cell=20.0)
    check_covers(found, shapely.union_all(boxes))


def slope(folder: Path) -> Path:
    """Terrain that rises from west to east, 1 m in 10 m, from 1000 m; 4 km wide, in Swiss coordinates."""
    heights = np.tile(1000.0 + np.arange(400.0), (400, 1))
    return geotiff(folder / "slope.tif", heights, (781_000.0, 189_500.0), 10.0, 21781)


def at_slope(file: Path, *more: FileSpec, altitude_m: float = 1200.0) -> Expanded:
    x, y = np.array([783_000.0]), np.array([187_500.0])
    latitude, longitude = geodetic("EPSG:21781", x, y)
    place = Place(float(latitude[0]), float(longitude[0]))
    return expanded([FileSpec(file), *more], place, (-1800.0, -1800.0, 1800.0, 1800.0), altitude_m)


def test_peaks_are_as_high_as_in_the_file_and_what_reaches_up_between_middles_is_solid(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Single cells that stand out, askew to the plane, held against SciPy's bilinear interpolation."""
    heights = 50.0 + 450.0 * (np.random.default_rng(3).random((20, 20)) < 0.1)
    x0, y0 = 781e3, 189_500.0
    file = geotiff(tmp_path / "p.tif", heights, (x0, y0), 200.0, 21781)
    found = at_slope(file, altitude_m=200.0)
    assert found.ground is not None
    again = GroundSpec.of(found.ground).field()  # as the run folder's scenario keeps it
    middles = 100.0 + 200.0 * np.arange(20)
    true = RegularGridInterpolator((middles, middles), heights)
    down, right = np.random.default_rng(4).uniform(300.0, 3700.0, (2, 20_000))
    down[:256], right[:256] = (each.ravel() for each in np.meshgrid(middles[2:-2], middles[2:-2]))
    latitude, longitude = geodetic("EPSG:21781", np.array([783e3]), np.array([187_500.0]))
    mapping = Mapping("EPSG:21781", Place(float(latitude[0]), float(longitude[0])))
    east, north = mapping.to_plane(x0 + right, y0 - down)
    assert np.abs(again.at(east, north) - true((down, right))).max() < 0.6
    inside = (np.abs(east) < 1790.0) & (np.abs(north) < 1790.0) & (true((down, right)) > 190.0)
    assert inside.sum() > 500
    assert shapely.covers(union(found), shapely.points(east[inside], north[inside])).all()
    holed = np.pad(np.full((10, 10), -9999.0), 5, constant_values=50.0)
    first = geotiff(tmp_path / "h.tif", holed, (x0, y0), 200.0, 21781)
    both = at_slope(first, FileSpec(slope(tmp_path))).ground  # where the first has none, the next counts
    assert both is not None
    assert both.at(np.array([-970.0]), np.zeros(1)) == pytest.approx(1102.5, abs=1.0)
    monkeypatch.setattr(height_field, "MAX_NODES", 150)  # then it is kept coarser, and nowhere lower
    coarse = at_slope(file, altitude_m=200.0).ground
    assert coarse is not None
    assert coarse.heights_m.size <= 150
    assert (coarse.at(east[inside], north[inside]) >= true((down, right))[inside] - 0.6).all()


def zone_on_slope(folder: Path, **limits: Any) -> FileSpec:
    """A zone of 2 km by 2 km in the middle of the slope."""
    x, y = np.array([782e3, 784e3, 784e3, 782e3]), np.array([186_500.0, 186_500.0, 188_500.0, 188_500.0])
    latitude, longitude = geodetic("EPSG:21781", x, y)
    ring = [[east, north] for east, north in zip(longitude, latitude, strict=True)]
    return FileSpec(geojson(folder / "zone.geojson", feature(limits, [*ring, ring[0]])))


def test_limits_above_ground_follow_the_terrain(tmp_path: Path) -> None:
    found = at_slope(slope(tmp_path), zone_on_slope(tmp_path, lowerLimit="GND", upperLimit="150 m AGL"))
    terrain, strip = (shapely.union_all(list(source.polygons)) for source in found.sources)
    # The ground is at 1190 m, where the terrain begins to be solid, 190 columns east; the zone begins 150 m lower.
    assert strip.bounds[0] == pytest.approx(-1000.0, abs=90.0)
    assert strip.area == pytest.approx(2000.0**2, rel=0.02)
    assert terrain.bounds[0] == pytest.approx(-100.0, abs=80.0)
    lower = at_slope(slope(tmp_path), zone_on_slope(tmp_path, lowerLimit="GND", upperLimit="50 m AGL"))
    strip = shapely.union_all(list(lower.sources[1].polygons))
    assert strip.area == pytest.approx(2000.0 * 1600.0, rel=0.03)  # where the ground is above 1140 m


def test_limits_above_ground_are_refused_where_the_ground_is_not_known(tmp_path: Path) -> None:
    limits = {"name": "Z", "lowerLimit": "GND", "upperLimit": "120 m AGL"}
    path = geojson(tmp_path / "a.geojson", feature(limits))
    place = Place(47.005, 8.005)
    with pytest.raises(FileFault, match=r"1 part with limits above ground \(Z\).*give a terrain file too"):
        expanded([FileSpec(path)], place, AROUND, 300.0)
    assert len(expanded([FileSpec(path, ground_m=200.0)], place, AROUND, 300.0).sources[0].polygons) == 1
    assert len(expanded([FileSpec(path, ground_m=100.0)], place, AROUND, 300.0).sources[0].polygons) == 0


def test_outlines_only_grow_and_by_no_more_than_they_may() -> None:
    rng = np.random.default_rng(8)
    for _ in range(40):
        corners = rng.integers(0, 12, (70, 2)).tolist()
        cells = shapely.union_all([shapely.box(x, y, x + 1, y + 1) for x, y in corners])
        grown = simplified([each for each in shapely.get_parts(cells) if each.is_valid], 1.0)
        assert shapely.difference(cells, shapely.union_all(grown)).area < 1e-9
        assert sum(each.area for each in grown) <= 1.006 * cells.area
        assert all(each.is_valid for each in grown)


def test_outlines_are_those_of_the_cells_and_too_many_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    mask = np.random.default_rng(4).random((37, 53)) < 0.02
    squares = shapely.union_all([shapely.box(x, y, x + 1, y + 1) for y, x in np.argwhere(mask).tolist()])
    assert shapely.union_all(outlines(mask)).equals(squares)
    monkeypatch.setattr(solids, "MAX_RUNS", 15)
    with pytest.raises(InputError, match="runs of solid cells in the area; give it with larger cells"):
        outlines(mask)


def test_a_keep_in_fence_leaves_its_inside_free(tmp_path: Path) -> None:
    path = tmp_path / "a.plan"
    fence = {"polygons": [{"polygon": [[y, x] for x, y in SQUARE[:-1]], "inclusion": True}]}
    path.write_text(json.dumps({"fileType": "Plan", "geoFence": fence}))
    (polygon,) = expanded([FileSpec(path)], Place(47.005, 8.005), AROUND, 300.0).sources[0].polygons
    assert len(polygon.interiors) == 1
    assert shapely.Polygon(polygon.interiors[0]).area == pytest.approx(759.5 * 1111.9, rel=0.01)
    assert polygon.contains(shapely.Point(3000, 3000))
