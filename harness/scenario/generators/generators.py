"""World generators by name, as a campaign file names them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from pydantic import ConfigDict, model_validator

from harness.scenario.generators import scattered, walled
from harness.scenario.generators.generated_world import GeneratedWorld
from harness.scenario.sections import Section, key

GENERATORS: Final[dict[str, Callable[[Any, np.random.Generator], GeneratedWorld]]] = {
    "circles": scattered.circles,
    "polygons": scattered.polygons,
    "forest": scattered.forest,
    "u_traps": scattered.u_traps,
    "town": walled.town,
    "maze": walled.maze,
    "spiral": walled.spiral,
}


class WorldSpec(Section):
    """One world generator: exactly one of the shapes."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": [name]} for name in GENERATORS]},
    )

    label: str | None = key(
        "Names it in the column `world`. Default: the generator's name.",
        default=None,
        pattern=r"^[a-z0-9._-]+$",
        max_length=100,
    )
    seed: int | None = key(
        "Holds the world: the same one in every case. Default: another one in every case.",
        unit="1",
        default=None,
        ge=0,
        le=2**53,
    )
    circles: scattered.Circles | None = key("Discs of random size.", default=None)
    polygons: scattered.Polygons | None = key("Polygons of random shape.", default=None)
    forest: scattered.Forest | None = key("Copses of overlapping round trunks.", default=None)
    u_traps: scattered.UTraps | None = key("Dead ends, open towards the start.", default=None)
    town: walled.Town | None = key("Buildings in a grid of streets.", default=None)
    maze: walled.Maze | None = key("Corridors with one way through.", default=None)
    spiral: walled.Spiral | None = key("A wall that winds round the goal.", default=None)

    @model_validator(mode="after")
    def _has_one_generator(self) -> WorldSpec:
        given = [name for name in GENERATORS if getattr(self, name) is not None]
        if len(given) != 1:
            have = " and ".join(given) if given else "none"
            raise ValueError(f"has {have} of {', '.join(GENERATORS)}; must have exactly one")
        return self

    @property
    def generator(self) -> str:
        """Name of the generator."""
        return next(name for name in GENERATORS if getattr(self, name) is not None)

    @property
    def name(self) -> str:
        """What the column `world` calls it."""
        return self.label or self.generator


def generated(spec: WorldSpec, seed: int) -> GeneratedWorld:
    """The world that a generator makes of a seed; the same one every time.

    Args:
        spec: which generator, with its keys.
        seed: at least 0; `spec.seed` goes before it.
    """
    rng = np.random.default_rng(seed if spec.seed is None else spec.seed)
    return GENERATORS[spec.generator](getattr(spec, spec.generator), rng)
