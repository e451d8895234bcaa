"""Paths in CSV files: a header, and a point a row."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from typing import Final

from harness.files.input_file import InputError
from harness.run_files.path_as_read import PathAsRead
from harness.run_files.read_values import finite, shown

LOCAL_COLUMNS: Final = (("x_m", "y_m"), ("east_m", "north_m"))
DEGREE_COLUMNS: Final = (("latitude_deg", "longitude_deg"), ("latitude", "longitude"), ("lat", "lon"))
ALTITUDE_COLUMNS: Final = ("altitude_m", "up_m", "z_m")


def read_csv(text: str, source: str) -> PathAsRead:
    """The path of a CSV file.

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is none.
    """
    rows = csv.reader(text.splitlines())
    header = [name.strip().lower() for name in next(_rows(rows, source), [])]
    names = next((pair for pair in (*LOCAL_COLUMNS, *DEGREE_COLUMNS) if set(pair) <= set(header)), None)
    if names is None:
        raise InputError(
            f"{source}:1: has the columns {shown(', '.join(header)) or 'none'}; must have x_m,y_m or "
            "latitude_deg,longitude_deg"
        )
    heights = [name for name in header if name in ALTITUDE_COLUMNS][:1]
    columns = [header.index(name) for name in (*names, *heights)]
    positions, altitudes = [], []
    for row in _rows(rows, source):
        if not any(cell.strip() for cell in row):
            continue
        if len(row) != len(header):
            raise InputError(f"{source}:{rows.line_num}: has {len(row)} cells, the header {len(header)}")
        first, second, *altitude = (
            finite(row[column].strip(), f"{source}:{rows.line_num}: {name}")
            for name, column in zip((*names, *heights), columns, strict=True)
        )
        positions.append((first, second))
        altitudes += altitude
    return PathAsRead(names in LOCAL_COLUMNS, tuple(positions), tuple(altitudes))


def _rows(rows: Iterator[list[str]], source: str) -> Iterator[list[str]]:
    """The same rows; what the csv module does not take, as a fault of the file."""
    try:
        yield from rows
    except csv.Error as error:
        raise InputError(f"{source}: is not CSV ({error})") from error
