"""Worlds drawn from a seed: what a campaign file names under `worlds`.

Each generator is a frozen section of a campaign file and a pure function of it and a seed. Frame: local ENU plane,
x = east, y = north, metres; the south-west corner of every area is (0, 0). Places and sizes of obstacles are rounded
to 0.1 m, so that a world can be read and written by hand.

Scattered obstacles are placed one by one, wherever they leave the gap to those before and the room about start and
goal; one that finds no place in `TRIES` is left out, so a crowded area holds fewer than were asked for. The start lies
in the south-west corner and the goal in the north-east one, `room_m` from both edges.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, Strict, model_validator

from harness.scenario.placing import FloatArray, Place, placed
from harness.scenario.sections import MAX_COORDINATE_M, Length, Section, Share, key

MAX_OBSTACLES: Final = 100_000
"""A generator that is asked for more is refused."""

ObstacleKeys = dict[str, Any]
"""One obstacle as a scenario file has it."""

Cell = tuple[int, int]
Side = tuple[int, int, int]
"""Column and row of a cell, and 0 for the wall to its east, 1 for the one to its north."""


@dataclass(frozen=True)
class GeneratedWorld:
    """An area with its obstacles, as in a scenario file, and a mission through it.

    Attributes:
        bounds_m: xmin, ymin, xmax, ymax.
        start_m: east, north.
        goal_m: east, north.
        obstacles: their keys.
    """

    bounds_m: tuple[float, float, float, float]
    start_m: Place
    goal_m: Place
    obstacles: tuple[ObstacleKeys, ...]


def _in_order(span: tuple[float, float]) -> tuple[float, float]:
    if span[0] > span[1]:
        raise ValueError(f"is {list(span)}; must be [least, most]")
    return span


Span = Annotated[tuple[Length, Length], Strict(False), AfterValidator(_in_order)]
"""Least and most; drawn evenly between them."""

Density = Annotated[float, Field(ge=0, le=1e6)]
Count = Annotated[int, Field(ge=1, le=1000)]
Cells = Annotated[int, Field(ge=1, le=300)]


class _Scattered(Section):
    """What generators of scattered obstacles have in common."""

    size_m: Annotated[tuple[Length, Length], Strict(False)] = key(
        "Width and height of the area.", (5000.0, 5000.0)
    )
    room_m: Length = key(
        "About start and goal there is no obstacle nearer than this; they lie as far from the edges.", 400.0
    )
    density_1pkm2: Density = key("How many a square kilometre.", 2.0)
    gap_m: float = key(
        "Least width of the ways between them; 0 lets them touch.", 400.0, ge=0, le=MAX_COORDINATE_M
    )

    @model_validator(mode="after")
    def _has_room(self) -> _Scattered:
        if min(self.size_m) < 4 * self.room_m:
            raise ValueError(
                f"is {list(self.size_m)} m with room_m {self.room_m:g}; each side must be at least 4 x room_m"
            )
        if self.number * self.at_most > MAX_OBSTACLES:
            raise ValueError(
                f"asks for {self.number * self.at_most} obstacles; must be at most {MAX_OBSTACLES}"
            )
        return self

    @property
    def number(self) -> int:
        """How many are asked for."""
        return round(self.density_1pkm2 * self.size_m[0] * self.size_m[1] / 1e6)

    @property
    def at_most(self) -> int:
        """Obstacles that one of them can consist of."""
        return 1

    def world(self, obstacles: Iterable[ObstacleKeys]) -> GeneratedWorld:
        """The area with obstacles in it."""
        (width, height), room = self.size_m, self.room_m
        ends = (room, room), (width - room, height - room)
        return GeneratedWorld((0.0, 0.0, width, height), *ends, tuple(obstacles))

    def placed(self, radii_m: FloatArray, rng: np.random.Generator) -> list[Place | None]:
        """A middle for each disc of these radii, None for one without a place."""
        ends = self.world(())
        return placed(
            self.size_m, radii_m, self.gap_m, [(ends.start_m, self.room_m), (ends.goal_m, self.room_m)], rng
        )


class Circles(_Scattered):
    """Discs of random size."""

    radius_m: Span = key("Least and largest radius.", (80.0, 300.0))


class Forest(_Scattered):
    """Copses: each of some overlapping trunks, round ones."""

    radius_m: Span = key("Least and largest radius of a trunk.", (40.0, 80.0))
    trunks: Annotated[tuple[Count, Count], Strict(False), AfterValidator(_in_order)] = key(
        "Least and largest number of trunks in a copse.", (1, 3)
    )

    @property
    def at_most(self) -> int:
        """The trunks of a copse."""
        return self.trunks[1]


class UTraps(_Scattered):
    """Three walls each, open towards the start: the straight way in is a dead end."""

    density_1pkm2: Density = key("How many a square kilometre.", 0.3)
    width_m: Span = key("Least and largest width, walls included.", (700.0, 1100.0))
    depth_m: Span = key("Least and largest depth, walls included.", (500.0, 900.0))
    wall_m: Length = key("Thickness of the walls.", 60.0)
    turned_deg: float = key(
        "A trap is turned away from the start by up to this, either way.", 30.0, ge=0, le=180
    )

    @model_validator(mode="after")
    def _is_hollow(self) -> UTraps:
        if self.wall_m * 2 >= self.width_m[0] or self.wall_m >= self.depth_m[0]:
            raise ValueError("has walls that fill the trap; wall_m must be below depth_m and half of width_m")
        return self


class Maze(Section):
    """A random spanning tree of cells: one way between any two; the start in one corner, the goal opposite."""

    cells: Annotated[tuple[Cells, Cells], Strict(False)] = key(
        "Cells from west to east and from south to north; more than one.", (5, 5)
    )
    corridor_m: Length = key("Width of the corridors; start and goal have half of it about them.", 900.0)
    wall_m: Length = key("Thickness of the walls.", 60.0)
    loops: Share = key("Share of the remaining walls that are left out, which makes ways round.", 0.0)

    @model_validator(mode="after")
    def _leads_somewhere(self) -> Maze:
        count = self.cells[0] * self.cells[1]
        if count == 1:
            raise ValueError("has one cell; must have more")
        if count * 2 > MAX_OBSTACLES:
            raise ValueError(f"has {count} cells; must be at most {MAX_OBSTACLES // 2}")
        return self


def circles(config: Circles, rng: np.random.Generator) -> GeneratedWorld:
    """Discs by density."""
    radii = rng.uniform(*config.radius_m, config.number)
    return config.world(
        _circle(place, radius)
        for place, radius in zip(config.placed(radii, rng), radii.tolist(), strict=True)
        if place is not None
    )


def forest(config: Forest, rng: np.random.Generator) -> GeneratedWorld:
    """Copses by density."""
    copses = [_copse(config, rng) for _ in range(config.number)]
    reach = np.array([max(math.hypot(*at) + radius for at, radius in copse) for copse in copses])
    return config.world(
        _circle((place[0] + at[0], place[1] + at[1]), radius)
        for place, copse in zip(config.placed(reach, rng), copses, strict=True)
        if place is not None
        for at, radius in copse
    )


def u_traps(config: UTraps, rng: np.random.Generator) -> GeneratedWorld:
    """Traps by density."""
    widths, depths = (rng.uniform(*span, config.number) for span in (config.width_m, config.depth_m))
    turned = np.radians(rng.uniform(-config.turned_deg, config.turned_deg, config.number))
    places = config.placed(np.hypot(widths, depths) / 2, rng)
    rows = zip(places, widths.tolist(), depths.tolist(), turned.tolist(), strict=True)
    return config.world(_trap(config, place, *row) for place, *row in rows if place is not None)


def maze(config: Maze, rng: np.random.Generator) -> GeneratedWorld:
    """Walls between cells that the tree does not join, those in one line as one; the area's edge is the rim."""
    (columns, rows), wall = config.cells, config.wall_m
    pitch = config.corridor_m + wall
    width, height = columns * pitch - wall, rows * pitch - wall
    standing = _standing(config, rng)
    walls = []
    for first, last in _runs(standing):
        column, row, side = first
        x, y = column * pitch, row * pitch
        if side == 0:
            box = (x + config.corridor_m, y - wall, x + pitch, last[1] * pitch + pitch)
        else:
            box = (x - wall, y + config.corridor_m, last[0] * pitch + pitch, y + pitch)
        walls.append(_rectangle(max(box[0], 0.0), max(box[1], 0.0), min(box[2], width), min(box[3], height)))
    inset = config.corridor_m / 2
    ends = (inset, inset), (width - inset, height - inset)
    return GeneratedWorld((0.0, 0.0, width, height), *ends, tuple(walls))


GENERATORS: Final[dict[str, Callable[[Any, np.random.Generator], GeneratedWorld]]] = {
    "circles": circles,
    "forest": forest,
    "u_traps": u_traps,
    "maze": maze,
}


class WorldSpec(Section):
    """One world generator: exactly one of the shapes."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": [name]} for name in GENERATORS]})

    label: str | None = key(
        "Names it in the column `world`. Default: the generator's name.",
        None,
        pattern=r"^[a-z0-9._-]+$",
        max_length=100,
    )
    seed: int | None = key(
        "Holds the world: the same one in every case. Default: another one in every case.",
        None,
        ge=0,
        le=2**53,
    )
    circles: Circles | None = key("Discs of random size.", None)
    forest: Forest | None = key("Copses of overlapping round trunks.", None)
    u_traps: UTraps | None = key("Dead ends, open towards the start.", None)
    maze: Maze | None = key("Corridors with one way through.", None)

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


def _circle(place: Place, radius_m: float) -> ObstacleKeys:
    return {"circle": {"center_m": list(_rounded(*place)), "radius_m": round(radius_m, 1)}}


def _copse(config: Forest, rng: np.random.Generator) -> list[tuple[Place, float]]:
    """Trunks about (0, 0): the first there, the others overlapping it."""
    radii = rng.uniform(*config.radius_m, rng.integers(*config.trunks, endpoint=True)).tolist()
    angles = rng.uniform(0.0, math.tau, len(radii)).tolist()
    apart = [0.0, *(radii[0] * share for share in rng.uniform(0.3, 0.9, len(radii) - 1).tolist())]
    return [((d * math.cos(a), d * math.sin(a)), r) for d, a, r in zip(apart, angles, radii, strict=True)]


def _trap(config: UTraps, place: Place, width_m: float, depth_m: float, turned_rad: float) -> ObstacleKeys:
    (x, y), (start_x, start_y) = place, config.world(()).start_m
    opens = math.atan2(start_y - y, start_x - x) + turned_rad
    along, across = (math.cos(opens), math.sin(opens)), (-math.sin(opens), math.cos(opens))
    w, d, inside = width_m / 2, depth_m / 2, width_m / 2 - config.wall_m
    back = -d + config.wall_m
    corners = [(d, -w), (d, -inside), (back, -inside), (back, inside), (d, inside), (d, w), (-d, w), (-d, -w)]
    return _polygon(
        [(x + u * along[0] + v * across[0], y + u * along[1] + v * across[1]) for u, v in corners]
    )


def _rectangle(west: float, south: float, east: float, north: float) -> ObstacleKeys:
    return _polygon([(west, south), (east, south), (east, north), (west, north)])


def _standing(config: Maze, rng: np.random.Generator) -> set[Side]:
    """Walls that stand: a walk from cell to cell takes those away that it passes, back at dead ends."""
    columns, rows = config.cells
    walls = {(c, r, 0) for c in range(columns - 1) for r in range(rows)}
    walls |= {(c, r, 1) for c in range(columns) for r in range(rows - 1)}
    way: list[Cell] = [(0, 0)]
    seen = {way[0]}
    while way:
        column, row = way[-1]
        near = ((column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1))
        open_ = [(c, r) for c, r in near if 0 <= c < columns and 0 <= r < rows and (c, r) not in seen]
        if not open_:
            way.pop()
            continue
        after = open_[int(rng.integers(len(open_)))]
        walls.remove((min(column, after[0]), min(row, after[1]), int(after[0] == column)))
        seen.add(after)
        way.append(after)
    ordered = sorted(walls)
    gone = rng.random(len(ordered)) < config.loops
    return {wall for wall, left_out in zip(ordered, gone.tolist(), strict=True) if not left_out}


def _runs(standing: set[Side]) -> list[tuple[Side, Side]]:
    """First and last of the walls that go on in one line."""
    runs = []
    for first in sorted(standing):
        if _after(first, -1) in standing:
            continue
        last = first
        while _after(last, 1) in standing:
            last = _after(last, 1)
        runs.append((first, last))
    return runs


def _after(wall: Side, step: int) -> Side:
    column, row, side = wall
    return (column, row + step, side) if side == 0 else (column + step, row, side)


def _polygon(vertices_m: list[Place]) -> ObstacleKeys:
    return {"polygon": {"vertices_m": [list(_rounded(*vertex)) for vertex in vertices_m]}}


def _rounded(east_m: float, north_m: float) -> Place:
    return round(float(east_m), 1), round(float(north_m), 1)
