"""Generators of worlds whose obstacles lie about: circles, polygons, a forest, U-shaped traps.

Each is a frozen section of a campaign file and a pure function of it and a seed. Obstacles are placed one by
one, wherever they leave the gap to those before and the room about start and goal; one that finds no place in
`TRIES` is left out, so a crowded area holds fewer than were asked for. The start lies in the south-west corner
and the goal in the north-east one, `room_m` from both edges.
"""

from __future__ import annotations

import itertools
import math
from bisect import insort
from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Strict, model_validator

from harness.scenario.generators.generated_world import (
    MAX_CORNERS,
    MAX_OBSTACLES,
    GeneratedWorld,
    Length,
    ObstacleKeys,
    Span,
    polygon,
    rounded,
)
from harness.scenario.sections import MAX_COORDINATE_M, Section, key

TRIES: Final = 100
AT_ONCE: Final = 10
"""Number of places that are tried at a time."""

FULL: Final = 5000
"""After so many without a place the area is full, and nothing more is tried."""

MOST_COLUMNS: Final = 1000
TRAP_CORNERS: Final = 8

FloatArray = NDArray[np.float64]
Place = tuple[float, float]
Count = Annotated[int, Field(ge=1, le=1000)]


class _Scattered(Section):
    """What all of them have."""

    size_m: Annotated[tuple[Length, Length], Strict(False)] = key(
        "Width and height of the area.", unit="m", default=(5000.0, 5000.0)
    )
    room_m: float = key(
        "About start and goal there is no obstacle nearer than this; they lie as far from the edges.",
        unit="m",
        default=400.0,
        gt=0,
        le=MAX_COORDINATE_M,
    )
    density_1pkm2: float = key("How many a square kilometre.", unit="1/km2", default=2.0, ge=0, le=1e6)
    gap_m: float = key(
        "Least width of the ways between them; 0 lets them touch.",
        unit="m",
        default=400.0,
        ge=0,
        le=MAX_COORDINATE_M,
    )

    @model_validator(mode="after")
    def _has_room(self) -> _Scattered:
        if min(self.size_m) < 4 * self.room_m:
            raise ValueError(
                f"is {list(self.size_m)} m with room_m {self.room_m:g}; each side must be at least 4 x room_m"
            )
        each, corners = self.at_most
        if self.number * each > MAX_OBSTACLES:
            raise ValueError(f"asks for {self.number * each} obstacles; must be at most {MAX_OBSTACLES}")
        if self.number * corners > MAX_CORNERS:
            raise ValueError(
                f"asks for {self.number} obstacles of {corners} corners; must be at most {MAX_CORNERS} corners"
            )
        return self

    @property
    def number(self) -> int:
        """How many are asked for."""
        return round(self.density_1pkm2 * self.size_m[0] * self.size_m[1] / 1e6)

    @property
    def at_most(self) -> tuple[int, int]:
        """Obstacles and corners of polygons that one of them can consist of."""
        return 1, 0

    def world(self, obstacles: Iterable[ObstacleKeys]) -> GeneratedWorld:
        """The area with obstacles in it."""
        (width, height), room = self.size_m, self.room_m
        return GeneratedWorld(
            (0.0, 0.0, width, height), (room, room), (width - room, height - room), tuple(obstacles)
        )


class Circles(_Scattered):
    """Discs of random size."""

    radius_m: Span = key("Least and largest radius.", unit="m", default=(80.0, 300.0))


class Polygons(_Scattered):
    """Polygons of random shape, convex or not."""

    radius_m: Span = key(
        "Least and largest radius of the circle about one; its corners lie between half of it and all of it.",
        unit="m",
        default=(100.0, 350.0),
    )
    corners: Annotated[tuple[Count, Count], Strict(False)] = key(
        "Least and largest number of corners.", unit="1", default=(3, 8)
    )

    @model_validator(mode="after")
    def _has_corners(self) -> Polygons:
        if not 3 <= self.corners[0] <= self.corners[1]:
            raise ValueError(f"has corners {list(self.corners)}; must be [least, most], at least 3")
        return self

    @property
    def at_most(self) -> tuple[int, int]:
        """One polygon."""
        return 1, self.corners[1]


class Forest(_Scattered):
    """Copses: each of some overlapping trunks, round ones."""

    radius_m: Span = key("Least and largest radius of a trunk.", unit="m", default=(40.0, 80.0))
    trunks: Annotated[tuple[Count, Count], Strict(False)] = key(
        "Least and largest number of trunks in a copse.", unit="1", default=(1, 3)
    )

    @model_validator(mode="after")
    def _has_trunks(self) -> Forest:
        if self.trunks[0] > self.trunks[1]:
            raise ValueError(f"has trunks {list(self.trunks)}; must be [least, most]")
        return self

    @property
    def at_most(self) -> tuple[int, int]:
        """A copse of round trunks."""
        return self.trunks[1], 0


class UTraps(_Scattered):
    """Three walls each, open towards the start: the straight way in is a dead end."""

    density_1pkm2: float = key("How many a square kilometre.", unit="1/km2", default=0.3, ge=0, le=1e6)
    width_m: Span = key("Least and largest width, walls included.", unit="m", default=(700.0, 1100.0))
    depth_m: Span = key("Least and largest depth, walls included.", unit="m", default=(500.0, 900.0))
    wall_m: float = key("Thickness of the walls.", unit="m", default=60.0, gt=0, le=MAX_COORDINATE_M)
    turned_deg: float = key(
        "A trap is turned away from the start by up to this, either way.",
        unit="deg",
        default=30.0,
        ge=0,
        le=180,
    )

    @model_validator(mode="after")
    def _is_hollow(self) -> UTraps:
        if self.wall_m * 2 >= self.width_m[0] or self.wall_m >= self.depth_m[0]:
            raise ValueError("has walls that fill the trap; wall_m must be below depth_m and half of width_m")
        return self

    @property
    def at_most(self) -> tuple[int, int]:
        """One trap."""
        return 1, TRAP_CORNERS


def circles(config: Circles, rng: np.random.Generator) -> GeneratedWorld:
    """Discs by density."""
    radii = rng.uniform(*config.radius_m, config.number)
    return config.world(
        _circle(place, radius)
        for place, radius in zip(_placed(config, radii, rng), radii.tolist(), strict=True)
        if place is not None
    )


def polygons(config: Polygons, rng: np.random.Generator) -> GeneratedWorld:
    """Polygons by density, star-shaped about their middles, so that none crosses itself."""
    radii = rng.uniform(*config.radius_m, config.number)
    places = _placed(config, radii, rng)
    return config.world(
        polygon(_star(place, radius, int(rng.integers(*config.corners, endpoint=True)), rng))
        for place, radius in zip(places, radii.tolist(), strict=True)
        if place is not None
    )


def forest(config: Forest, rng: np.random.Generator) -> GeneratedWorld:
    """Copses by density."""
    copses = [_copse(config, rng) for _ in range(config.number)]
    reach = np.array([max(math.hypot(*at) + radius for at, radius in copse) for copse in copses])
    return config.world(
        _circle((place[0] + at[0], place[1] + at[1]), radius)
        for place, copse in zip(_placed(config, reach, rng), copses, strict=True)
        if place is not None
        for at, radius in copse
    )


def u_traps(config: UTraps, rng: np.random.Generator) -> GeneratedWorld:
    """Traps by density."""
    widths, depths = (rng.uniform(*span, config.number) for span in (config.width_m, config.depth_m))
    turned = np.radians(rng.uniform(-config.turned_deg, config.turned_deg, config.number))
    places = _placed(config, np.hypot(widths, depths) / 2, rng)
    rows = zip(places, widths.tolist(), depths.tolist(), turned.tolist(), strict=True)
    return config.world(_trap(config, place, *row) for place, *row in rows if place is not None)


def _placed(config: _Scattered, radii: FloatArray, rng: np.random.Generator) -> list[Place | None]:
    """A middle for each disc of these radii, None for one without a place."""
    largest, ends = float(radii.max(initial=0.0)), config.world(())
    cell_m = max(2 * largest + config.gap_m, max(config.size_m) / MOST_COLUMNS)
    taken = _Taken(cell_m, largest)
    for end in (ends.start_m, ends.goal_m):
        taken.add(end, config.room_m)
    found: list[Place | None] = []
    in_vain = 0
    for radius in radii.tolist():
        free = (taken.first_free(places, radius) for places in _tries(config, rng))
        place = next(filter(None, free), None) if in_vain < FULL else None
        found.append(place)
        if place is None:
            in_vain += 1
        else:
            taken.add(place, radius + config.gap_m)
    return found


def _tries(config: _Scattered, rng: np.random.Generator) -> Iterator[list[Place]]:
    for _ in range(TRIES // AT_ONCE):
        yield (rng.random((AT_ONCE, 2)) * config.size_m).tolist()


class _Taken:
    """Discs, each in all square cells where it can matter to another.

    Args:
        cell_m: side of a cell.
        largest_m: radius of the largest disc that is looked for a place.
    """

    def __init__(self, cell_m: float, largest_m: float) -> None:
        self._cell_m, self._largest_m = cell_m, largest_m
        # East, north and what is kept of all that can matter to a cell.
        self._near: defaultdict[tuple[int, int], list[tuple[float, float, float]]] = defaultdict(list)

    def add(self, place: Place, kept_m: float) -> None:
        column, row = (int(along_m // self._cell_m) for along_m in place)
        reach = max(math.ceil((kept_m + self._largest_m) / self._cell_m), 1)
        for near in itertools.product(
            range(column - reach, column + reach + 1), range(row - reach, row + reach + 1)
        ):
            # The large ones first: they are the most likely to be in the way.
            insort(self._near[near], (*place, kept_m), key=lambda disc: -disc[2])

    def first_free(self, places: Iterable[Place], radius_m: float) -> Place | None:
        """The first place where a disc keeps from every other one what that asks for; None where there is none."""
        near, cell_m = self._near, self._cell_m
        for east, north in places:
            for x, y, kept_m in near.get((int(east // cell_m), int(north // cell_m)), ()):
                apart_m = kept_m + radius_m
                if (east - x) * (east - x) + (north - y) * (north - y) < apart_m * apart_m:
                    break
            else:
                return east, north
        return None


def _circle(place: Place, radius_m: float) -> ObstacleKeys:
    return {"circle": {"center_m": list(rounded(*place)), "radius_m": round(radius_m, 1)}}


def _star(place: Place, radius_m: float, corners: int, rng: np.random.Generator) -> list[Place]:
    """Corners in order round a middle, none more than half a turn after the one before."""
    angles = math.tau * (np.arange(corners) + rng.uniform(0.0, 0.4, corners)) / corners + rng.uniform(
        0.0, math.tau
    )
    reach = radius_m * rng.uniform(0.5, 1.0, corners)
    return [
        (place[0] + r * math.cos(a), place[1] + r * math.sin(a))
        for a, r in zip(angles.tolist(), reach.tolist(), strict=True)
    ]


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
    return polygon([(x + u * along[0] + v * across[0], y + u * along[1] + v * across[1]) for u, v in corners])
