"""Missions in .mission files: of QGroundControl before its plans, JSON of versions 1 and 2, and of Mission Planner.

Version 2 is the `mission` of a plan on its own. Version 1 has the parameters of an item one by one, surveys in a list
of their own, and an item for home.
"""

from __future__ import annotations

from typing import Any, Final

from harness.files.input_file import InputError
from harness.run_files.mission.items import MissionAsRead
from harness.run_files.mission.plan_file import read_mission, read_plan
from harness.run_files.mission.wpl_file import WPL, read_waypoints
from harness.run_files.read_values import parsed_json

PARAMETERS: Final = ("param1", "param2", "param3", "param4")


def read_old_mission(text: str, source: str) -> MissionAsRead:
    """The mission of a .mission file.

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is none.
    """
    if text.startswith(WPL):
        return read_waypoints(text, source)
    if text.lstrip().startswith("<"):
        raise InputError(f"{source}: is XML, as INAV's missions are; save it as .plan or .waypoints")
    whole = parsed_json(text, source)
    if isinstance(whole, dict) and isinstance(whole.get("mission"), dict):  # Mission Planner's, as plans are
        return read_plan(text, source)
    listed = whole.get("items") if isinstance(whole, dict) else None
    if not isinstance(listed, list):
        raise InputError(f"{source}: items: is missing; a .mission of QGroundControl must have it")
    surveys = whole.get("complexItems", [])
    if not isinstance(surveys, list):
        raise InputError(f"{source}: complexItems: must be a list")
    if surveys:  # version 1 numbers both lists together
        listed = sorted([*listed, *surveys], key=_number)
    home = whole.get("plannedHomePosition")
    if isinstance(home, dict):
        home = home.get("coordinate")
    items = [_as_in_a_plan(each) for each in listed]
    return read_mission({**whole, "items": items, "plannedHomePosition": home}, source, "")


def _number(item: Any) -> float:
    number = item.get("id") if isinstance(item, dict) else None
    return float(number) if isinstance(number, int | float) else 0.0


def _as_in_a_plan(item: Any) -> Any:
    """An item of version 1 as plans have it; any other as it is."""
    if not isinstance(item, dict) or item.get("type") != "missionItem":
        return item
    params = [item.get(name, 0.0) for name in PARAMETERS]
    return {**item, "type": "SimpleItem", "params": params, "doJumpId": item.get("id")}
