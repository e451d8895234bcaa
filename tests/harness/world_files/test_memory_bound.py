"""Rasters of nearly as many cells as may be: they are read within a gibibyte, whatever their format."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

ROWS, COLUMNS = 7600, 7760
MOST_MIB = 1000
"""A little below 1 GiB: what a command needs besides."""

PEAK = """
import resource, sys
from pathlib import Path
from harness.world_files.kinds import read
from harness.world_files.parts import Reading
found = read(Path(sys.argv[1]), None, Reading(2.0))
print((found.terrain or found.occupied).values.sum(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""
"""Prints the sum of the cells and the largest memory of the process, in MiB (Linux counts KiB)."""


def geotiff(dtype: str, **how: object) -> Callable[[Path], Path]:
    def write(path: Path) -> Path:
        rasterio = pytest.importorskip("rasterio")
        place = rasterio.transform.from_origin(500_000.0, 5_300_000.0, 10.0, 10.0)
        size = {"height": ROWS, "width": COLUMNS, "count": 1, "dtype": dtype}
        path = path / "a.tif"
        with rasterio.open(
            path, "w", driver="GTiff", crs="EPSG:32632", transform=place, **size, **how
        ) as file:
            for row in range(0, ROWS, 200):
                window = rasterio.windows.Window(0, row, COLUMNS, 200)
                file.write(np.full((200, COLUMNS), 500, dtype=dtype), 1, window=window)
        return path

    return write


def ascii_grid(path: Path) -> Path:
    path = path / "a.asc"
    row = b" ".join([b"500.0"] * COLUMNS) + b"\n"
    with path.open("wb") as file:
        file.write(f"ncols {COLUMNS}\nnrows {ROWS}\nxllcorner 5\nyllcorner 5\ncellsize 10\n".encode())
        for _ in range(ROWS):
            file.write(row)
    return path


def ros_map(path: Path) -> Path:
    with (path / "a.pgm").open("wb") as file:
        file.write(f"P5\n{COLUMNS} {ROWS}\n255\n".encode())
        for _ in range(ROWS):
            file.write(bytes(COLUMNS))
    text = "image: a.pgm\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (path / "a.yaml").write_text(text)
    return path / "a.yaml"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of rasterio's own
@pytest.mark.skipif(sys.platform != "linux", reason="counts memory as Linux does")
@pytest.mark.parametrize(
    ("write", "cell"),
    [
        pytest.param(geotiff("float32"), 500.0, id="as it is"),
        pytest.param(geotiff("float32", compress="deflate"), 500.0, id="compressed"),
        pytest.param(geotiff("float32", compress="deflate", ENDIANNESS="BIG"), 500.0, id="high bytes first"),
        pytest.param(geotiff("float64", compress="lzw", tiled=True, ENDIANNESS="BIG"), 500.0, id="double"),
        pytest.param(geotiff("int16", compress="deflate", blockysize=ROWS), 500.0, id="one strip"),
        pytest.param(ascii_grid, 500.0, id="text"),
        pytest.param(ros_map, 1.0, id="map"),
    ],
)
def test_a_raster_is_read_within_a_gibibyte(
    write: Callable[[Path], Path], cell: float, tmp_path: Path
) -> None:
    path = write(tmp_path)
    done = subprocess.run([sys.executable, "-c", PEAK, str(path)], capture_output=True, text=True, check=True)
    total, peak_mib = map(float, done.stdout.split())
    assert total == cell * ROWS * COLUMNS
    assert peak_mib < MOST_MIB
