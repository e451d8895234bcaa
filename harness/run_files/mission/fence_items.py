"""Fences and rally points that stand among the items of a mission, as autopilots exchange them.

Fences and rally points are lists of items of their own (https://mavlink.io/en/services/mission.html#mission_types);
files that ground stations write may hold them together with the mission.
"""

from __future__ import annotations

from collections.abc import Sequence

from harness.files.fence_commands import CIRCLES, CORNERS, HOME_CIRCLE, RALLY_POINT
from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.run_files.fences import Fence, Fences
from harness.run_files.mission.items import Item


def fences_of(items: Sequence[Item], home: tuple[float, float] | None) -> Fences:
    """The fences among some items, in degrees. An aircraft must be inside of all inclusion fences, as ArduPilot has it.

    Raises:
        InputError: one has fewer corners than it says, or a circle has no radius or no place.
    """
    found: list[Fence] = []
    corners: list[Item] = []
    for item in (each for each in items if each.command in (*CORNERS, *CIRCLES)):
        if corners and item.command != corners[0].command:
            raise _torn(corners)
        if item.command in CIRCLES:
            found.append(_circle(item, home))
            continue
        corners.append(item)
        if len(corners) >= corners[0].params[0]:
            ring = tuple((each.params[4], each.params[5]) for each in corners)
            name = f"items {corners[0].number} to {item.number}"
            found.append(Fence(name, CORNERS[item.command], (ring,)))
            corners = []
    if corners:
        raise _torn(corners)
    return Fences(tuple(found), inside_all=True)


def rally_note(points: int) -> tuple[str, ...]:
    """What is to be said of rally points."""
    if not points:
        return ()
    told = "a return to launch is flown to home, not to the nearest of them"
    return (f"{counted(points, 'rally point')} passed over: {told}",)


def nothing_but(items: Sequence[Item]) -> str:
    """What a list without a mission holds instead; empty where it is neither fence nor rally points."""
    fences = sum(item.command in (*CORNERS, *CIRCLES) for item in items)
    rally = sum(item.command == RALLY_POINT for item in items)
    held = [f"a fence of {counted(fences, 'item')}"] if fences else []
    held += [counted(rally, "rally point")] if rally else []
    more = "; `wayproof world` takes fences, and `check` takes them beside a mission" if fences else ""
    return " and ".join(held) + more


def _torn(corners: Sequence[Item]) -> InputError:
    first = corners[0]
    return InputError(
        f"{first.place}: item {first.number} begins a fence of {first.params[0]:g} corners, of which "
        f"{len(corners)} follow; it may be torn"
    )


def _circle(item: Item, home: tuple[float, float] | None) -> Fence:
    radius, told = item.params[0], f"{item.place}: item {item.number} is a fence"
    if not radius > 0.0:
        raise InputError(f"{told} of radius {radius:g} m; must be greater than 0")
    center = home if item.command == HOME_CIRCLE else (item.params[4], item.params[5])
    if center is None:
        raise InputError(f"{told} about home, which has no position")
    return Fence(f"item {item.number}", CIRCLES[item.command], center=center, radius_m=radius)
