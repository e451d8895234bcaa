"""Turns the items of a mission into steps that an aeroplane flies, as an autopilot does, jumps and all.

ArduPlane's and PX4's fixed-wing missions are the model: https://ardupilot.org/plane/docs/common-mavlink-mission-command-messages-mav_cmd.html,
https://docs.px4.io/main/en/flight_modes_fw/mission.html.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from harness.files.input_file import InputError
from harness.files.mavlink import commands
from harness.files.mavlink.items import FRAMES, HOME, MISSION, Item, Place
from harness.files.wording import counted
from harness.run_files.fences import Fences

FLOWN, PASSED_OVER, NOT_FLOWN, NOT_REACHED = "flown", "passed over", "not flown", "not reached"  # treatment
MOST_STEPS: Final = 20_000  # a mission that its jumps make longer than this many legs is refused
MOST_TURNS, MOST_LOITER_S, MOST_RADIUS_M, MOST_HEIGHT_M = 1000, 86_400.0, 50_000.0, 50_000.0
"""An item with a larger figure than these is taken for a mistake."""
SIDE_ALONE_M: Final = 1.0  # a smaller radius gives the side only: ArduPlane has 1 or -1 where it has none
NOT_LOADED: Final = "ArduPilot and QGroundControl load no mission with it"
BACK_MPS: Final = -2.0  # a change to this goes back to the vehicle's speed, says MAVLink; -1 changes nothing
AIRSPEED, GROUND_SPEED = 0, 1  # kinds of speed in a change of speed, its first parameter


@dataclass(frozen=True)
class Loiter:
    """A circle, flown for some turns or a time, or until the altitude is reached; radius 0: the autopilot's own."""

    radius_m: float
    clockwise: bool
    turns: float | None = None
    time_s: float | None = None


@dataclass(frozen=True)
class MissionStep:
    """One step that is flown, by the number and the name of its item.

    The position is latitude and longitude, later east and north; None: where the step before ends. The height, of the
    step before where None, is `above` `sea`, `home` or `ground`. An acceptance of 0 is not given. The airspeed is
    commanded from the begin of this step on; None: as before; 0: that of the flight before any change. A loiter circles
    about the position; a flight ends on the way down to a landing.
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

    @property
    def place(self) -> complex | None:
        """A position in the plane, east + i north."""
        return None if self.position is None else complex(*self.position)


@dataclass(frozen=True)
class ItemFate:
    """Treatment of an item, by its number and name: `flown`, `passed over`, `not flown` or `not reached`; and why."""

    item: int
    name: str
    what: str
    why: str = ""


@dataclass(frozen=True)
class Program:
    """A mission as an aeroplane flies it: its steps, and the treatment of every item, in the order of the file.

    Home is latitude and longitude, None where the file does not say; its altitude is above mean sea level.
    """

    steps: tuple[MissionStep, ...]
    items: tuple[ItemFate, ...]
    home_altitude_m: float = 0.0
    home: Place | None = None
    fences: Fences = field(default_factory=Fences)
    notes: tuple[str, ...] = ()


def program(source: str, items: Sequence[Item], home: Place | None, home_altitude_m: float, why: str = "") -> Program:
    """Makes steps of the items of a mission, whose numbers differ; `why` ends an InputError on too few to fly to."""
    if not items:
        raise InputError(f"{source}: has no mission items; there is nothing to fly{why}")
    run = _Run(items, home)
    run.go()
    if len(run.steps) < 2:
        first = f" ({run.steps[0].name}, item {run.steps[0].item})" if run.steps else ""
        number = counted(len(run.steps), "item")
        raise InputError(f"{source}: has {number} to fly to{first}; a path has at least 2{why}")
    every = tuple(run.fates.get(item.number) or run.not_reached(item) for item in items)
    return Program(tuple(run.steps), every, home_altitude_m, home)


Flown = tuple[MissionStep | None, str]  # the step that an item makes, and a remark, or why it is not flown


class _Run:
    """A mission while it is gone through."""

    def __init__(self, items: Sequence[Item], home: Place | None) -> None:
        self.items, self.home = items, home
        self.steps: list[MissionStep] = []
        self.fates: dict[int, ItemFate] = {}
        self.index = {item.number: place for place, item in enumerate(items)}
        self._taken: dict[int, int] = {}  # how often each jump has been taken since it was last counted
        self._airspeed_mps: float | None = None
        self._closing = False  # an endless jump back was taken: the flight ends at the next step
        self._has_ended = False

    def go(self) -> None:
        at, idle = 0, 0
        while at < len(self.items) and not self._has_ended:
            item, before = self.items[at], len(self.steps)
            if item.command in (commands.JUMP, commands.JUMP_TO_TAG):
                at = self._jump(item, at)
            else:
                self._execute(item)
                at += 1
            idle = 0 if len(self.steps) > before else idle + 1
            if idle > 2 * len(self.items):
                raise _fault(item, "jumps in a circle with nothing to fly in it")
            if len(self.steps) > MOST_STEPS:
                raise InputError(f"{item.place}: jumps make it more than {MOST_STEPS:,} legs; give fewer")

    def not_reached(self, item: Item) -> ItemFate:
        """Returns the treatment of an item that is not reached, and why autopilots may not load a mission for it."""
        doubt = ""
        if item.command == commands.JUMP and item.params[0] not in self.index:
            doubt = f"to item {item.params[0]:g}, which does not exist: {NOT_LOADED}"
        elif item.command in commands.FLOWN and item.position is not None and item.frame not in FRAMES:
            doubt = f"has the frame {item.frame}: autopilots load no mission with it"
        return ItemFate(item.number, commands.name_of(item.command), NOT_REACHED, doubt)

    def _target(self, jump: Item) -> tuple[int | None, str]:
        """Returns the place in the items that a jump goes to, None for no item, and that target in words."""
        wanted = jump.params[0]
        if jump.command == commands.JUMP:
            return self.index.get(int(wanted)) if wanted == int(wanted) else None, f"to item {wanted:g}"
        tags = [each.command == commands.JUMP_TAG and each.params[0] == wanted for each in self.items]
        return tags.index(True) if True in tags else None, f"to tag {wanted:g}"

    def _jump(self, item: Item, at: int) -> int:
        """Returns the place in the items after a jump: its target while it is to be taken, else the next item.

        One that was taken as often as it says is counted from 0 again: ArduPilot/ardupilot, pull request 29763.
        """
        repeats, (target, to) = int(item.params[1]), self._target(item)
        if target is None:
            among = f"must be one from {min(self.index)} to {max(self.index)}: {NOT_LOADED}"
            among = among if item.command == commands.JUMP else "must be that of a jump tag (600)"
            raise _fault(item, f"jumps {to}, which does not exist; {among}")
        if repeats == 0:
            self._note(item, PASSED_OVER, "is never taken")
            return at + 1
        if repeats > 0:
            done = self._taken.get(item.number, 0)
            self._taken[item.number] = done + 1 if done < repeats else 0
            to += f", {counted(repeats, 'time')}"
            if done == 0 and item.number in self.fates:
                del self.fates[item.number]
                to += " whenever it is reached: ArduPilot before 4.7 and PX4 pass it by later"
            self._note(item, FLOWN, to)
            return target if done < repeats else at + 1
        flown = [each.number for each in self.items[target:] if each.command in commands.FLOWN]
        if flown and flown[0] in self.fates and self.fates[flown[0]].what == FLOWN:
            self._closing = True
            self.fates.pop(item.number, None)  # taken before, when its target had not been flown
            to += f" without end: flown up to item {flown[0]} again"
        self._note(item, FLOWN, to)
        return target

    def _execute(self, item: Item) -> None:
        """Takes an item up: changes the speed, flies it, passes it over, or notes why it is not flown."""
        if item.command == commands.CHANGE_SPEED:
            self._note(item, *self._change_speed(int(item.params[0]), item.params[1]))
        elif (why := commands.WHY_NOT_AT.get((item.command, item.params[0]))) is not None:
            self._note(item, NOT_FLOWN, why)
        elif item.command in commands.WITHOUT_EFFECT:
            self._note(item, PASSED_OVER, "no effect on the path")
        elif item.command in commands.FLOWN:
            self._fly(item)
        else:
            self._note(item, NOT_FLOWN, commands.WHY_NOT.get(item.command, "it is not simulated"))

    def _change_speed(self, kind: int, speed: float) -> tuple[str, str]:
        """Returns how a speed change was treated and why; the next step takes on a true airspeed, no other speed."""
        if kind == AIRSPEED and speed > 0.0:
            self._airspeed_mps = speed
            return FLOWN, f"airspeed {speed:g} m/s"
        if kind == AIRSPEED and speed == BACK_MPS:
            self._airspeed_mps = 0.0
            return FLOWN, "back to the airspeed before any change"
        if speed <= 0.0:
            return PASSED_OVER, "changes no speed"
        name = "least ground speed" if kind == GROUND_SPEED else "climb or descent speed"
        return NOT_FLOWN, f"a {name} of {speed:g} m/s is not held"

    def _fly(self, item: Item) -> None:
        """Adds the step of an item, or notes why it is not flown; notes whether the mission ends with it."""
        fly: dict[int, Callable[[Item], Flown]] = {
            commands.RETURN_TO_LAUNCH: self._return,
            **dict.fromkeys(commands.LOITERS, self._loiter),
            **dict.fromkeys(commands.LANDINGS, self._land),
            **dict.fromkeys(commands.TAKEOFFS, self._takeoff),
        }
        step, why = fly.get(item.command, self._waypoint)(item)
        ends = item.command in (commands.LOITER_UNLIMITED, commands.RETURN_TO_LAUNCH, *commands.LANDINGS)
        if step is None:
            self._note(item, NOT_FLOWN, why)
            self._has_ended = ends and item.command != commands.LOITER_UNLIMITED
            return
        if item.frame == MISSION and step.height_m is not None:
            why += "; " if why else ""
            why += "frame 2 says nothing of altitudes: above the sea, as ArduPilot has it"
        self._note(item, FLOWN, why)
        self.steps.append(replace(step, airspeed_mps=self._airspeed_mps))
        self._airspeed_mps = None
        self._has_ended = self._closing or ends

    def _step(self, item: Item, **more: Any) -> MissionStep:
        """Makes a step to an item's place; as with ArduPilot, zeros mean the present place, then 0 that altitude."""
        height: float | None = _check_bound(item, "is at", item.params[6], MOST_HEIGHT_M, "m")
        if item.position is None and height == 0.0:
            height = None
        above = item.above if height is not None else HOME
        return MissionStep(item.number, commands.name_of(item.command), item.position, height, above, **more)

    def _waypoint(self, item: Item) -> Flown:
        if item.position is None and not self.steps:
            return None, "has no position, and nothing is before it"
        hold, beyond = item.params[0], item.params[2]
        why = [f"held for {hold:g} s by a multicopter; an aeroplane flies on"] if hold > 1.0 else []
        why += [f"passing by or beyond it, {beyond:g} m, is not flown"] if beyond else []
        why += ["as a plain waypoint"] if item.command == commands.SPLINE_WAYPOINT else []
        return self._step(item, acceptance_m=max(item.params[1], 0.0)), "; ".join(why)

    def _takeoff(self, item: Item) -> Flown:
        step = self._step(item)
        if self.steps:
            return None, "in the air already"
        if (position := step.position or self.home) is None:
            return None, "neither it nor home has a position"
        return replace(step, position=position), commands.TAKEOFFS[item.command]

    def _loiter(self, item: Item) -> Flown:
        """Returns the step of a loiter by turns, by time, to an altitude, or for ever (one turn); None: no place."""
        if item.position is None and not self.steps:
            return None, "has no position, and nothing is before it"
        first, second, third, _ = item.params[:4]
        signed = second if item.command == commands.LOITER_TO_ALTITUDE else third
        radius = _check_bound(item, "loiters with a radius of", abs(signed), MOST_RADIUS_M, "m")
        circle, why = Loiter(radius if radius > SIDE_ALONE_M else 0.0, signed >= 0.0), ""
        if item.command == commands.LOITER_TURNS:
            turns = _check_bound(item, "loiters", max(first, 0.0), MOST_TURNS, "turns")
            circle, why = replace(circle, turns=turns), f"{turns:g} turn{'' if turns == 1.0 else 's'}"
        elif item.command == commands.LOITER_TIME:
            time_s = _check_bound(item, "loiters for", max(first, 0.0), MOST_LOITER_S, "s")
            circle, why = replace(circle, time_s=time_s), f"{time_s:g} s"
        elif item.command == commands.LOITER_UNLIMITED:
            circle, why = replace(circle, turns=1.0), "one turn is flown, and the flight ends"
        return self._step(item, loiter=circle), why

    def _land(self, item: Item) -> Flown:
        if item.position is None:
            return None, "has no position: where it lands is left to the autopilot"
        return self._step(item, landing=True), "the approach, not the touchdown"

    def _return(self, item: Item) -> Flown:
        if self.home is None or not self.steps:
            return None, "home has no position" if self.steps else "nothing is before it"
        step = MissionStep(item.number, commands.name_of(item.command), self.home, None, HOME)
        return step, "to home at the altitude before; what follows there is not flown"

    def _note(self, item: Item, what: str, why: str = "") -> None:
        self.fates.setdefault(item.number, ItemFate(item.number, commands.name_of(item.command), what, why))


def _fault(item: Item, sentence: str) -> InputError:
    return InputError(f"{item.place}: item {item.number} {sentence}")


def _check_bound(item: Item, verb: str, value: float, most: float, unit: str) -> float:
    if not abs(value) <= most:
        raise _fault(item, f"{verb} {value:g} {unit}; must be at most {most:g} {unit}")
    return value
