"""Small world files of every kind, made on the spot."""

import io
import json
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, TiffImagePlugin

from harness.world_files.kinds import read
from harness.world_files.parts import Contents, FileSpec
from tests.scenarios import scenario_of
from wayproof import Scenario

SHARED = Path(__file__).parents[4] / "shared" / "real"
"""Real files, beside the checkout; where they are not, what needs them is skipped."""

SQUARE = [[8.0, 47.0], [8.01, 47.0], [8.01, 47.01], [8.0, 47.01], [8.0, 47.0]]


def read_any(path: Path, **reading: Any) -> Contents:
    return read(FileSpec(path, **reading))


def geotiff(path: Path, heights: np.ndarray[Any, Any], corner: tuple[float, float], cell: float, epsg: int) -> Path:
    """A GeoTIFF in a projected system, its upper left corner given."""
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    for tag, kind, value in (
        (33550, 12, (cell, cell, 0.0)),
        (33922, 12, (0.0, 0.0, 0.0, *corner, 0.0)),
        (34735, 3, (1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, epsg)),
    ):
        tags.tagtype[tag] = kind
        tags[tag] = value
    tags.tagtype[42113], tags[42113] = 2, "-9999"
    Image.fromarray(heights.astype(np.float32)).save(path, tiffinfo=tags)
    return path


def feature(properties: dict[str, Any], ring: Sequence[Sequence[float]] = SQUARE) -> dict[str, Any]:
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": "Polygon", "coordinates": [[list(place) for place in ring]]},
    }


def geojson(path: Path, *features: dict[str, Any]) -> Path:
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def scenario_with(path: Path, **keys: Any) -> Scenario:
    """A scenario at 300 m, whose obstacles are those of a file."""
    obstacles = [{"file": {"path": str(path), **keys}}]
    ends = "area: {bounds_m: [0, 0, 9000, 9000]}, mission: {start_m: [999, 999], goal_m: [8000, 8000]}"
    return scenario_of(f"{{schema: wayproof/scenario/1, name: s, {ends}, obstacles: {json.dumps(obstacles)}}}")


def zipped(path: Path, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name.replace("__", "."), data)
    return path


def npy(array: np.ndarray[Any, Any]) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def osm(path: Path, ways: Sequence[tuple[dict[str, str], Sequence[tuple[float, float]]]]) -> Path:
    """An OpenStreetMap file of closed ways of (longitude, latitude)."""
    nodes, lines = [], []
    for number, (tags, ring) in enumerate(ways, 1):
        refs = [100 * number + k for k in range(len(ring))]
        nodes += [f'<node id="{ref}" lon="{x}" lat="{y}"/>' for ref, (x, y) in zip(refs, ring, strict=True)]
        inner = "".join(f'<nd ref="{ref}"/>' for ref in [*refs, refs[0]])
        inner += "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
        lines.append(f'<way id="{number}">{inner}</way>')
    path.write_text(f'<osm version="0.6">{"".join(nodes)}{"".join(lines)}</osm>')
    return path
