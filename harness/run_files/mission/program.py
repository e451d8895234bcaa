"""What a mission makes an aeroplane fly: its items are gone through as an autopilot does, jumps and all.

ArduPlane's and PX4's fixed-wing missions are the model: https://ardupilot.org/plane/docs/common-mavlink-mission-command-messages-mav_cmd.html,
https://docs.px4.io/main/en/flight_modes_fw/mission.html.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.run_files.mission import commands
from harness.run_files.mission.items import FRAMES, HOME, LOCAL, MISSION, Item, MissionAsRead
from harness.run_files.mission.steps import (
    FLOWN,
    NOT_FLOWN,
    NOT_REACHED,
    PASSED_OVER,
    Loiter,
    MissionStep,
    Program,
    Told,
)

MOST_STEPS: Final = 20_000
"""A mission whose jumps make it longer is refused."""
MOST_TURNS, MOST_LOITER_S, MOST_RADIUS_M, MOST_HEIGHT_M = 1000, 86_400.0, 50_000.0, 50_000.0
"""Beyond these an item is taken for a mistake."""
DEGREE_M: Final = 111_200.0
"""Length of a degree of latitude."""
SIDE_ALONE_M: Final = 1.0
"""A radius of 1 m or less says which way round, and no more: ArduPlane hands back 1 or -1 where it has none."""
NOT_LOADED: Final = "ArduPilot and QGroundControl load no mission with it"
BACK_MPS: Final = -2.0
"""A change to this speed, MAVLink says, goes back to that of the vehicle; to -1 changes nothing."""
AIRSPEED, GROUND_SPEED = 0, 1
"""Kinds of speed of a change of speed, its first parameter."""
FIRST: Final = "has no position, and nothing is before it"
NOTHING_BEFORE: Final = "nothing is before it"


def program(mission: MissionAsRead) -> Program:
    """Goes through a mission.

    Raises:
        InputError: a jump leads nowhere, or in a circle; a frame or a position cannot be used; or nothing is flown.
    """
    if not mission.items:
        raise InputError(f"{mission.source}: has no mission items; there is nothing to fly")
    run = _Run(mission)
    run.go()
    if len(run.steps) == 1:
        run.begin_at_home()
    if len(run.steps) < 2:
        told = f" ({run.told[run.steps[0].item].name}, item {run.steps[0].item})" if run.steps else ""
        raise InputError(
            f"{mission.source}: has {counted(len(run.steps), 'item')} to fly to{told}; a path has at least 2"
        )
    items = tuple(run.told.get(item.number) or run.not_reached(item) for item in mission.items)
    return Program(run.local, tuple(run.steps), items, mission.home_altitude_m)


class _Run:
    """A mission while it is gone through."""

    def __init__(self, mission: MissionAsRead) -> None:
        items = mission.items
        self.mission = mission
        self.steps: list[MissionStep] = []
        self.told: dict[int, Told] = {}
        self.index = {item.number: place for place, item in enumerate(items)}
        self._taken: dict[int, int] = {}  # how often each jump has been taken
        self._airspeed_mps: float | None = None
        self._closing = False  # an endless jump back was taken: the flight ends at the next step
        self._over = False
        twice = [item.number for place, item in enumerate(items) if self.index[item.number] != place]
        if twice:
            raise InputError(f"{mission.source}: item {twice[0]} is there twice; numbers must differ")
        placed = [item.frame in LOCAL for item in items if item.command in commands.FLOWN and item.position]
        self.local = any(placed)
        if self.local and not all(placed):
            raise InputError(f"{mission.source}: mixes local and global frames; must have one of both")
        self.home = (0.0, 0.0) if self.local else mission.home

    def go(self) -> None:
        """Goes through it to its end."""
        items = self.mission.items
        at, idle = 0, 0
        while at < len(items) and not self._over:
            item, before = items[at], len(self.steps)
            if item.command in (commands.JUMP, commands.JUMP_TO_TAG):
                at = self._jump(item, at)
            else:
                self._do(item)
                at += 1
            idle = 0 if len(self.steps) > before else idle + 1
            if idle > 2 * len(items):
                raise InputError(
                    f"{item.place}: item {item.number} jumps in a circle with nothing to fly in it"
                )
            if len(self.steps) > MOST_STEPS:
                raise InputError(
                    f"{item.place}: jumps make it more than {MOST_STEPS:,} legs; give fewer repeats"
                )

    def begin_at_home(self) -> None:
        """The only step is flown to from above home, at its altitude, as nothing else says where from."""
        (step,) = self.steps
        if self.home is not None and step.position not in (None, self.home) and not step.landing:
            self.steps.insert(0, MissionStep(step.item, "home", self.home, step.height_m, step.above))
            self._add(step.item, "from above home")

    def not_reached(self, item: Item) -> Told:
        """What is said of an item that is not reached, and why autopilots may not load a mission for it."""
        doubt = ""
        if item.command == commands.JUMP and item.params[0] not in self.index:
            doubt = f"to item {item.params[0]:g}, which does not exist: {NOT_LOADED}"
        elif item.command in commands.FLOWN and item.position is not None and item.frame not in FRAMES:
            doubt = f"has the frame {item.frame}: autopilots load no mission with it"
        return Told(item.number, commands.name_of(item.command), NOT_REACHED, doubt)

    def _jump(self, item: Item, at: int) -> int:
        """Where it goes on after a jump."""
        target, repeats, to = self._target(item), int(item.params[1]), f"to item {item.params[0]:g}"
        if repeats == 0:
            self._tell(item, PASSED_OVER, "is never taken")
            return at + 1
        if repeats > 0:
            done = self._taken.get(item.number, 0)
            self._taken[item.number] = done + 1
            self._tell(item, FLOWN, f"{to}, {counted(repeats, 'time')}")
            return target if done < repeats else at + 1
        first = self._first_flown(target)
        if first is not None and first.number in self.told and self.told[first.number].what == FLOWN:
            self._closing = True
            to += f" without end: flown up to item {first.number} again"
        self._tell(item, FLOWN, to)
        return target

    def _target(self, item: Item) -> int:
        wanted, told = item.params[0], f"{item.place}: item {item.number} jumps to"
        if item.command == commands.JUMP_TO_TAG:
            for place, each in enumerate(self.mission.items):
                if each.command == commands.TAG and each.params[0] == wanted:
                    return place
            raise InputError(
                f"{told} tag {wanted:g}, which no item has; must be the tag of one (600): ArduPilot would end the "
                "mission there"
            )
        if wanted not in self.index:
            raise InputError(
                f"{told} item {wanted:g}, which does not exist; must be one from {min(self.index)} to "
                f"{max(self.index)}: {NOT_LOADED}"
            )
        return self.index[int(wanted)]

    def _first_flown(self, at: int) -> Item | None:
        """The first item from a place on that is flown."""
        return next((item for item in self.mission.items[at:] if item.command in commands.FLOWN), None)

    def _do(self, item: Item) -> None:
        if item.command == commands.CHANGE_SPEED:
            self._change_speed(item)
        elif item.command in commands.WITHOUT_EFFECT:
            self._tell(item, PASSED_OVER, "no effect on the path")
        elif item.command in commands.CONDITIONS:
            self._condition(item)
        elif item.command in commands.FLOWN:
            self._fly(item)
        else:
            self._tell(item, NOT_FLOWN, commands.WHY_NOT.get(item.command, "an aeroplane here cannot"))

    def _condition(self, item: Item) -> None:
        """ArduPlane flies on and holds back what follows up to the next leg: only a change of speed is of the path."""
        for after in self.mission.items[self.index[item.number] + 1 :]:
            if after.command in commands.FLOWN:
                break
            if after.command == commands.CHANGE_SPEED:
                self._tell(item, NOT_FLOWN, f"the change of speed, item {after.number}, is not held back")
                return
        self._tell(item, PASSED_OVER, "holds back no leg")

    def _change_speed(self, item: Item) -> None:
        kind, speed = int(item.params[0]), item.params[1]
        if kind == AIRSPEED and speed > 0.0:
            self._airspeed_mps = speed
            self._tell(item, FLOWN, f"airspeed {speed:g} m/s")
        elif kind == AIRSPEED and speed == BACK_MPS:
            self._airspeed_mps = 0.0
            self._tell(item, FLOWN, "back to the airspeed before any change")
        elif speed <= 0.0:
            self._tell(item, PASSED_OVER, "changes no speed")
        else:
            told = "least ground speed" if kind == GROUND_SPEED else "climb or descent speed"
            self._tell(item, NOT_FLOWN, f"a {told} of {speed:g} m/s is not held")

    def _fly(self, item: Item) -> None:
        fly: dict[int, Callable[[Item], MissionStep | None]] = {
            commands.RETURN_TO_LAUNCH: self._return,
            commands.CONTINUE_AND_CHANGE_ALTITUDE: self._straight,
            **dict.fromkeys(commands.LOITERS, self._loiter),
            **dict.fromkeys(commands.LANDINGS, self._land),
            **dict.fromkeys(commands.TAKEOFFS, self._takeoff),
        }
        again = item.number in self.told
        step = fly.get(item.command, self._waypoint)(item)
        if step is None:
            return
        if item.frame == MISSION and step.height_m is not None and not again:
            self._add(item.number, "frame 2 says nothing of altitudes: above the sea, as ArduPilot has it")
        self.steps.append(step)
        self._airspeed_mps = None
        ends = item.command in (commands.LOITER_UNLIMITED, commands.RETURN_TO_LAUNCH, *commands.LANDINGS)
        self._over = self._closing or (ends and self._takeoff_after(item) is None)

    def _takeoff_after(self, item: Item) -> Item | None:
        """The takeoff that is the next to be flown after a landing; None where there is none."""
        if item.command not in commands.LANDINGS:
            return None
        after = self._first_flown(self.index[item.number] + 1)
        return after if after is not None and after.command in commands.TAKEOFFS else None

    def _step(self, item: Item, **more: Any) -> MissionStep:
        """A step to where an item says, at its altitude.

        ArduPilot takes a position of zeros as the present one, and an altitude of 0 with it as the present one, too.
        """
        height: float | None = _bounded(item, "is at", item.height_m, MOST_HEIGHT_M, "m")
        if item.position is None and height == 0.0 and "straight" not in more:
            height = None
        keys: dict[str, Any] = {
            "position": item.position,
            "height_m": height,
            "above": item.above if height is not None else HOME,
            "airspeed_mps": self._airspeed_mps,
        }
        return MissionStep(item.number, commands.name_of(item.command), **{**keys, **more})

    def _waypoint(self, item: Item) -> MissionStep | None:
        if item.position is None and not self.steps:
            return self._not_flown(item, FIRST)
        hold, beyond = item.params[0], item.params[2]
        why = f"held for {hold:g} s by a multicopter; an aeroplane flies on" if hold > 1.0 else ""
        if beyond:
            why = f"passing by or beyond it, {beyond:g} m, is not flown"
        if item.command == commands.SPLINE_WAYPOINT:
            why = "as a plain waypoint"
        self._tell(item, FLOWN, why)
        return self._step(item, acceptance_m=max(item.params[1], 0.0))

    def _takeoff(self, item: Item) -> MissionStep | None:
        if self.steps and self.steps[-1].landing:
            self._tell(item, FLOWN, "from the end of the approach before it, without a stop")
            return self._step(item)
        if self.steps:
            return self._not_flown(item, "in the air already")
        step = self._step(item)
        position, why = step.position or self.home, commands.TAKEOFFS[item.command]
        if position is None:
            return self._not_flown(item, "neither it nor home has a position")
        if item.command == commands.VTOL_TAKEOFF and self._is_far(position):
            position, why = self.home, f"{why}, at home: the place it names is far from there"
        self._tell(item, FLOWN, why)
        return replace(step, position=position)

    def _is_far(self, position: tuple[float, float]) -> bool:
        """Whether a place is so far from home that a vertical takeoff cannot be meant to be there."""
        if self.home is None:
            return False
        north, east = (there - here for there, here in zip(position, self.home, strict=True))
        if self.local:
            return max(abs(north), abs(east)) > MOST_RADIUS_M
        return max(abs(north), abs(math.remainder(east, 360.0))) > MOST_RADIUS_M / DEGREE_M

    def _loiter(self, item: Item) -> MissionStep | None:
        if item.position is None and not self.steps:
            return self._not_flown(item, FIRST)
        first, second, third, _ = item.params[:4]
        signed = second if item.command == commands.LOITER_TO_ALTITUDE else third
        turns: float | None = None
        time_s: float | None = None
        why = ""
        if item.command == commands.LOITER_TURNS:
            turns = _bounded(item, "loiters", max(first, 0.0), MOST_TURNS, "turns")
            why = f"{turns:g} turn{'' if turns == 1.0 else 's'}"
        elif item.command == commands.LOITER_TIME:
            time_s = _bounded(item, "loiters for", max(first, 0.0), MOST_LOITER_S, "s")
            why = f"{time_s:g} s"
        elif item.command == commands.LOITER_UNLIMITED:
            turns, why = 1.0, "one turn is flown, and the flight ends"
        radius = _bounded(item, "loiters with a radius of", abs(signed), MOST_RADIUS_M, "m")
        radius = radius if radius > SIDE_ALONE_M else 0.0
        self._tell(item, FLOWN, why)
        return self._step(item, loiter=Loiter(radius, signed >= 0.0, turns, time_s))

    def _land(self, item: Item) -> MissionStep | None:
        if item.position is None:
            self._over = True
            return self._not_flown(item, "has no position: where it lands is left to the autopilot")
        after = self._takeoff_after(item)
        on = "" if after is None else f"; then on with the takeoff, item {after.number}"
        self._tell(item, FLOWN, f"the approach, not the touchdown{on}")
        return self._step(item, landing=True)

    def _return(self, item: Item) -> MissionStep | None:
        if self.home is None or not self.steps:
            self._over = True
            return self._not_flown(item, "home has no position" if self.steps else NOTHING_BEFORE)
        self._tell(item, FLOWN, "to home at the altitude before; what follows there is not flown")
        name = commands.name_of(item.command)
        return MissionStep(item.number, name, self.home, None, HOME, airspeed_mps=self._airspeed_mps)

    def _straight(self, item: Item) -> MissionStep | None:
        if not self.steps:
            return self._not_flown(item, NOTHING_BEFORE)
        self._tell(item, FLOWN, "straight on until the altitude is reached")
        return self._step(item, position=None, straight=True)

    def _not_flown(self, item: Item, why: str) -> MissionStep | None:
        self._tell(item, NOT_FLOWN, why)
        return None

    def _tell(self, item: Item, what: str, why: str = "") -> None:
        self.told.setdefault(item.number, Told(item.number, commands.name_of(item.command), what, why))

    def _add(self, number: int, why: str) -> None:
        """Adds to what is told of an item."""
        told = self.told[number]
        self.told[number] = replace(told, why="; ".join(filter(None, (told.why, why))))


def _bounded(item: Item, verb: str, value: float, most: float, unit: str) -> float:
    """A figure of an item; one that is too large is a fault."""
    if not abs(value) <= most:
        raise InputError(
            f"{item.place}: item {item.number} {verb} {value:g} {unit}; must be at most {most:g} {unit}"
        )
    return value
