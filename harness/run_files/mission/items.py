"""Mission items as files hold them, and the mission that they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from harness.files.input_file import InputError
from harness.run_files.fences import Fences

SEA, HOME, GROUND = "sea", "home", "ground"
FRAMES: Final = {0: SEA, 5: SEA, 3: HOME, 6: HOME, 10: GROUND, 11: GROUND, 4: HOME, 1: HOME}
"""MAV_FRAME to what its altitude is above."""

LOCAL_ENU, LOCAL_NED = 4, 1
LOCAL: Final = (LOCAL_ENU, LOCAL_NED)

MOST: Final = {"command": 65_535, "frame": 255}
"""The largest numbers that MAVLink's message of a mission item has room for."""

NOWHERE: Final = 1e-7
"""Degrees, or metres: a position with less than this in both is none. ArduPilot writes zeros where none is meant."""


@dataclass(frozen=True)
class Item:
    """One mission item.

    Attributes:
        place: where it stands, for faults: file, line or key.
        number: its number in the mission.
        command: MAV_CMD.
        frame: MAV_FRAME.
        params: the seven parameters; the last three are latitude or x, longitude or y, altitude or z. What is left to
            the autopilot is 0.
    """

    place: str
    number: int
    command: int
    frame: int
    params: tuple[float, ...]

    def __post_init__(self) -> None:
        for name, number in (("command", self.command), ("frame", self.frame)):
            if not 0 <= number <= MOST[name]:
                raise InputError(
                    f"{self.place}: has the {name} {number:g}; those of MAVLink are 0 to {MOST[name]}"
                )

    @property
    def position(self) -> tuple[float, float] | None:
        """Latitude and longitude, or east and north; None where it has none."""
        x, y = self.params[4:6]
        if self.frame == LOCAL_NED:
            x, y = y, x
        return None if max(abs(x), abs(y)) < NOWHERE and self.frame not in LOCAL else (x, y)

    @property
    def height_m(self) -> float:
        """Its altitude, above what `above` says."""
        return -self.params[6] if self.frame == LOCAL_NED else self.params[6]

    @property
    def above(self) -> str:
        """What its altitude is above.

        Raises:
            InputError: its frame is not one of those.
        """
        if self.frame not in FRAMES:
            raise InputError(
                f"{self.place}: item {self.number} has the frame {self.frame}; must be one of "
                f"{', '.join(map(str, sorted(FRAMES)))}"
            )
        return FRAMES[self.frame]


@dataclass(frozen=True)
class MissionAsRead:
    """A mission as its file has it.

    Attributes:
        source: the file, for faults.
        items: in order.
        home: its position, as that of items; None where the file has none.
        home_altitude_m: above mean sea level.
        fences: that come with it.
        notes: on what else does, a line each.
    """

    source: str
    items: tuple[Item, ...]
    home: tuple[float, float] | None
    home_altitude_m: float
    fences: Fences
    notes: tuple[str, ...] = ()
