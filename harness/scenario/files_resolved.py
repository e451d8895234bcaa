"""Obstacles of a scenario that are files, made into polygons and ground."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from harness.files.strict_yaml import Loc
from harness.scenario.environment import GroundSpec, SourceSpec
from harness.scenario.keys import ScenarioKeys
from harness.scenario.obstacles import Obstacle, Polygon, WorldFile
from harness.scenario.sections import Interval
from harness.scenario.validation import KeyFault

if TYPE_CHECKING:
    from harness.world_files.expansion import Expanded, Source
    from harness.world_files.parts import FileSpec

SAME_ALTITUDE_M: Final = 0.5  # files cut at altitudes no further apart are taken as the same


def with_files_expanded(keys: ScenarioKeys, folder: Path | None) -> tuple[ScenarioKeys, Sequence[str]]:
    """Makes the files of a scenario into obstacles and ground; returns it, and each obstacle's name in messages."""
    _check_altitude(keys)
    files = {index: each.file for index, each in enumerate(keys.obstacles) if each.file is not None}
    if not files:
        return keys, [f"obstacles[{index}]" for index in range(len(keys.obstacles))]
    found = _read(files, keys, folder)
    every, names, specs_used = list[Obstacle](), list[str](), list(keys.sources or ())
    sources = dict(zip(files, found.sources, strict=True))
    for index, each in enumerate(keys.obstacles):
        parts, name = [each], f"obstacles[{index}]"
        if (source := sources.get(index)) is not None:
            parts = _parts(source, each.active_s)
            name = f"what {name} has of {source.spec.path.name}"
            origin: dict[str, Any] = {"path": files[index].path, "kind": source.kind, "sha256": source.sha256}
            cut_m = keys.mission.altitude_m if source.by_altitude else None
            specs_used.append(SourceSpec(**origin, altitude_m=cut_m, polygons=len(parts), notes=source.notes))
        every += parts
        names += [name] * len(parts)
    ground = GroundSpec.of(found.ground) if found.ground else keys.ground
    return keys.updated(obstacles=tuple(every), ground=ground, sources=tuple(specs_used)), names


def _read(files: Mapping[int, WorldFile], keys: ScenarioKeys, folder: Path | None) -> Expanded:
    """Reads the files, by the indices of their obstacles; a KeyFault names the key that cannot be used."""
    from harness.world_files.expansion import FileFault, expanded
    from harness.world_files.plane import Place

    place = Place(keys.area.origin.latitude_deg, keys.area.origin.longitude_deg)
    specs = [spec_of(file, folder) for file in files.values()]
    known = None if keys.ground is None else keys.ground.field()
    try:
        found = expanded(specs, place, keys.area.bounds_m, keys.mission.altitude_m, ground=known)
    except FileFault as fault:
        loc: Loc = ("obstacles", list(files)[fault.index], "file", *filter(None, (fault.key,)))
        raise KeyFault(loc, f"{specs[fault.index].path.name} {fault}") from fault
    for index, file in files.items() if found.ground is None else ():
        if (file.ground_m or 0.0) >= keys.mission.altitude_m:
            text = f"is {file.ground_m:g}; must be below mission.altitude_m, {keys.mission.altitude_m:g}"
            raise KeyFault(("obstacles", index, "file", "ground_m"), text)
    return found


def _check_altitude(keys: ScenarioKeys) -> None:
    """Raises a KeyFault if obstacles were cut out of files at another altitude than that of the mission."""
    altitude_m = keys.mission.altitude_m
    for each in keys.sources or ():
        if each.altitude_m is not None and abs(each.altitude_m - altitude_m) > SAME_ALTITUDE_M:
            text = f"is {altitude_m:g}; the obstacles are {each.path} cut at {each.altitude_m:g} m"
            raise KeyFault(("mission", "altitude_m"), f"{text}: give the scenario that names the file")


def spec_of(file: WorldFile, folder: Path | None) -> FileSpec:
    """Makes a FileSpec of a key `file`: beside the scenario file, or from here; `package:path` in an installed one."""
    from harness.world_files.parts import FileSpec

    keys = {name: getattr(file, name) for name in WorldFile.model_fields if name != "path"}
    package, colon, inner = file.path.partition(":")
    if colon and package.isidentifier() and (spec := importlib.util.find_spec(package)) is not None:
        return FileSpec(Path((spec.submodule_search_locations or [""])[0]) / inner, **keys)
    return FileSpec(file_beside(file.path, folder) or Path(file.path), **keys)


def file_beside(text: str, folder: Path | None) -> Path | None:
    """The file that a path names as seen from a folder; None where there is no folder or no such file."""
    with suppress(OSError, RuntimeError):  # too long, or the home of nobody
        if folder and (beside := folder / Path(text).expanduser()).exists():
            return beside
    return None


def _parts(source: Source, active_s: Interval | None) -> list[Obstacle]:
    """Makes an obstacle of each polygon of a file: its outline and its holes, no corner twice."""
    import shapely

    parts = []
    for shape, heights_m in zip(source.polygons, source.heights_m, strict=True):
        rings = (shapely.get_coordinates(ring)[:-1].tolist() for ring in shapely.get_rings(shape))
        outline, *holes = (tuple(map(tuple, ring)) for ring in rings)
        polygon = Polygon.model_construct(vertices_m=outline, holes_m=tuple(holes) or None)
        parts.append(Obstacle.model_construct(polygon=polygon, active_s=active_s, heights_m=heights_m))
    return parts
