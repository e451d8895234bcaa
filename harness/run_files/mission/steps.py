"""What a mission makes an aeroplane fly, step by step, and what became of each of its items."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from harness.run_files.mission.items import GROUND

FLOWN: Final = "flown"
PASSED_OVER: Final = "passed over"
NOT_FLOWN: Final = "not flown"
NOT_REACHED: Final = "not reached"


@dataclass(frozen=True)
class Loiter:
    """Circles to be flown.

    Attributes:
        radius_m: of the circle; 0: the autopilot's own.
        clockwise: which way round.
        turns: how many times round; or
        time_s: how long; or neither: until the altitude is reached.
    """

    radius_m: float
    clockwise: bool
    turns: float | None = None
    time_s: float | None = None


@dataclass(frozen=True)
class MissionStep:
    """One thing that is flown.

    Attributes:
        item: the number of its item.
        name: what the item is called.
        position: latitude and longitude, or east and north; None: where the step before ends.
        height_m: altitude; None: that of the step before.
        above: what it is above: `sea`, `home` or `ground`.
        acceptance_m: how far off it may be passed; 0 where the file does not say.
        airspeed_mps: commanded from the begin of this step on; None: as before; 0: that of the flight before
            any change.
        loiter: circles about the position.
        landing: the flight ends on the way down to it.
        straight: goes straight on until the altitude is reached.
    """

    item: int
    name: str
    position: tuple[float, float] | None
    height_m: float | None
    above: str
    acceptance_m: float = 0.0
    airspeed_mps: float | None = None
    loiter: Loiter | None = None
    landing: bool = False
    straight: bool = False

    @property
    def place(self) -> complex | None:
        """A position in the plane, east + i north."""
        return None if self.position is None else complex(*self.position)


@dataclass(frozen=True)
class Told:
    """What became of an item.

    Attributes:
        item: its number.
        name: what it is called.
        what: `flown`, `passed over`, `not flown` or `not reached`.
        why: a few words, or none.
    """

    item: int
    name: str
    what: str
    why: str = ""


@dataclass(frozen=True)
class Program:
    """What a mission makes an aeroplane fly.

    Attributes:
        local: positions are east and north in metres; else latitude and longitude in degrees.
        steps: in order.
        items: what became of every item, in the order of the file.
        home_altitude_m: above mean sea level.
    """

    local: bool
    steps: tuple[MissionStep, ...]
    items: tuple[Told, ...]
    home_altitude_m: float = 0.0

    @property
    def above_ground(self) -> tuple[int, ...]:
        """Numbers of the items with an altitude above ground."""
        return tuple(dict.fromkeys(step.item for step in self.steps if step.above == GROUND))
