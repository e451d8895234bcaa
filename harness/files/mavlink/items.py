"""Mission items as files hold them, and plain-text files of them: "QGC WPL" (.waypoints, .txt).

The format: https://mavlink.io/en/file_formats/#mission_plain_text_file
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from harness.files.input_file import InputError, finite, whole
from harness.files.mavlink import commands

SEA, HOME, GROUND = "sea", "home", "ground"
MISSION: Final = 2
"""MAV_FRAME of commands without a place. ArduPilot takes an altitude in it as above the sea; PX4 refuses it."""
FRAMES: Final = {0: SEA, 5: SEA, MISSION: SEA, 3: HOME, 6: HOME, 10: GROUND, 11: GROUND}
"""MAV_FRAME to what its altitude is above. Autopilots load no item to fly to in any other global frame."""
NOWHERE_DEG: Final = 1e-7
"""A position with less than this in both is none. ArduPilot writes zeros where none is meant."""
WPL: Final = "QGC WPL"
CELLS: Final = 12
COMMENT: Final = "#"


@dataclass(frozen=True)
class Item:
    """One mission item."""

    place: str
    """Its place for messages: file, and line or key."""
    number: int
    """Its number in the mission."""
    command: int
    """Its command, a number of MAV_CMD."""
    frame: int
    """Its frame, a number of MAV_FRAME."""
    params: tuple[float, ...]
    """Its seven parameters, the last three latitude, longitude, altitude; 0 for one that is left to the autopilot."""
    autocontinue_off: bool = False
    """Whether the autopilot waits after this item to be told to go on."""

    def __post_init__(self) -> None:
        for name, value, most in (("command", self.command, 65_535), ("frame", self.frame, 255)):
            if not 0 <= value <= most:
                raise InputError(f"{self.place}: has the {name} {value:g}; those of MAVLink are 0 to {most}")

    @property
    def position(self) -> tuple[float, float] | None:
        """Latitude and longitude; None where it has none."""
        latitude, longitude = self.params[4:6]
        return None if max(abs(latitude), abs(longitude)) < NOWHERE_DEG else (latitude, longitude)

    @property
    def above(self) -> str:
        """The datum of its altitude; an InputError says that its frame has none."""
        if self.frame not in FRAMES:
            raise InputError(
                f"{self.place}: item {self.number} has the frame {self.frame}; must be one of "
                f"{', '.join(map(str, sorted(FRAMES)))} (a path in local metres can be given as CSV)"
            )
        return FRAMES[self.frame]


def filled(
    params: Sequence[float | None], command: int, frame: int, missing: Callable[[int], str]
) -> tuple[float, ...]:
    """Seven parameters with 0 in place of None for those that are left to the autopilot.

    An InputError says that half of a place is there, or no altitude where one is needed; what it says of the parameter
    is told by its index.
    """
    latitude, longitude, altitude = params[4:7]
    if command in commands.FLOWN and (latitude is None) != (longitude is None):
        raise InputError(f"{missing(4 if latitude is None else 5)}; a place must have latitude and longitude")
    needed = command in commands.AT_AN_ALTITUDE
    needed |= command in commands.LOITERS and latitude is not None
    needed |= command in commands.LANDINGS and FRAMES.get(frame) != HOME
    if altitude is None and needed:
        raise InputError(f"{missing(6)}; a {commands.name_of(command)} must have an altitude")
    return tuple(0.0 if value is None else value for value in params)


def wpl_items(text: str, source: str) -> list[Item]:
    """The items of a plain-text file, home among them; lines after # are comments. `source` begins an InputError."""
    where = f"{source}:" if source else "line "
    rows = [(f"{where}{number}", line.split()) for number, line in enumerate(text.splitlines(), start=1)]
    return [_item(cells, place) for place, cells in rows[1:] if cells and not cells[0].startswith(COMMENT)]


def _item(cells: list[str], place: str) -> Item:
    if len(cells) != CELLS:
        raise InputError(f"{place}: has {len(cells)} fields; a mission item has {CELLS}")
    number, frame, command = (whole(cells[field], place) for field in (0, 2, 3))
    # What is left to the autopilot is 0, or no number; the first parameter is field 5, counted from 1.
    given = [None if cell.lower() == "nan" else finite(cell, place) for cell in cells[4:11]]
    params = filled(given, command, frame, lambda index: f"{place}: field {5 + index} is nan")
    return Item(place, number, command, frame, params, finite(cells[11], place) == 0.0)
