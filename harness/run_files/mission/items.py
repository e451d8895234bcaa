"""Mission items as files hold them, and the mission that they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from harness.files.input_file import InputError
from harness.run_files.fences import Fences
from harness.run_files.mission import commands

SEA, HOME, GROUND = "sea", "home", "ground"
MISSION: Final = 2
"""MAV_FRAME of commands without a place. ArduPilot takes an altitude in it as above the sea; PX4 refuses it."""
FRAMES: Final = {0: SEA, 5: SEA, MISSION: SEA, 3: HOME, 6: HOME, 10: GROUND, 11: GROUND, 4: HOME, 1: HOME}
"""MAV_FRAME to what its altitude is above. Autopilots load no item to fly to in any other frame."""
LOCAL_ENU, LOCAL_NED = 4, 1
LOCAL: Final = (LOCAL_ENU, LOCAL_NED)
MOST: Final = {"command": 65_535, "frame": 255}
"""The largest numbers that MAVLink's message of a mission item has room for."""
NOWHERE: Final = 1e-7
"""Degrees, or metres: a position with less than this in both is none. ArduPilot writes zeros where none is meant."""
MOST_TOLD: Final = 10
"""Numbers of items that a note has at most."""


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
        autocontinue_off: the file says that the mission waits after it.
    """

    place: str
    number: int
    command: int
    frame: int
    params: tuple[float, ...]
    autocontinue_off: bool = False

    def __post_init__(self) -> None:
        for name, most in MOST.items():
            if not 0 <= getattr(self, name) <= most:
                raise InputError(
                    f"{self.place}: has the {name} {getattr(self, name):g}; those of MAVLink are 0 to {most}"
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


def filled(
    params: Sequence[float | None], command: int, frame: int, missing: Callable[[int], str]
) -> tuple[float, ...]:
    """Seven parameters with 0 for those that are left to the autopilot.

    Args:
        params: None where they are.
        command: MAV_CMD.
        frame: MAV_FRAME.
        missing: what a fault says of one of them that is not there, by its index.

    Raises:
        InputError: half of a place is there, or no altitude where one is needed.
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


def waiting_notes(items: Sequence[Item]) -> tuple[str, ...]:
    """What is to be said of items that are flown to and whose `autocontinue` is off."""
    numbers = [item.number for item in items if item.autocontinue_off and item.command in commands.FLOWN]
    if not numbers:
        return ()
    told = ", ".join(map(str, numbers[:MOST_TOLD])) + (", ..." if len(numbers) > MOST_TOLD else "")
    return (
        f"item{'' if len(numbers) == 1 else 's'} {told}: autocontinue is off: PX4 waits there to be told to go on; "
        "flown on, as ArduPilot does",
    )
