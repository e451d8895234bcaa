"""The map view: a flight across the antimeridian lies in one piece."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rerun as rr

from harness.cli.app import main
from tests.longer import longer


@pytest.mark.parametrize("longitude_deg", [179.99, *longer([-179.99, 8.0])])
def test_no_line_leads_round_the_earth(longitude_deg: float, tmp_path: Path) -> None:
    world = tmp_path / "a.yaml"
    world.write_text(
        "schema: wayproof/scenario/1\nname: a\n"
        "area: {bounds_m: [-3000, -2000, 3000, 2000], "
        f"origin: {{latitude_deg: -17.0, longitude_deg: {longitude_deg}}}}}\n"
        "obstacles: [{circle: {center_m: [0, 100], radius_m: 900}}]\n"
        "mission: {start_m: [-2500, 0], goal_m: [2500, 0]}\n"
    )
    assert main(["fly", str(world), "--out", str(tmp_path / "run"), "--quiet"]) == 0
    logged: dict[str, list[float]] = {}
    for chunk in rr.chunk.RrdReader(str(tmp_path / "run" / "flight.rrd")).stream():
        path = str(chunk.entity_path)
        for name, column in chunk.to_record_batch().to_pydict().items():
            if path.startswith("/map/") and name.rpartition(":")[2] in ("line_strings", "positions"):
                logged.setdefault(path, []).extend(np.array(_flat(column)).reshape(-1, 2)[:, 1].tolist())
    assert {"/map/bounds", "/map/goal", "/map/outlines", "/map/track", "/map/ends"} <= logged.keys()
    for path, longitudes in logged.items():
        off = np.array(longitudes) - longitude_deg
        assert np.abs(off).max() < 0.05, path
    assert np.ptp(logged["/map/bounds"]) == pytest.approx(
        6000.0 / 111_320.0 / np.cos(np.radians(17.0)), rel=0.01
    )


def _flat(cells: object) -> list[float]:
    """All numbers in nested lists."""
    if isinstance(cells, list | tuple):
        return [number for each in cells for number in _flat(each)]
    return [] if cells is None else [float(cells)]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("latitude_deg", "size_m"), [(-16.8, (12e3, 8e3)), (69.0, (100e3, 140e3)), (0.0, (500.0, 400.0))]
)
def test_the_map_opens_on_the_whole_area(
    latitude_deg: float, size_m: tuple[float, float], tmp_path: Path
) -> None:
    """The zoom is that at which the area fits into the view, and at half as much more it would not."""
    east, north = size_m[0] / 2, size_m[1] / 2
    world = tmp_path / "a.yaml"
    world.write_text(
        "schema: wayproof/scenario/1\nname: a\n"
        f"area: {{bounds_m: [{-east}, {-north}, {east}, {north}], "
        f"origin: {{latitude_deg: {latitude_deg}, longitude_deg: 179.99}}}}\n"
        f"mission: {{start_m: [-200, 0], goal_m: [200, 0], goal_radius_m: 20, time_limit_s: 30}}\n"
    )
    main(["fly", str(world), "--out", str(tmp_path / "run"), "--quiet"])
    reader = rr.chunk.RrdReader(str(tmp_path / "run" / "flight.rrd"))
    (store,) = reader.blueprints()
    cells = [chunk.to_record_batch().to_pydict() for chunk in reader.stream(store=store)]
    (zoom,) = [each["MapZoom:zoom"][0][0] for each in cells if "MapZoom:zoom" in each]
    # OpenStreetMap: the equator is 256 pixels long at level 0, and twice as long at each level on.
    pixel_m = 2 * np.pi * 6378137.0 * np.cos(np.radians(latitude_deg)) / 256 / 2**zoom
    width, height = size_m[0] / pixel_m, size_m[1] / pixel_m
    assert width < 410
    assert height < 300
    assert max(width / 410, height / 300) > 1 / 1.5
