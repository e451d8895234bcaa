"""The scenario that a given path is flown in: an empty world about it, or one that somebody names."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any, Final

import numpy as np

from harness.files import strict_yaml
from harness.files.strict_yaml import Node
from harness.run_files.given_path import SAME_PLACE_M, FloatArray
from harness.scenario.overrides import overridden, with_key
from harness.scenario.scenario import Scenario, node_of_keys, validated

MARGIN_M, MARGIN_SHARE = 1000.0, 0.25
"""The area of a checked path reaches this far beyond it: so much, and so much of its span."""

OF_THE_WORLD: Final = ("seed", "area", "obstacles", "environment")
"""What a check takes from a scenario that it flies a path in; mission, aircraft, sensor and planner are its own."""


def scenario_for(
    name: str,
    points_m: FloatArray,
    sections: Mapping[str, Mapping[str, Any]],
    overrides: Sequence[tuple[str, str]] = (),
    world: FilePath | None = None,
) -> Scenario:
    """The mission of a path as a scenario: from its start to its end.

    A path that ends about where it begins has its furthest point as the goal. What the aircraft may be off is by
    default what it may be in calm air: the room about a path does not grow with the wind. Start and goal may lie
    anywhere, in an obstacle too: that is then what the flight finds.

    Args:
        name: of the scenario.
        points_m: (n, 2) the path.
        sections: `aircraft`, `environment`, ... as in a file; what is left out has its default.
        overrides: keys to replace.
        world: a scenario file with the obstacles, the area, the air, the altitude and the seed. None: nothing is
            there, and the area reaches beyond the path.

    Raises:
        InputError: the sections contradict each other; the fault names the key.
    """
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
    tolerance_m = _calm(root, overrides, source, world).trackability.cross_track_m
    if root.at(("trackability", "cross_track_m")) is None:
        root = with_key(root, ("trackability", "cross_track_m"), Node(tolerance_m, strict_yaml.COMMAND_LINE))
    return validated(overridden(root, overrides), source, _folder(world), ends_checked=False)


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
    altitude = root.at(("mission", "altitude_m"))
    if altitude is not None:
        kept["mission"] = Node({"altitude_m": altitude}, altitude.line)
    return Node(kept, root.line), str(world)


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


def _calm(root: Node, overrides: Sequence[tuple[str, str]], source: str, world: FilePath | None) -> Scenario:
    """The same in calm air, with nothing there."""
    assert isinstance(root.value, dict)
    kept = {key: node for key, node in root.value.items() if key not in ("environment", "obstacles")}
    own = [each for each in overrides if not each[0].strip().startswith(("environment", "obstacles"))]
    return validated(overridden(Node(kept, root.line), own), source, _folder(world), ends_checked=False)
