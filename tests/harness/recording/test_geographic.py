"""The map view: a flight across the antimeridian lies in one piece."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rerun as rr

from harness.cli.app import main


@pytest.mark.parametrize("longitude_deg", [179.99, -179.99, 8.0])
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
