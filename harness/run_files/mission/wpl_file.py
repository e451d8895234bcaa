"""Missions in plain-text files of MAVLink ground stations (.waypoints, .txt): "QGC WPL".

The format: https://mavlink.io/en/file_formats/#mission_plain_text_file
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from harness.files.fence_commands import APART, RALLY_POINT
from harness.files.input_file import InputError
from harness.run_files.mission import commands, fence_items
from harness.run_files.mission.items import FRAMES, SEA, Item, MissionAsRead, filled, waiting_notes
from harness.run_files.path_as_read import finite, whole

WPL: Final = "QGC WPL"
CELLS: Final = 12
FIRST_PARAMETER: Final = 5
"""The field, counted from 1, of the first parameter of an item."""
COMMENT: Final = "#"
RALLY: Final = "RALLY"
"""First word of every line of a list of rally points of MAVProxy."""


def read_waypoints(text: str, source: str) -> MissionAsRead:
    """The mission of a plain-text file; its first item is home if it is a waypoint, lines after # are comments.

    A waypoint above home that has another number than 0 is no home. Items of fences that stand among those of the
    mission are fences; rally points are counted.

    Raises:
        InputError: it is none.
    """
    lines = text.splitlines()
    if not lines or not lines[0].startswith(WPL):
        raise InputError(f'{source}:1: {_meant(lines)}must begin with "{WPL} 110"')
    rows = [(f"{source}:{number}", line.split()) for number, line in enumerate(lines[1:], start=2)]
    read = [_item(cells, place) for place, cells in rows if cells and not cells[0].startswith(COMMENT)]
    if not read:
        raise InputError(f"{source}: has no items; the first is home, the others are the path")
    items, notes = _numbered(read)
    place, altitude_m = None, 0.0
    if _is_home(items[0]):
        home, *items = items
        place, altitude_m = home.position, home.params[6]
        notes += _home_note(home, altitude_m)
    flown = tuple(item for item in items if item.command not in APART)
    if not flown and (instead := fence_items.nothing_but(items)):
        raise InputError(f"{source}: has no items to fly to, but {instead}")
    rally = sum(item.command == RALLY_POINT for item in items)
    notes = (*notes, *fence_items.rally_note(rally), *waiting_notes(flown))
    return MissionAsRead(source, flown, place, altitude_m, fence_items.fences_of(items, place), notes)


def _item(cells: list[str], place: str) -> Item:
    if len(cells) != CELLS:
        raise InputError(f"{place}: has {len(cells)} fields; a mission item has {CELLS}")
    number, frame, command = (whole(cells[field], place) for field in (0, 2, 3))
    # What is left to the autopilot is 0, or no number.
    given = [None if cell.lower() == "nan" else finite(cell, place) for cell in cells[4:11]]
    params = filled(given, command, frame, lambda index: f"{place}: field {FIRST_PARAMETER + index} is nan")
    return Item(place, number, command, frame, params, finite(cells[11], place) == 0.0)


def _is_home(first: Item) -> bool:
    """Whether the first item of a file is home."""
    return first.command == commands.WAYPOINT and (first.number == 0 or FRAMES.get(first.frame, SEA) == SEA)


def _home_note(home: Item, altitude_m: float) -> tuple[str, ...]:
    """What is to be said of a home whose altitude says that it is above something else than the sea."""
    if FRAMES.get(home.frame, SEA) == SEA or altitude_m == 0.0:
        return ()
    told = f"its altitude, {altitude_m:g} m, is taken as above the sea"
    return (f"its first item is home, as autopilots have it, though of frame {home.frame}: {told}",)


def _numbered(items: list[Item]) -> tuple[list[Item], tuple[str, ...]]:
    """Items with numbers that can be jumped to.

    Autopilots count the items of a file by their lines. The numbers that stand there are kept unless that matters:
    where one comes twice, or some are left out and there is a jump.
    """
    numbers = [item.number for item in items]
    twice = len(set(numbers)) < len(numbers)
    gaps = numbers != list(range(numbers[0], numbers[0] + len(numbers)))
    if not twice and not (gaps and any(item.command == commands.JUMP for item in items)):
        return items, ()
    told = "come twice" if twice else "are left out"
    counted = [replace(item, number=number) for number, item in enumerate(items)]
    return counted, (f"some numbers of its items {told}: counted by lines from 0, as autopilots do",)


def _meant(lines: list[str]) -> str:
    """What a text is that is no mission, where that can be told."""
    words = [cells for line in lines if (cells := line.partition(COMMENT)[0].split())]
    if words and words[0][0] == RALLY:
        return "is a list of rally points, which no mission flies to; a mission "
    if len(words) > 3 and all(len(cells) == 2 for cells in words):
        return "looks like a fence, which `wayproof world` takes; a mission "
    return ""
