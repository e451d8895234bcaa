"""Obstacles of a scenario that are files, made into polygons and ground: the one place where that is done."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from harness.scenario.environment import GroundSpec, SourceSpec
from harness.scenario.obstacles import Obstacle, Polygon, WorldFile
from harness.scenario.sections import Area, Geodetic, Point
from harness.scenario.validation import KeyFault

if TYPE_CHECKING:
    from harness.world_files.expansion import Expanded, FileSpec


class Resolved(NamedTuple):
    """What became of the obstacles of a scenario."""

    obstacles: tuple[Obstacle, ...]
    names: tuple[str, ...]
    """Of each obstacle, for messages."""
    ground: GroundSpec | None
    sources: tuple[SourceSpec, ...]


def resolved(
    obstacles: Sequence[Obstacle],
    area: Area,
    ground: GroundSpec | None,
    altitude_m: float,
    folder: Path | None,
) -> Resolved:
    """Obstacles with every file of them expanded; without a file, nothing is changed.

    Args:
        obstacles: as the scenario has them.
        area: gives the bounds and the origin of the plane.
        ground: of the scenario, where it has one already.
        altitude_m: of the mission.
        folder: of the scenario file; paths are looked for there first.

    Raises:
        KeyFault: a file cannot be used.
    """
    at = [index for index, each in enumerate(obstacles) if each.file is not None]
    if not at:
        return Resolved(tuple(obstacles), tuple(f"obstacles[{i}]" for i in range(len(obstacles))), ground, ())
    from harness.world_files.bounded import uncollected
    from harness.world_files.expansion import FileFault, expanded
    from harness.world_files.plane import Place

    place = Place(area.origin.latitude_deg, area.origin.longitude_deg)
    specs = [spec_of(file, folder) for each in obstacles if (file := each.file)]
    known = None if ground is None else ground.field()
    with uncollected():
        try:
            found = expanded(specs, place, area.bounds_m, altitude_m, ground=known)
        except FileFault as fault:
            raise KeyFault(
                ("obstacles", at[fault.index], "file"), f"{specs[fault.index].path.name} {fault}"
            ) from fault
        return _joined(obstacles, found, ground)


def spec_of(file: WorldFile, folder: Path | None) -> FileSpec:
    """What the key `file` asks for."""
    from harness.world_files.expansion import FileSpec

    keys = {name: getattr(file, name) for name in WorldFile.model_fields if name != "path"}
    return FileSpec(_path(file.path, folder), **keys)


def _path(text: str, folder: Path | None) -> Path:
    """The file: beside the scenario file, or from here; `package:path` lies in an installed package."""
    package, colon, inner = text.partition(":")
    if colon and package.isidentifier() and (spec := importlib.util.find_spec(package)) is not None:
        return Path((spec.submodule_search_locations or [""])[0]) / inner
    return (file_beside(text, folder) if folder is not None else None) or Path(text)


def file_beside(text: str, folder: Path) -> Path | None:
    """The file that lies so from a folder; None where there is none."""
    try:
        beside = folder / Path(text).expanduser()
        return beside if beside.exists() else None
    except (OSError, RuntimeError):  # too long, or the home of nobody
        return None


def _joined(obstacles: Sequence[Obstacle], found: Expanded, ground: GroundSpec | None) -> Resolved:
    sources = iter(found.sources)
    every: list[Obstacle] = []
    names: list[str] = []
    told: list[SourceSpec] = []
    for index, each in enumerate(obstacles):
        if each.file is None:
            every.append(each)
            names.append(f"obstacles[{index}]")
            continue
        source = next(sources)
        parts = [
            obstacle_of(rings, heights_m, each)
            for rings, heights_m in zip(rings_of(source.polygons), source.heights_m, strict=True)
        ]
        every += parts
        names += [f"what obstacles[{index}] has of {source.spec.path.name}"] * len(parts)
        told.append(
            SourceSpec(
                path=each.file.path,
                kind=source.kind,
                sha256=source.sha256,
                polygons=len(parts),
                notes=source.notes,
            )
        )
    return Resolved(
        tuple(every), tuple(names), GroundSpec.of(found.ground) if found.ground else ground, tuple(told)
    )


Ring = tuple[Point, ...]


def rings_of(polygons: Sequence[object]) -> list[list[Ring]]:
    """Corners of each polygon of shapely: of its outline, then of its holes; no corner twice."""
    import numpy as np
    import shapely

    rings, of = shapely.get_rings(np.array(polygons, dtype=object), return_index=True)
    corners = list(map(tuple, shapely.get_coordinates(rings).tolist()))
    found: list[list[Ring]] = [[] for _ in polygons]
    end = 0
    for index, count in zip(of.tolist(), shapely.get_num_coordinates(rings).tolist(), strict=True):
        begin, end = end, end + count
        found[index].append(tuple(corners[begin : end - 1]))
    return found


def obstacle_of(rings: Sequence[Ring], heights_m: tuple[float, float], like: Obstacle) -> Obstacle:
    """A valid polygon between two heights as an obstacle.

    Args:
        rings: its outline, then its holes.
        heights_m: bottom and top.
        like: the obstacle that names the file.
    """
    polygon = Polygon.model_construct(vertices_m=rings[0], holes_m=tuple(rings[1:]) or None)
    return Obstacle.model_construct(
        circle=None,
        polygon=polygon,
        file=None,
        velocity_mps=None,
        active_s=like.active_s,
        heights_m=heights_m,
    )


def plane_point(place: Geodetic, area: Area) -> Point:
    """Where a place lies in the plane, to a millimetre."""
    from aircraft.frames import LocalPlane

    plane = LocalPlane(area.origin.latitude_deg, area.origin.longitude_deg)
    east, north = plane.plane(place.latitude_deg, place.longitude_deg)
    return round(east, 3), round(north, 3)
