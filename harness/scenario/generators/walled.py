"""Generators of worlds of walls and streets: a town, a maze, a spiral.

Each is a frozen section of a campaign file and a pure function of it and a seed.
"""

from __future__ import annotations

import math
from typing import Annotated, Final

import numpy as np
from pydantic import Field, Strict, model_validator

from harness.scenario.generators.generated_world import (
    MAX_OBSTACLES,
    GeneratedWorld,
    ObstacleKeys,
    Span,
    polygon,
)
from harness.scenario.sections import MAX_COORDINATE_M, Section, key

SPIRAL_STEP_RAD: Final = math.radians(10.0)

Cells = Annotated[int, Field(ge=1, le=300)]
Cell = tuple[int, int]
Side = tuple[int, int, int]
"""Column and row of a cell, and 0 for the wall to its east, 1 for the one to its north."""


class Town(Section):
    """Buildings in a grid of streets; the start is in the street at the south-west corner, the goal opposite."""

    blocks: Annotated[tuple[Cells, Cells], Strict(False)] = key(
        "Blocks from west to east and from south to north.", unit="1", default=(5, 5)
    )
    block_m: float = key("Side of a block.", unit="m", default=400.0, gt=0, le=MAX_COORDINATE_M)
    street_m: float = key(
        "Least width of the streets; start and goal have half of it about them.",
        unit="m",
        default=500.0,
        gt=0,
        le=MAX_COORDINATE_M,
    )
    built: float = key("Probability that a block is built on.", unit="1", default=0.85, ge=0, le=1)
    share: Span = key(
        "Least and largest share of a block's side that its building takes.", default=(0.5, 1.0)
    )

    @model_validator(mode="after")
    def _fits(self) -> Town:
        if self.share[1] > 1:
            raise ValueError(f"has share {list(self.share)}; must be at most 1")
        return self


class Maze(Section):
    """A random spanning tree of cells: one way between any two; the start in one corner, the goal opposite."""

    cells: Annotated[tuple[Cells, Cells], Strict(False)] = key(
        "Cells from west to east and from south to north; more than one.", unit="1", default=(5, 5)
    )
    corridor_m: float = key(
        "Width of the corridors; start and goal have half of it about them.",
        unit="m",
        default=900.0,
        gt=0,
        le=MAX_COORDINATE_M,
    )
    wall_m: float = key("Thickness of the walls.", unit="m", default=60.0, gt=0, le=MAX_COORDINATE_M)
    loops: float = key(
        "Share of the remaining walls that are left out, which makes ways round.",
        unit="1",
        default=0.0,
        ge=0,
        le=1,
    )

    @model_validator(mode="after")
    def _leads_somewhere(self) -> Maze:
        if self.cells == (1, 1):
            raise ValueError("has one cell; must have more")
        if self.cells[0] * self.cells[1] * 2 > MAX_OBSTACLES:
            raise ValueError(
                f"has {self.cells[0] * self.cells[1]} cells; must be at most {MAX_OBSTACLES // 2}"
            )
        return self


class Spiral(Section):
    """A wall that winds round the goal, turned and handed at random; the start lies west of it."""

    turns: float = key("How often it winds round.", unit="1", default=1.5, ge=0.25, le=50)
    corridor_m: float = key(
        "Width of the way in; start and goal have half of it about them.",
        unit="m",
        default=900.0,
        gt=0,
        le=MAX_COORDINATE_M / 100,
    )
    wall_m: float = key("Thickness of the wall.", unit="m", default=60.0, gt=0, le=MAX_COORDINATE_M / 100)


def town(config: Town, rng: np.random.Generator) -> GeneratedWorld:
    """A building of random size in the middle of each block that is built on."""
    pitch = config.block_m + config.street_m
    columns, rows = config.blocks
    built = rng.random((columns, rows)) < config.built
    sides = config.block_m * rng.uniform(*config.share, (columns, rows, 2))
    buildings = []
    for column, row in np.argwhere(built).tolist():
        x = config.street_m + column * pitch + config.block_m / 2
        y = config.street_m + row * pitch + config.block_m / 2
        w, h = (sides[column, row] / 2).tolist()
        buildings.append(_rectangle(x - w, y - h, x + w, y + h))
    width, height = columns * pitch + config.street_m, rows * pitch + config.street_m
    inset = config.street_m / 2
    return GeneratedWorld(
        (0.0, 0.0, width, height), (inset, inset), (width - inset, height - inset), tuple(buildings)
    )


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
    return GeneratedWorld(
        (0.0, 0.0, width, height), (inset, inset), (width - inset, height - inset), tuple(walls)
    )


def spiral(config: Spiral, rng: np.random.Generator) -> GeneratedWorld:
    """A band about r = pitch (1 + angle / full turn), Archimedes' spiral, as one polygon."""
    pitch, half_wall = config.corridor_m + config.wall_m, config.wall_m / 2
    turned, hand = rng.uniform(0.0, math.tau), rng.choice((-1.0, 1.0))
    sweep = math.tau * config.turns
    angles = np.linspace(0.0, sweep, math.ceil(sweep / SPIRAL_STEP_RAD) + 1)
    middle = pitch * (1.0 + angles / math.tau)
    reach = float(middle[-1]) + half_wall
    size = round(2 * (reach + 2 * config.corridor_m), 1)
    radii = np.concatenate((middle + half_wall, (middle - half_wall)[::-1]))
    bearings = turned + hand * np.concatenate((angles, angles[::-1]))
    east, north = size / 2 + radii * np.cos(bearings), size / 2 + radii * np.sin(bearings)
    return GeneratedWorld(
        (0.0, 0.0, size, size),
        (config.corridor_m, size / 2),
        (size / 2, size / 2),
        (polygon(list(zip(east.tolist(), north.tolist(), strict=True))),),
    )


def _rectangle(west: float, south: float, east: float, north: float) -> ObstacleKeys:
    return polygon([(west, south), (east, south), (east, north), (west, north)])


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
