"""Paths in CSV files: a header, and a point a row."""

from __future__ import annotations

import csv
from typing import Final

from harness.files.input_file import InputError
from harness.run_files.path_as_read import PathAsRead, finite, shown

LOCAL: Final = (("x_m", "y_m"), ("east_m", "north_m"))
"""Columns of a place in the local plane."""
DEGREES: Final = (("latitude_deg", "longitude_deg"), ("latitude", "longitude"), ("lat", "lon"))
"""Columns of a place in degrees."""
ALTITUDES: Final[tuple[str, ...]] = ("altitude_m", "up_m", "z_m")
"""Columns of an altitude above mean sea level."""
ABOVE_GROUND: Final = "altitude_agl_m"
"""Column of an altitude above ground."""
MOST_NAMED: Final = 4


def read_csv(text: str, source: str) -> PathAsRead:
    """The path of a CSV file; blank lines, and comments after #, may stand before the header.

    Raises:
        InputError: it is none.
    """
    filled = _filled(text, source)
    line, header = filled[0] if filled else (1, [])
    header = [name.strip().lower() for name in header]
    names, heights = _columns(header, f"{source}:{line}")
    wanted = (*names, *heights)
    found = [_numbers(row, header, wanted, f"{source}:{number}") for number, row in filled[1:]]
    return PathAsRead(
        names in LOCAL,
        tuple((row[0], row[1]) for row in found),
        tuple(row[2] for row in found if heights),
        above_ground=heights == [ABOVE_GROUND],
        notes=_passed_over([name for name in header if name not in wanted]),
    )


def _columns(header: list[str], where: str) -> tuple[tuple[str, str], list[str]]:
    """The columns of the place, and that of the altitude where there is one."""
    names = next((pair for pair in (*LOCAL, *DEGREES) if set(pair) <= set(header)), None)
    if names is None:
        raise InputError(
            f"{where}: has the columns {shown(', '.join(header)) or 'none'}; must have x_m,y_m or "
            "latitude_deg,longitude_deg, and may have altitude_m or altitude_agl_m, parted by commas"
        )
    heights = [name for name in (*ALTITUDES, ABOVE_GROUND) if name in header][:1]
    for name in (*names, *heights):
        if header.count(name) > 1:
            raise InputError(f"{where}: {name}: stands {header.count(name)} times; must stand once")
    return names, heights


def _filled(text: str, source: str) -> list[tuple[int, list[str]]]:
    """The rows that are neither blank nor a comment, with their lines."""
    lines = ["" if line.lstrip().startswith("#") else line for line in text.splitlines()]
    rows = csv.reader(lines)
    try:
        return [(rows.line_num, row) for row in rows if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise InputError(f"{source}: is not CSV ({error})") from error


def _numbers(row: list[str], header: list[str], wanted: tuple[str, ...], where: str) -> list[float]:
    if len(row) != len(header):
        raise InputError(f"{where}: has {len(row)} cells, the header {len(header)}")
    cells = dict(zip(header, row, strict=True))
    return [finite(cells[name].strip(), f"{where}: {name}") for name in wanted]


def _passed_over(columns: list[str]) -> tuple[str, ...]:
    """What is to be said of columns that are not read."""
    if not columns:
        return ()
    named = ", ".join(shown(name) or "one without a name" for name in columns[:MOST_NAMED])
    more = f" and {len(columns) - MOST_NAMED} more" if len(columns) > MOST_NAMED else ""
    return (f"columns passed over: {named}{more}",)
