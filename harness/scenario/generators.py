"""Forests drawn from a seed: what a campaign file names under `worlds`.

Frame: local ENU plane, x = east, y = north, metres; the south-west corner of every area is (0, 0). Places and sizes are
rounded to 0.1 m. Copses are placed one by one, wherever they leave the gap to those before and the room about start and
goal; one that finds no place in `TRIES` is left out, so a crowded area holds fewer than were asked for.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

import numpy as np
from pydantic import AfterValidator, Field, Strict, model_validator

from harness.files.strict_yaml import Loc
from harness.scenario.sections import MAX_COORDINATE_M, Length, Section, in_order

MAX_OBSTACLES: Final = 10_000  # a forest that is asked for more trunks is refused
TRIES, TRIES_AT_ONCE = 100, 10  # places that a copse is tried at before it is left out, and at once
Place = tuple[float, float]
Count = Annotated[int, Field(ge=1, le=1000)]


class Forest(Section):
    """Copses of overlapping round trunks; with one trunk each, discs."""

    size_m: Annotated[tuple[Length, Length], Strict(False)] = (5000.0, 5000.0)
    """Width and height of the area."""
    room_m: Length = 400.0
    """Start (south-west) and goal (north-east) are so far from the edges, and at least so far from obstacles."""
    density_1pkm2: Annotated[float, Field(ge=0, le=1e6)] = 2.0
    """How many copses a square kilometre."""
    gap_m: Annotated[float, Field(ge=0, le=MAX_COORDINATE_M)] = 400.0
    """Least width of the ways between them; 0 lets them touch."""
    radius_m: Annotated[tuple[Length, Length], Strict(False), AfterValidator(in_order)] = (40.0, 80.0)
    """Least and largest radius of a trunk."""
    trunks: Annotated[tuple[Count, Count], Strict(False), AfterValidator(in_order)] = (1, 3)
    """Least and largest number of trunks in a copse."""

    @model_validator(mode="after")
    def _has_room(self) -> Forest:
        if min(self.size_m) < 4 * self.room_m:
            text = f"is {list(self.size_m)} m with room_m {self.room_m:g}"
            raise ValueError(f"{text}; each side must be at least 4 x room_m")
        if (trunks := self.number * self.trunks[1]) > MAX_OBSTACLES:
            raise ValueError(f"asks for {trunks} obstacles; must be at most {MAX_OBSTACLES}")
        return self

    @property
    def number(self) -> int:
        """Number of copses of the density in the area, some of which may find no place."""
        return round(self.density_1pkm2 * self.size_m[0] * self.size_m[1] / 1e6)

    def copse(self, rng: np.random.Generator) -> list[tuple[Place, float]]:
        """Draws a copse: middle and radius (m) of each trunk, the first at (0, 0), the others overlapping it."""
        radii = rng.uniform(*self.radius_m, rng.integers(*self.trunks, endpoint=True)).tolist()
        angles = rng.uniform(0.0, math.tau, len(radii)).tolist()
        away = [0.0, *(radii[0] * share for share in rng.uniform(0.3, 0.9, len(radii) - 1).tolist())]
        return [((d * math.cos(a), d * math.sin(a)), r) for d, a, r in zip(away, angles, radii, strict=True)]

    def places(self, reach_m: list[float], ends_m: tuple[Place, Place], rng: np.random.Generator) -> list[Place | None]:
        """Draws a middle for each copse, which reaches `reach_m` about it; None for one that finds no place."""
        taken = np.empty((len(reach_m) + 2, 3))  # east, north, what is kept from it
        taken[:2] = [(*end, self.room_m) for end in ends_m]
        found: list[Place | None] = []
        placed = len(ends_m)
        for radius in reach_m:
            discs = taken[:placed]
            found.append(None)
            for _ in range(TRIES // TRIES_AT_ONCE):
                tries = rng.random((TRIES_AT_ONCE, 2)) * self.size_m
                away_2 = ((tries[:, None] - discs[:, :2]) ** 2).sum(axis=2)
                if (free := (away_2 >= (discs[:, 2] + radius) ** 2).all(axis=1)).any():
                    east, north = tries[free.argmax()].tolist()
                    found[-1] = east, north
                    taken[placed] = east, north, radius + self.gap_m
                    placed += 1
                    break
        return found


class WorldSpec(Section):
    """A world that is drawn."""

    label: Annotated[str, Field(pattern=r"^[a-z0-9._-]+$", max_length=100)] = "forest"
    """Names it in the column `world`."""
    seed: Annotated[int | None, Field(ge=0, le=2**53)] = None
    """Holds the world: the same one in every case. Default: another one in every case."""
    forest: Forest
    """Copses of overlapping round trunks."""


def generated(spec: WorldSpec, seed: int) -> dict[Loc, Any]:
    """Draws a world: area, obstacles, start and goal, by their keys. `spec.seed`, if given, is used for `seed`."""
    rng, forest = np.random.default_rng(seed if spec.seed is None else spec.seed), spec.forest
    copses = [forest.copse(rng) for _ in range(forest.number)]
    reach_m = [max(math.hypot(*at) + radius for at, radius in copse) for copse in copses]
    (width, height), room = forest.size_m, forest.room_m
    start, goal = (room, room), (width - room, height - room)
    circles = (
        {"center_m": [round(place[0] + east, 1), round(place[1] + north, 1)], "radius_m": round(radius, 1)}
        for place, copse in zip(forest.places(reach_m, (start, goal), rng), copses, strict=True)
        if place
        for (east, north), radius in copse
    )
    return {
        ("area", "bounds_m"): (0.0, 0.0, width, height),
        ("obstacles",): tuple({"circle": circle} for circle in circles),
        ("mission", "start_m"): start,
        ("mission", "goal_m"): goal,
    }
