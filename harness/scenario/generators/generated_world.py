"""What a world generator makes, and what the keys of all generators have in common.

Frame: local ENU plane, x = east, y = north, metres; the south-west corner of every generated area is (0, 0).
Places and sizes of obstacles are rounded to 0.1 m, so that a world can be read and written by hand.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Final

from pydantic import AfterValidator, Field, Strict

from harness.scenario.sections import MAX_COORDINATE_M

MAX_OBSTACLES: Final = 100_000
"""A generator that is asked for more is refused."""

MAX_CORNERS: Final = 500_000
"""The same for all polygons together; a scenario file with as many can still be read."""

ObstacleKeys = dict[str, Any]
"""One obstacle as a scenario file has it."""


@dataclass(frozen=True)
class GeneratedWorld:
    """An area with its obstacles and a mission through it.

    Attributes:
        bounds_m: xmin, ymin, xmax, ymax.
        start_m: east, north.
        goal_m: east, north.
        obstacles: as in a scenario file.
    """

    bounds_m: tuple[float, float, float, float]
    start_m: tuple[float, float]
    goal_m: tuple[float, float]
    obstacles: tuple[ObstacleKeys, ...]


def _in_order(span: tuple[float, float]) -> tuple[float, float]:
    if span[0] > span[1]:
        raise ValueError(f"is {list(span)}; must be [least, most]")
    return span


Length = Annotated[float, Field(gt=0, le=MAX_COORDINATE_M)]
Span = Annotated[tuple[Length, Length], Strict(False), AfterValidator(_in_order)]
"""Least and most; drawn evenly between them."""


def polygon(vertices_m: list[tuple[float, float]]) -> ObstacleKeys:
    """A polygon as a scenario file has it."""
    return {"polygon": {"vertices_m": [list(rounded(*vertex)) for vertex in vertices_m]}}


def rounded(east_m: float, north_m: float) -> tuple[float, float]:
    """A point to 0.1 m."""
    return round(float(east_m), 1), round(float(north_m), 1)
