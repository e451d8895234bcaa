"""Paths in CSV files: a header, and a point a row."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from typing import Final, NamedTuple

from harness.files.input_file import InputError
from harness.run_files.path_as_read import PathAsRead
from harness.run_files.read_values import finite, shown

LOCAL_COLUMNS: Final = (("x_m", "y_m"), ("east_m", "north_m"))
DEGREE_COLUMNS: Final = (
    ("latitude_deg", "longitude_deg"), ("latitude", "longitude"), ("lat", "lon"), ("lat", "lng"), ("lat", "long"),
    ("lat_deg", "lon_deg"),
)  # fmt: skip
ALTITUDE_COLUMNS: Final = ("altitude_m", "up_m", "z_m")
"""Altitudes above mean sea level by our own names."""
ALTITUDE_WORDS: Final = frozenset(("alt", "altitude", "ele", "elevation", "agl", "msl", "amsl", "z"))
METRES, FEET = frozenset(("m", "metres", "meters", "metre", "meter")), frozenset(("ft", "feet"))
SEA, GROUND = frozenset(("msl", "amsl")), frozenset(("agl",))
FOOT_M: Final = 0.3048
DELIMITERS: Final = (",", ";", "\t")
COMMENT: Final = "#"
MOST_NAMED: Final = 4


class AltitudeColumn(NamedTuple):
    """The column of the altitudes.

    Attributes:
        name: in the header.
        unit_m: length of its unit.
        above_ground: they are above the ground.
        noted: that they are above the sea, and metres, is not what the name says.
    """

    name: str
    unit_m: float = 1.0
    above_ground: bool = False
    noted: bool = False

    @property
    def note(self) -> str:
        """What is taken for granted; empty where its name says it."""
        unit, above = "feet" if self.unit_m != 1.0 else "metres", "ground" if self.above_ground else "sea"
        return f"{shown(self.name)}: taken as {unit} above the {above}" if self.noted else ""


def read_csv(text: str, source: str) -> PathAsRead:
    """The path of a CSV file, of whatever delimiter; lines before the header may be blank, or comments after #.

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is none.
    """
    lines = ["" if line.lstrip().startswith(COMMENT) else line for line in text.splitlines()]
    delimiter = _delimiter(next((line for line in lines if line.strip()), ""))
    rows = csv.reader(lines, delimiter=delimiter)
    filled = (row for row in _rows(rows, source) if any(cell.strip() for cell in row))
    header = [name.strip().lower() for name in next(filled, [])]
    names = next((pair for pair in (*LOCAL_COLUMNS, *DEGREE_COLUMNS) if set(pair) <= set(header)), None)
    if names is None:
        raise InputError(
            f"{source}:{max(rows.line_num, 1) if header else 1}: has the columns "
            f"{shown(', '.join(header)) or 'none'}; must have x_m,y_m or latitude_deg,longitude_deg"
        )
    height = altitude_column(header)
    wanted = (*names, *((height.name,) if height else ()))
    columns = [header.index(name) for name in wanted]
    positions, altitudes = [], []
    for row in filled:
        if len(row) != len(header):
            raise InputError(f"{source}:{rows.line_num}: has {len(row)} cells, the header {len(header)}")
        cells = [row[column].strip() for column in columns]
        if delimiter != ",":
            cells = [cell.replace(",", ".") for cell in cells]
        first, second, *altitude = (
            finite(cell, f"{source}:{rows.line_num}: {name}")
            for cell, name in zip(cells, wanted, strict=True)
        )
        positions.append((first, second))
        altitudes += [each * height.unit_m for each in altitude] if height else []
    return PathAsRead(
        names in LOCAL_COLUMNS,
        tuple(positions),
        tuple(altitudes),
        above_ground=bool(height and height.above_ground),
        notes=_notes(header, wanted, height),
    )


def _delimiter(line: str) -> str:
    """What stands between the cells of a header."""
    return next((each for each in DELIMITERS if each in line), ",")


def altitude_column(header: list[str]) -> AltitudeColumn | None:
    """The column of the altitudes: ours, else the first whose name says so."""
    own = next((name for name in header if name in ALTITUDE_COLUMNS), None)
    if own is not None:
        return AltitudeColumn(own)
    for name in header:
        words = set(re.findall(r"[a-z]+", name))
        if words & ALTITUDE_WORDS and not words - ALTITUDE_WORDS - METRES - FEET:
            unit_m = FOOT_M if words & FEET else 1.0
            above_ground = bool(words & GROUND)
            told = bool(words & (METRES | FEET)) and bool(words & (SEA | GROUND))
            return AltitudeColumn(name, unit_m, above_ground, not told)
    return None


def _notes(header: list[str], wanted: tuple[str, ...], height: AltitudeColumn | None) -> tuple[str, ...]:
    """What is taken for granted, and what is passed over."""
    notes = [height.note] if height is not None and height.noted else []
    others = [shown(name) or "one without a name" for name in header if name not in wanted]
    if others:
        more = f" and {len(others) - MOST_NAMED} more" if len(others) > MOST_NAMED else ""
        notes.append(f"columns passed over: {', '.join(others[:MOST_NAMED])}{more}")
    return tuple(notes)


def _rows(rows: Iterator[list[str]], source: str) -> Iterator[list[str]]:
    """The same rows; what the csv module does not take, as a fault of the file."""
    try:
        yield from rows
    except csv.Error as error:
        raise InputError(f"{source}: is not CSV ({error})") from error
