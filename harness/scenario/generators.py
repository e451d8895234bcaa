"""Worlds drawn from a seed: what a campaign file names under `worlds`.

Each generator is a frozen section of a campaign file, whose `world` is a pure function of it and a seed. Frame: local
ENU plane, x = east, y = north, metres; the south-west corner of every area is (0, 0). Places and sizes of obstacles are
rounded to 0.1 m, so that a world can be read and written by hand.

Obstacles are placed one by one, wherever they leave the gap to those before and the room about start and goal; one that
finds no place in `TRIES` is left out, so a crowded area holds fewer than were asked for. The start lies in the
south-west corner and the goal in the north-east one, `room_m` from both edges.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, Strict, model_validator

from harness.scenario.sections import MAX_COORDINATE_M, Bounds, Length, Section

MAX_OBSTACLES: Final = 10_000
"""A generator that is asked for more is refused."""
TRIES: Final = 100
AT_ONCE: Final = 10
"""Number of places that are tried at a time."""
ObstacleKeys = dict[str, Any]
"""One obstacle as a scenario file has it."""
Place = tuple[float, float]


class GeneratedWorld(NamedTuple):
    """An area with its obstacles, as in a scenario file, and a mission through it."""

    bounds_m: Bounds
    start_m: Place
    goal_m: Place
    obstacles: tuple[ObstacleKeys, ...]


def _in_order(span: tuple[float, float]) -> tuple[float, float]:
    if span[0] > span[1]:
        raise ValueError(f"is {list(span)}; must be [least, most]")
    return span


Span = Annotated[tuple[Length, Length], Strict(False), AfterValidator(_in_order)]
"""Least and most; drawn evenly between them."""
Count = Annotated[int, Field(ge=1, le=1000)]


class Circles(Section):
    """Discs of random size."""

    size_m: Annotated[tuple[Length, Length], Strict(False)] = (5000.0, 5000.0)
    """Width and height of the area."""
    room_m: Length = 400.0
    """About start and goal there is no obstacle nearer than this; they lie as far from the edges."""
    density_1pkm2: Annotated[float, Field(ge=0, le=1e6)] = 2.0
    """How many a square kilometre."""
    gap_m: Annotated[float, Field(ge=0, le=MAX_COORDINATE_M)] = 400.0
    """Least width of the ways between them; 0 lets them touch."""
    radius_m: Span = (80.0, 300.0)
    """Least and largest radius."""

    @model_validator(mode="after")
    def _has_room(self) -> Circles:
        if min(self.size_m) < 4 * self.room_m:
            told = f"is {list(self.size_m)} m with room_m {self.room_m:g}"
            raise ValueError(f"{told}; each side must be at least 4 x room_m")
        asked = self.number * self.most_each
        if asked > MAX_OBSTACLES:
            raise ValueError(f"asks for {asked} obstacles; must be at most {MAX_OBSTACLES}")
        return self

    @property
    def number(self) -> int:
        """How many are asked for."""
        return round(self.density_1pkm2 * self.size_m[0] * self.size_m[1] / 1e6)

    @property
    def most_each(self) -> int:
        """Discs that one of them can consist of."""
        return 1

    def world(self, rng: np.random.Generator) -> GeneratedWorld:
        """The area with its obstacles."""
        groups = self._groups(rng)
        reach = [max(math.hypot(*at) + radius for at, radius in group) for group in groups]
        (width, height), room = self.size_m, self.room_m
        start, goal = (room, room), (width - room, height - room)
        obstacles = [
            _circle((place[0] + at[0], place[1] + at[1]), radius)
            for place, group in zip(self._places(reach, (start, goal), rng), groups, strict=True)
            if place
            for at, radius in group
        ]
        return GeneratedWorld((0.0, 0.0, width, height), start, goal, tuple(obstacles))

    def _groups(self, rng: np.random.Generator) -> list[list[tuple[Place, float]]]:
        """Of each obstacle the discs: their middles from its own, and their radii."""
        return [[((0.0, 0.0), radius)] for radius in rng.uniform(*self.radius_m, self.number).tolist()]

    def _places(
        self, reach_m: list[float], ends_m: tuple[Place, Place], rng: np.random.Generator
    ) -> list[Place | None]:
        """A middle for each obstacle that reaches so far about it, None for one without a place."""
        taken = np.empty((len(reach_m) + 2, 3))  # east, north, what is kept from it
        taken[:2] = [(*end, self.room_m) for end in ends_m]
        found: list[Place | None] = []
        placed = len(ends_m)
        for radius in reach_m:
            discs = taken[:placed]
            found.append(None)
            for _ in range(TRIES // AT_ONCE):
                tries = rng.random((AT_ONCE, 2)) * self.size_m
                away_2 = ((tries[:, None] - discs[:, :2]) ** 2).sum(axis=2)
                free = (away_2 >= (discs[:, 2] + radius) ** 2).all(axis=1)
                if free.any():
                    east, north = tries[free.argmax()].tolist()
                    found[-1] = east, north
                    taken[placed] = east, north, radius + self.gap_m
                    placed += 1
                    break
        return found


class Forest(Circles):
    """Copses: each of some overlapping trunks, round ones."""

    radius_m: Span = (40.0, 80.0)
    """Least and largest radius of a trunk."""
    trunks: Annotated[tuple[Count, Count], Strict(False), AfterValidator(_in_order)] = (1, 3)
    """Least and largest number of trunks in a copse."""

    @property
    def most_each(self) -> int:
        """The trunks of a copse."""
        return self.trunks[1]

    def _groups(self, rng: np.random.Generator) -> list[list[tuple[Place, float]]]:
        return [self._copse(rng) for _ in range(self.number)]

    def _copse(self, rng: np.random.Generator) -> list[tuple[Place, float]]:
        """Trunks about (0, 0): the first there, the others overlapping it."""
        radii = rng.uniform(*self.radius_m, rng.integers(*self.trunks, endpoint=True)).tolist()
        angles = rng.uniform(0.0, math.tau, len(radii)).tolist()
        away = [0.0, *(radii[0] * share for share in rng.uniform(0.3, 0.9, len(radii) - 1).tolist())]
        return [((d * math.cos(a), d * math.sin(a)), r) for d, a, r in zip(away, angles, radii, strict=True)]


GENERATORS: Final = ("circles", "forest")


class WorldSpec(Section):
    """One world generator: exactly one of the shapes."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": [name]} for name in GENERATORS]})

    label: Annotated[str | None, Field(pattern=r"^[a-z0-9._-]+$", max_length=100)] = None
    """Names it in the column `world`. Default: the generator's name."""
    seed: Annotated[int | None, Field(ge=0, le=2**53)] = None
    """Holds the world: the same one in every case. Default: another one in every case."""
    circles: Circles | None = None
    """Discs of random size."""
    forest: Forest | None = None
    """Copses of overlapping round trunks."""

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
        return "circles" if self.circles else "forest"

    @property
    def name(self) -> str:
        """What the column `world` calls it."""
        return self.label or self.generator


def generated(spec: WorldSpec, seed: int) -> GeneratedWorld:
    """The world that a generator makes of a seed, the same one every time; `spec.seed` goes before it."""
    rng = np.random.default_rng(seed if spec.seed is None else spec.seed)
    config: Circles = getattr(spec, spec.generator)
    return config.world(rng)


def _circle(place: Place, radius_m: float) -> ObstacleKeys:
    east, north = (round(float(each), 1) for each in place)
    return {"circle": {"center_m": [east, north], "radius_m": round(radius_m, 1)}}
