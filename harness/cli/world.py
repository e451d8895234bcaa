"""The command `world`: a scenario from files that people own."""

from __future__ import annotations

import math
import os
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from harness.cli.command_line import writing
from harness.cli.options import AircraftName, Number, Text, argument, option
from harness.cli.terminal import plain, print_table, say
from harness.files.input_file import InputError
from harness.files.wording import counted

if TYPE_CHECKING:
    from harness.scenario.scenario import Scenario
    from harness.world_files.siting import Craft, Site

Pair = tuple[float, float]

PLACE_HELP: Final = "Latitude,longitude; or x,y in metres for a file without a place on earth."
NEAR_HELP: Final = "Whatever comes this near to the altitude is an obstacle."
CRS_HELP: Final = "Coordinate system of files that name none, such as EPSG:28992."


def world(
    files: Annotated[list[Path], argument("FILE...", "Terrain, buildings, airspace, fences or an occupancy map.")],
    altitude_m: Annotated[float, option("H", "Flight altitude above mean sea level.")],
    out: Annotated[Path, option("SCENARIO.yaml", "The scenario to write.")],
    aircraft: AircraftName = "aerosonde",
    start: Annotated[Text, option("A,B", PLACE_HELP)] = None,
    goal: Annotated[Text, option("A,B", "Likewise.")] = None,
    clearance_m: Annotated[Number, option("C", "Wanted clearance: planner.clearance_m.")] = None,
    vertical_clearance_m: Annotated[float, option("V", NEAR_HELP)] = 10.0,
    metres_per_cell: Annotated[Number, option("M", "Side of a cell of an occupancy map.")] = None,
    ground_m: Annotated[Number, option("G", "Flat ground, for heights above ground without terrain.")] = None,
    crs: Annotated[Text, option("EPSG:N", CRS_HELP)] = None,
) -> int:
    """Makes a scenario from files of terrain, buildings, airspace, fences or an occupancy map.

    Without --start and --goal it places them far apart, in free space with room to turn.

    For example: wayproof world davos.tif --altitude-m 2000 --out davos.yaml
    """
    from harness.files.strict_yaml import dump
    from harness.files.whole_file import replace_text
    from harness.world_files.expansion import FileFault
    from harness.world_files.parts import FileSpec
    from harness.world_files.siting import site

    ends = _ends(start, goal)
    heights = {"altitude-m": altitude_m, "vertical-clearance-m": vertical_clearance_m, "ground-m": ground_m}
    for given, value in {**heights, "metres-per-cell": metres_per_cell}.items():
        is_cell = given == "metres-per-cell"
        if value is not None and not (0.0 if is_cell else -math.inf) < value < math.inf:
            wanted = "a finite number greater than 0" if is_cell else "finite"
            raise typer.BadParameter(f"--{given} is {value:g}; must be {wanted}")
    if not out.absolute().parent.is_dir():
        raise InputError(f"{out}: cannot be written (its folder is not there); make the folder first")
    craft = _craft(aircraft, clearance_m, altitude_m, out)
    specs = [FileSpec(path, None, vertical_clearance_m, metres_per_cell, crs=crs, ground_m=ground_m) for path in files]
    try:
        found = site(specs, altitude_m, craft, ends, lambda what: say(f"wayproof: {what}", err=True))
    except FileFault as fault:
        raise InputError(f"{files[fault.index]}: {fault}") from fault
    except InputError as error:
        raise InputError(f"{' '.join(map(str, files))}: {error}") from error
    name = re.sub(r"[^a-z0-9._-]+", "_", out.stem.lower())[:100].strip(".") or "world"
    area: dict[str, Any] = {"bounds_m": list(found.bounds_m)}
    if (place := found.place) is not None:
        area["origin"] = {"latitude_deg": place.latitude_deg, "longitude_deg": place.longitude_deg}
    obstacles = [{"file": _file_keys(spec, out)} for spec in found.specs]
    start_m, goal_m = found.ends_m.tolist()
    mission = {"start_m": start_m, "goal_m": goal_m, "altitude_m": float(altitude_m)}
    keys = _keys(name, area, obstacles, mission, aircraft, clearance_m)
    names = ", ".join(each.name for each in files)
    comment = [f"What {names} has at {altitude_m:g} m: made by `wayproof world`.", *_notes(found)]
    text = "".join(f"# {line}\n" for line in comment) + dump(keys)
    _checked(text, out)
    with writing(out, files):
        replace_text(out, text)
    _print(found, out)
    return 0


def _ends(start: str | None, goal: str | None) -> tuple[Pair, Pair] | None:
    if start is not None and goal is not None:
        return _pair(start, "--start"), _pair(goal, "--goal")
    if start is not None or goal is not None:
        raise typer.BadParameter("--start and --goal belong together; give both or none of them")
    return None


def _pair(text: str, option: str) -> Pair:
    try:
        first, second = (float(part) for part in text.split(","))
        if abs(first) < 1e9 and abs(second) < 1e9:
            return first, second
    except ValueError:
        pass
    raise typer.BadParameter(f"{text[:40]!r} is not A,B; write two numbers, as 46.81,9.85", param_hint=option)


def _craft(name: str, clearance_m: float | None, altitude_m: float, out: Path) -> Craft:
    """Returns the room that the aircraft needs at an altitude, by the scenario's own defaults."""
    from harness.files.strict_yaml import dump
    from harness.scenario.performance import performance_of
    from harness.world_files.siting import Craft

    area = {"bounds_m": [-1.5e5, -1.5e5, 1.5e5, 1.5e5]}
    mission = {"start_m": [-1e5, 0.0], "goal_m": [1e5, 0.0], "altitude_m": float(altitude_m)}
    empty = _checked(dump(_keys("room", area, [], mission, name, clearance_m)), out)
    return Craft(name, performance_of(empty).turn_radius_m, empty.planner.clearance_m)


def _keys(
    name: str, area: Any, obstacles: Sequence[Any], mission: Any, aircraft: str, clearance_m: float | None
) -> dict[str, Any]:
    return {
        "schema": "wayproof/scenario/1",
        "name": name,
        "area": area,
        "obstacles": list(obstacles),
        "mission": mission,
        "aircraft": {"model": aircraft},
        **({} if clearance_m is None else {"planner": {"clearance_m": float(clearance_m)}}),
    }


def _file_keys(spec: Any, out: Path) -> dict[str, Any]:
    """Returns the key `file`, with the values that differ from its defaults."""
    from dataclasses import fields

    path = spec.path.parent.resolve() / spec.path.name  # `..` from a folder that is a link leads elsewhere
    keys: dict[str, Any] = {"path": os.path.relpath(path, out.parent.resolve())}
    for field in fields(spec):
        value = getattr(spec, field.name)
        if field.name == "vertical_clearance_m" or (field.name != "path" and value != field.default):
            keys[field.name] = [round(each, 3) for each in value] if isinstance(value, tuple) else value
    return keys


def _notes(found: Site) -> list[str]:
    of_files = [f"{each.spec.path.name}: {note}" for each in found.expanded.sources for note in each.notes]
    return [note[:200] for note in (*found.notes, *found.expanded.notes, *of_files)]


def _checked(text: str, out: Path) -> Scenario:
    """Returns a scenario; InputError if it could not be flown: for its altitude, perhaps, or for start and goal."""
    from harness.scenario.scenario import parse_scenario

    try:
        return parse_scenario(text, str(out), folder=out.absolute().parent)
    except InputError as error:
        reason = re.sub(rf"^{re.escape(str(out))}:\d+: ", "", str(error).splitlines()[0])
        raise InputError(f"wayproof: the scenario would not fly: {reason}") from error


def _print(found: Site, out: Path) -> None:
    from harness.world_files.free_room import covered

    xmin, ymin, xmax, ymax = found.bounds_m
    solid = [each for source in found.expanded.sources for each in source.polygons]
    where, place = "none: the files name no place on earth", found.place
    flat_m = found.specs[0].ground_m
    ground = "not known" if flat_m is None else f"flat, at {flat_m:g} m"
    if place is not None:
        where = f"{place.latitude_deg:.5f}, {place.longitude_deg:.5f}"
    rows = {
        "area": f"{(xmax - xmin) / 1e3:.4g} x {(ymax - ymin) / 1e3:.4g} km",
        "origin": where,
        "obstacles": f"{counted(len(solid), 'polygon')}, {100.0 * covered(solid, found.bounds_m):.3g} % of the area",
        "start to goal": f"{math.dist(*found.ends_m) / 1e3:.4g} km",
        "ground": "from terrain" if found.expanded.ground is not None else ground,
        **{f"note {number}": plain(note) for number, note in enumerate(_notes(found), 1)},
    }
    print_table(f"{out}: fly it with `{shlex.join(['wayproof', 'fly', str(out)])}`", rows)
