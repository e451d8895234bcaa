"""The obstacles of a scenario file as frozen types: attribute = key."""

from __future__ import annotations

import itertools
from typing import Annotated

from pydantic import ConfigDict, FailFast, Strict, field_validator, model_validator

from harness.scenario.sections import MAX_COORDINATE_M, Interval, Point, Section, Velocity, key


class Circle(Section):
    """A disc."""

    center_m: Point = key("Centre: east, north.", unit="m")
    radius_m: float = key("Radius.", unit="m", gt=0, le=MAX_COORDINATE_M)


class Polygon(Section):
    """A simple polygon, convex or not, its vertices in either direction; kept without repeated vertices."""

    vertices_m: Annotated[tuple[Point, ...], Strict(False), FailFast()] = key(
        "Vertices in order round the shape: east, north. One that repeats the vertex before it, or the first at the "
        "end, is dropped.",
        unit="m",
        min_length=3,
    )

    @field_validator("vertices_m")
    @classmethod
    def _enclose_an_area(cls, vertices_m: tuple[Point, ...]) -> tuple[Point, ...]:
        import shapely

        ring = tuple(vertex for vertex, _ in itertools.groupby(vertices_m))
        if len(ring) > 1 and ring[0] == ring[-1]:
            ring = ring[:-1]
        if len(ring) < 3:
            raise ValueError(f"has {len(ring)} distinct vertices; must be at least 3")
        shape = shapely.Polygon(ring)
        if shape.convex_hull.area == 0:
            raise ValueError("encloses no area: its vertices lie on one line; must be a polygon")
        if not shape.is_valid:
            where = shapely.is_valid_reason(shape).partition("[")[2].rstrip("]").replace(" ", ", ")
            raise ValueError(
                f"crosses or touches itself at ({where}); give the vertices in order round the shape"
            )
        return ring


class Obstacle(Section):
    """One obstacle, unknown to the planner until sensed: a circle or a polygon."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [
                {"required": ["circle"], "not": {"required": ["polygon"]}},
                {"required": ["polygon"], "not": {"required": ["circle"]}},
            ]
        }
    )

    circle: Circle | None = key("Its shape, if it is round.", default=None)
    polygon: Polygon | None = key("Its shape, if it has corners.", default=None)
    velocity_mps: Velocity | None = key(
        "Moves in a straight line: east, north; as its shape says at active_s[0]. Default: it stands still.",
        unit="m/s",
        default=None,
    )
    active_s: Interval | None = key(
        "Pops up at the first time and is gone after the second. Default: there for the whole flight.",
        unit="s",
        default=None,
    )

    @model_validator(mode="after")
    def _has_one_shape(self) -> Obstacle:
        if (self.circle is None) == (self.polygon is None):
            have = "neither" if self.circle is None else "both"
            raise ValueError(f"has {have} of circle and polygon; must have exactly one")
        return self

    @field_validator("active_s")
    @classmethod
    def _starts_before_it_stops(cls, active_s: Interval | None) -> Interval | None:
        if active_s and not active_s[0] < active_s[1]:
            raise ValueError(f"is {list(active_s)}; must be [start, stop] with start < stop")
        return active_s

    @property
    def fixed(self) -> bool:
        """Whether it is there, and at the same place, at every time."""
        return self.active_s is None and self.velocity_mps in (None, (0.0, 0.0))
