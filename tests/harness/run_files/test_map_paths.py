"""Paths of maps, GPS tools and gliders' loggers."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from harness.run_files.path_files import read_path
from tests.harness.run.given import written
from tests.harness.run_files.test_paths_io import refused

LINE = "8.0,47.0,500 8.01,47.01,520\n 8.03,47.02,540"
SQUARE = "8,47,9 8.01,47,9 8.01,47.01,9 8,47.01,9 8,47,9"


def kml(line: str = LINE, mode: str = "absolute", more: str = "") -> str:
    drawn = f"<LineString><altitudeMode>{mode}</altitudeMode><coordinates>{line}</coordinates></LineString>"
    return (
        '<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2" '
        'xmlns:gx="http://www.google.com/kml/ext/2.2"><Document><Folder>'
        f"<Placemark><name>way</name>{drawn}</Placemark>{more}</Folder></Document></kml>"
    )


ZONE = (
    "<Placemark><name>zone</name><Polygon><outerBoundaryIs><LinearRing><coordinates>"
    f"{SQUARE}</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>"
)


def gpx(body: str) -> str:
    return f'<?xml version="1.0"?><gpx xmlns="http://www.topografix.com/GPX/1/1" version="1.1">{body}</gpx>'


def point(tag: str, latitude: float, height: str = "<ele>500</ele>") -> str:
    return f'<{tag} lat="{latitude}" lon="8.0">{height}</{tag}>'


SEGMENT = f"<trkseg>{point('trkpt', 47.0)}{point('trkpt', 47.1)}</trkseg>"


def igc(*fixes: str) -> str:
    return "\n".join(("AXXX001", "HFDTE160516", *fixes)) + "\n"


FLIGHT = [
    "B1200005049413N00611520EA0013000195",  # stands
    "B1200045049413N00611520EA0013000195",
    "B1200085049513N00611520EA0013500200",  # 46 m/s
    "B1200125049613N00611520EA0014000205",
    "B1200165049613N00611520EA0014000205",  # stands
]

# A paraglider at 10 m/s.
GLIDE = [f"B1200{n:02}46{49000 + 27 * n // 5}N00611520EA00000{300 - n:05}" for n in range(0, 40, 10)]


def kmz(files: dict[str, str | bytes]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return packed.getvalue()


@pytest.mark.parametrize("name", ["a.kmz", "a.KMZ", "a.kml"])
def test_a_line_of_kmz_is_that_of_its_kml(name: str, tmp_path: Path) -> None:
    """An archive called .kml is one, too; what macOS adds to archives has the endings of files and no content."""
    path = tmp_path / name
    more = ZONE + "<Placemark><Point><coordinates>8,47</coordinates></Point></Placemark>"
    path.write_bytes(kmz({"__MACOSX/._line.kml": b"\0", "._a.kml": b"\0", "line.kml": kml(more=more)}))
    given = read_path(path)
    assert (given.origin_deg, given.altitudes_m.tolist()) == ((47.0, 8.0), [500.0, 520.0, 540.0])
    assert given.notes == ("1 Point beside the path passed over", "1 Polygon beside the path passed over")
    path.write_text(kml())
    assert read_path(path).altitudes_m.tolist() == [500.0, 520.0, 540.0]
    path.write_text(kml(mode="relativeToGround"))
    assert read_path(path).above_ground


def locked() -> bytes:
    data = bytearray(kmz({"doc.kml": kml()}))
    data[6] |= 1
    data[data.index(b"PK\1\2") + 8] |= 1
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (kmz({"a.kml": kml(), "b.kml": kml()}), ": is a ZIP archive with 2 .kml files (a.kml, b.kml); must have one"),
        (kmz({"image.png": b"1"}), ": is a ZIP archive without a .kml file"),
        (kmz({"doc.kml": kml()})[:-9], ": is a damaged ZIP archive; get it again"),
        (kmz({"doc.kml": b" " * 64_000_001}), ": unpacks to more than 64 MB; must be one .kml file"),
        (locked(), ": is a ZIP archive that cannot be unpacked (File 'doc.kml' is encrypted, password required for"),
        (kmz({"doc.kml": b"\0"}), " (doc.kml):1: is not whole XML"),
        (kmz({"doc.kml": kml()[:-20]}), " (doc.kml):2: is not whole XML"),
        (kmz({"doc.kml": kml("8,47,5 8.1,far,5")}), " (doc.kml): way: point 1: is 'far'; must be a finite number"),
        (b"PK\3\4", ": is a damaged ZIP archive; get it again"),
    ],
)  # fmt: skip
def test_says_what_is_wrong_with_a_kmz(data: bytes, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "a.kmz"
    path.write_bytes(data)
    assert refused(path).startswith(f"{path}{sentence}")


ROUTE = f"<rte>{point('rtept', 46.0)}{point('rtept', 46.1)}</rte>"
MODE = "altitudes passed over: their altitudeMode is "
GNSS, GROUND = "GNSS altitudes of the logger taken as above the sea", "2 B records on the ground not flown"
PRESSURE = GNSS.replace("GNSS", "pressure")
TORN = "1 B record that cannot be read passed over"
JOINED = "2 segments of the track joined by straight lines"


@pytest.mark.parametrize(
    ("name", "text", "altitudes", "notes"),
    [
        ("a.kml", kml(mode="clampToGround"), [], (f"{MODE}clampToGround",)),
        ("a.kml", kml().replace("<altitudeMode>absolute</altitudeMode>", ""), [], (f"{MODE}clampToGround",)),
        ("a.kml", kml(mode="relativeToSeaFloor"), [], (f"{MODE}relativeToSeaFloor",)),
        ("a.gpx", gpx(f"{point('wpt', 45.0)}{ROUTE}<trk>{SEGMENT}{SEGMENT}</trk>"), [500.0] * 4,
            (JOINED, "1 route beside the path passed over", "1 waypoint beside the path passed over")),
        ("a.gpx", gpx(ROUTE.replace("<ele>500</ele>", "")), [], ()),
        ("a.igc", igc(*FLIGHT), [195.0, 200.0, 205.0], (GNSS, GROUND)),
        ("a.igc", igc(*FLIGHT) + "LXXXpilot M\u00fcller\n", [195.0, 200.0, 205.0], (GNSS, GROUND)),
        ("a.igc", igc(*GLIDE), [300.0, 290.0, 280.0, 270.0], (GNSS,)),
        ("a.igc", igc(*(f"B11{n:02}00{FLIGHT[0][7:]}" for n in range(30)), *FLIGHT, "B12"), None, (TORN,)),
        ("a.igc", igc(*(fix[:-5] + "00000" for fix in FLIGHT)), [130.0, 135.0, 140.0], (PRESSURE, GROUND)),
    ],
)  # fmt: skip
def test_altitudes_and_what_is_passed_over_are_those_of_the_file(
    name: str, text: str, altitudes: list[float] | None, notes: tuple[str, ...], tmp_path: Path
) -> None:
    """A recorded flight begins and ends in the air, and a name in Latin-1 refuses none."""
    (tmp_path / name).write_bytes(text.encode("latin-1"))
    given = read_path(tmp_path / name)
    assert altitudes in (None, given.altitudes_m.tolist())
    assert set(notes) == set(given.notes) or (altitudes is None and set(notes) < set(given.notes))
    assert not given.above_ground


def test_a_flight_of_a_logger_without_a_barometer_is_not_flown_at_the_sea(tmp_path: Path) -> None:
    path = tmp_path / "a.igc"
    lost = [fix[:25] + "00000" + fix[30:] for fix in FLIGHT]  # no pressure altitude, as of a telephone
    lost[2] = lost[2][:24] + "V0000000000"  # no three-dimensional fix
    path.write_text(igc(*lost))
    found = read_path(path)
    assert found.altitudes_m.tolist() == [195.0, 205.0]
    assert len(found.points_m) == 2
    assert "1 B record without an altitude passed over: the logger has no barometer" in found.notes
    path.write_text(igc(*(fix[:24] + "V0000000000" for fix in FLIGHT)))
    found = read_path(path)
    assert (len(found.points_m), found.altitudes_m.tolist()) == (3, [])
    assert "its logger has no altitudes" in found.notes


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("a.kml", kml(more="<Placemark><name>other</name><LineString/></Placemark>"), ": has 2 lines (way, other)"),
        ("a.kml", kml(more="<gx:MultiTrack/>"), ": has gx:MultiTrack, which is not read"),
        ("a.kml", kml(more="<Placemark><gx:Track/></Placemark>"), ": has gx:Track, which is not read; save it"),
        ("a.kml", kml().replace("<coord", "<gx:altitudeOffset>9</gx:altitudeOffset><coord"), ": has gx:altitudeOffset"),
        ("a.kml", kml("8,47 8.1"), ": way: point 1: is '8.1'; must be longitude,latitude[,altitude]"),
        ("a.kml", kml("8,47,5 8.1,47"), ": way: has an altitude at 1 of 2 points"),
        ("a.kml", kml("8,47,5 8.1,far,5"), ": way: point 1: is 'far'; must be a finite number"),
        ("a.kml", kml()[:-20], ":2: is not whole XML"),
        ("a.kml", gpx(""), ": is gpx; must be KML"),
        ("a.kml", kml(more=ZONE.replace("outerBoundaryIs", "x")), ": zone: is a Polygon without a boundary"),
        ("a.kml", '<!DOCTYPE kml [<!ENTITY a "b">]>' + kml(), ": declares a document type or XML entities"),
        ("a.gpx", gpx(""), ": has 0 routes; must have exactly one"),
        ("a.gpx", gpx(f"<trk>{SEGMENT}</trk><trk>{SEGMENT}</trk>"), ": has 2 tracks; must have exactly one"),
        ("a.gpx", gpx('<trk><trkseg><trkpt lat="47"/></trkseg></trk>'), ": trkpt 0: lon: is missing, or null"),
        ("a.gpx", gpx(f"<trk><trkseg>{point('trkpt', 47, '')}{point('trkpt', 48)}</trkseg></trk>"), "at 1 of 2 points"),
        ("a.igc", "B1200005049413N00611520EA0013000195\n", ":1: must begin with an A record"),
        ("a.igc", igc(), ": has 0 fixes, none of them in flight"),
        ("a.igc", "AXXX001\n" + FLIGHT[0] + "\n", ": has no date (an HFDTE record); must have one"),
        ("a.igc", igc(*FLIGHT[:2]), ": has 2 fixes, none of them in flight"),
        ("a.igc", igc(*FLIGHT, "B12x"), ": has 1 B record that cannot be read, of 6; must be at most 5%"),
    ],
)  # fmt: skip
def test_says_what_is_wrong(name: str, text: str, sentence: str, tmp_path: Path) -> None:
    path = written(tmp_path / name, text)
    said = refused(path)
    assert said.startswith(f"{path}:")
    assert sentence in said


def test_a_fix_that_no_glider_gets_to_is_passed_over(tmp_path: Path) -> None:
    """One fix is 70 km off, another 8 km too high: errors of the receiver, which were flown to and back."""
    fixes = [
        f"B10{k // 15:02}{k % 15 * 4:02}47{round(k * 0.0006 * 60000):05}N00800000EA005{k:02}005{k:02}"
        for k in range(60)
    ]
    path = written(tmp_path / "a.igc", igc(*fixes))
    whole = read_path(path)
    assert len(whole.points_m) == 60
    fixes[20] = fixes[20].replace("N00800000E", "N00900000E")
    fixes[40] = fixes[40][:-5] + "09000"
    path.write_text(igc(*fixes))
    found = read_path(path)
    assert len(found.points_m) == 58
    assert np.ptp(found.points_m[:, 0]) < 1.0
    assert found.altitudes_m.max() < 600.0
    assert "2 B records too far from both neighbours passed over" in found.notes
    assert not any("neighbours" in note for note in whole.notes)
