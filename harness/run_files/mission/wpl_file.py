"""Missions in plain-text files of MAVLink ground stations (.waypoints, .txt): "QGC WPL".

The format: https://mavlink.io/en/file_formats/#mission_plain_text_file
"""

from __future__ import annotations

from typing import Final

from harness.files.input_file import InputError
from harness.run_files.mission import fence_items
from harness.run_files.mission.items import Item, MissionAsRead
from harness.run_files.read_values import finite, whole

WPL: Final = "QGC WPL"
CELLS: Final = 12
COMMENT: Final = "#"
NAN: Final = "nan"
RALLY: Final = "RALLY"
"""First word of every line of a list of rally points of MAVProxy."""


def read_waypoints(text: str, source: str) -> MissionAsRead:
    """The mission of a plain-text file; its first item is home, lines that begin with # are comments.

    Items of fences that stand among those of the mission are fences; rally points are counted.

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is none.
    """
    lines = text.splitlines()
    if not lines or not lines[0].startswith(WPL):
        raise InputError(f'{source}:1: {_meant(lines)}must begin with "{WPL} 110"')
    items = []
    for number, line in enumerate(lines[1:], start=2):
        cells = line.split()
        if not cells or cells[0].startswith(COMMENT):
            continue
        place = f"{source}:{number}"
        if len(cells) != CELLS:
            raise InputError(f"{place}: has {len(cells)} fields; a mission item has {CELLS}")
        index, frame, command = (whole(cells[i], place) for i in (0, 2, 3))
        # What is left to the autopilot is 0, or no number.
        params = [0.0 if cell.lower() == NAN else finite(cell, place) for cell in cells[4:8]]
        params += [finite(cell, place) for cell in cells[8:11]]
        items.append(Item(place, index, command, frame, tuple(params)))
    if not items:
        raise InputError(f"{source}: has no items; the first is home, the others are the path")
    home, *others = items
    again = next((item for item in others if item.number == home.number), None)
    if again is not None:
        raise InputError(
            f"{again.place}: item {home.number} is there twice, first as home; numbers must differ"
        )
    flown = tuple(item for item in others if item.command not in fence_items.APART)
    if not flown and (instead := fence_items.nothing_but(others)):
        raise InputError(f"{source}: has no items to fly to, but {instead}")
    rally = sum(item.command == fence_items.RALLY_POINT for item in others)
    return MissionAsRead(
        source,
        flown,
        home.position,
        home.params[6],
        fence_items.fences_of(others),
        fence_items.rally_note(rally),
    )


def _meant(lines: list[str]) -> str:
    """What a text is that is no mission, where that can be told."""
    words = [cells for line in lines if (cells := line.partition(COMMENT)[0].split())]
    if words and words[0][0] == RALLY:
        return "is a list of rally points, which no mission flies to; a mission "
    if len(words) > 3 and all(len(cells) == 2 for cells in words):
        return "looks like a fence, which `wayproof world` takes; a mission "
    return ""
