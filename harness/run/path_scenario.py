"""The scenario that a given path is flown in: an empty world about it, or one that somebody names."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from harness.files import strict_yaml
from harness.files.strict_yaml import Node, node_of
from harness.run_files.given_path import SAME_PLACE_M, FloatArray
from harness.scenario.environment import GroundSpec
from harness.scenario.files_resolved import spec_of
from harness.scenario.obstacles import WorldFile
from harness.scenario.overrides import overridden, with_key
from harness.scenario.scenario import Scenario, node_of_keys, validated

if TYPE_CHECKING:
    from harness.world_files.expansion import FileSpec

MARGIN_M, MARGIN_SHARE = 1000.0, 0.25
"""The area of a checked path reaches this far beyond it: so much, and so much of its span."""

OF_THE_WORLD: Final = (
    *("seed", "area", "obstacles", "ground", "sources"),
    *("environment", "conditions", "uncertainty"),
)
"""Sections that a check takes from a scenario that it flies a path in; mission, aircraft and sensor are its own."""

KEYS_OF_THE_WORLD: Final = (
    ("mission", "altitude_m"),
    ("planner", "clearance_m"),
    ("trackability", "cross_track_m"),
    ("trackability", "altitude_m"),
)
"""Single keys that it takes from there too: the altitude, and what sets the limits."""


def scenario_for(
    name: str,
    points_m: FloatArray,
    sections: Mapping[str, Mapping[str, Any]],
    overrides: Sequence[tuple[str, str]] = (),
    world: FilePath | None = None,
    files: bool = True,
    ground: GroundSpec | None = None,
) -> Scenario:
    """The mission of a path as a scenario: from its start to its end.

    A path that ends about where it begins has its furthest point as the goal. Start and goal may lie anywhere, in an
    obstacle too: that is then what the flight finds.

    Args:
        name: of the scenario.
        points_m: (n, 2) the path.
        sections: `aircraft`, `environment`, ... as in a file; what is left out has its default.
        overrides: keys to replace.
        world: a scenario file with the obstacles, the area, the air, the altitude, the clearance and the seed. None:
            nothing is there, and the area reaches beyond the path.
        files: files among the obstacles are obstacles where they are solid at the altitude of the start; else they
            are left out, for a path that is not flown at one altitude, see `files_of`.
        ground: in place of what these files say of it.

    Raises:
        InputError: the sections contradict each other; the fault names the key.
    """
    root, source = _root(name, points_m, sections, overrides, world)
    if not files:
        root = _without_files(root, ground)
    return validated(root, source, _folder(world), ends_checked=False)


def files_of(
    sections: Mapping[str, Mapping[str, Any]],
    overrides: Sequence[tuple[str, str]] = (),
    world: FilePath | None = None,
) -> tuple[FileSpec, ...]:
    """The files among the obstacles.

    Args:
        sections: as `scenario_for` takes them.
        overrides: likewise.
        world: likewise.

    Raises:
        InputError: a key path leads nowhere.
    """
    root, _ = _root("path", np.array([(0.0, 0.0), (1.0, 0.0)]), sections, overrides, world)
    obstacles = root.at(("obstacles",))
    listed = obstacles.value if obstacles is not None and isinstance(obstacles.value, tuple) else ()
    files = [each.at(("file",)) for each in listed]
    return tuple(spec_of(WorldFile.model_validate(file.plain()), _folder(world)) for file in files if file)


def _without_files(root: Node, ground: GroundSpec | None) -> Node:
    """A scenario's keys with the ground in place of the files among its obstacles."""
    obstacles = root.at(("obstacles",))
    if obstacles is not None and isinstance(obstacles.value, tuple):
        kept = tuple(each for each in obstacles.value if each.at(("file",)) is None)
        root = with_key(root, ("obstacles",), Node(kept, obstacles.line))
    if ground is None:
        return root
    return with_key(root, ("ground",), node_of(ground.model_dump(), strict_yaml.COMMAND_LINE))


def _root(
    name: str,
    points_m: FloatArray,
    sections: Mapping[str, Mapping[str, Any]],
    overrides: Sequence[tuple[str, str]],
    world: FilePath | None,
) -> tuple[Node, str]:
    """The keys of `scenario_for`, and what their faults name."""
    root, source = _base(world)
    for key, section in _sections(name, points_m, sections, root).items():
        before = root.at((key,))
        keys = node_of_keys({key: section}).value
        assert isinstance(keys, dict)
        kept = before.value if before is not None and isinstance(before.value, dict) else {}
        new = keys[key].value
        root = with_key(
            root, (key,), Node({**kept, **new}, keys[key].line) if isinstance(new, dict) else keys[key]
        )
    return overridden(root, overrides), source


def has_bounds(
    sections: Mapping[str, Any], overrides: Sequence[tuple[str, str]], world: FilePath | None
) -> bool:
    """Whether somebody named the bounds of the area; else they only reach beyond the path."""
    named = any(key.strip().startswith("area") and "origin" not in key for key, _ in overrides)
    return named or world is not None or "bounds_m" in sections.get("area", {})


def _base(world: FilePath | None) -> tuple[Node, str]:
    """What is taken from a world, and what faults name it."""
    if world is None:
        return Node({}, strict_yaml.COMMAND_LINE), "command line"
    root = strict_yaml.read(world)
    validated(root, str(world), world.parent)  # its faults are told as those of a scenario
    assert isinstance(root.value, dict)
    kept = {key: node for key, node in root.value.items() if key in OF_THE_WORLD}
    base = Node(kept, root.line)
    for section, key in KEYS_OF_THE_WORLD:
        written = root.at((section, key))
        if written is not None:
            base = with_key(base, (section, key), written)
    return base, str(world)


def _folder(world: FilePath | None) -> FilePath | None:
    return None if world is None else world.parent


def _sections(
    name: str, points_m: FloatArray, sections: Mapping[str, Mapping[str, Any]], root: Node
) -> dict[str, Any]:
    """All that is not the world's."""
    start = points_m[0]
    far = np.hypot(*(points_m - start).T)
    goal_radius = min(100.0, float(0.25 * far.max()))
    goal = points_m[-1] if far[-1] > 2.0 * goal_radius else points_m[int(far.argmax())]
    out = points_m[int(np.argmax(far > SAME_PLACE_M))] - start
    mission = {
        "start_m": start.tolist(),
        "course_deg": math.degrees(math.atan2(out[0], out[1])) % 360.0,
        "goal_m": goal.tolist(),
        "goal_radius_m": goal_radius,
    }
    lowest, highest = points_m.min(axis=0), points_m.max(axis=0)
    margin = MARGIN_M + MARGIN_SHARE * float((highest - lowest).max())
    about = {"bounds_m": [*(lowest - margin).tolist(), *(highest + margin).tolist()]}
    area = {**({} if root.at(("area", "bounds_m")) else about), **sections.get("area", {})}
    return {
        "schema": "wayproof/scenario/1",
        "name": name,
        **{key: dict(section) for key, section in sections.items() if section},
        **({"area": area} if area else {}),
        "mission": {**mission, **sections.get("mission", {})},
    }
