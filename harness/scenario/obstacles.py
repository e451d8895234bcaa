"""The obstacles of a scenario file as frozen types: attribute = key."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, ConfigDict, FailFast, Field, Strict, model_validator

from harness.scenario.sections import MAX_COORDINATE_M, Interval, Point, Section, Velocity, given, in_order

Height = Annotated[float, Field(ge=-1000, le=30_000)]
Shift = Annotated[float, Field(ge=-1e9, le=1e9)]
KindName = Literal[
    "geotiff", "ascii_grid", "srtm", "numpy_dem", "osm", "osm_pbf", "cityjson", "geojson", "kml", "openair",
    "ed269", "ed318", "plan_fence", "ardupilot_fence", "ros_map", "moving_ai",
    "terrain", "buildings", "airspace", "fences", "occupancy",
]  # fmt: skip


class Circle(Section):
    """A disc."""

    center_m: Point
    """Centre: east, north."""
    radius_m: Annotated[float, Field(gt=0, le=MAX_COORDINATE_M)]
    """Radius."""


def _simple(points: tuple[Point, ...]) -> tuple[Point, ...]:
    """Drops vertices that repeat the one before, or at the end the first; a ValueError says why it is no polygon."""
    import shapely

    ring = tuple(point for index, point in enumerate(points) if not index or point != points[index - 1])
    if len(ring := ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring) < 3:
        raise ValueError(f"has {len(ring)} distinct vertices; must be at least 3")
    if (shape := shapely.Polygon(ring)).convex_hull.area == 0:
        raise ValueError("encloses no area: its vertices lie on one line; must be a polygon")
    if not shape.is_valid:
        where = shapely.is_valid_reason(shape).partition("[")[2].rstrip("]").replace(" ", ", ")
        raise ValueError(f"crosses or touches itself at ({where}); give the vertices in order round the shape")
    return ring


Ring = Annotated[tuple[Point, ...], Strict(False), Field(min_length=3), AfterValidator(_simple)]


class Polygon(Section):
    """A simple polygon, convex or not, its vertices in either direction; kept without repeated vertices."""

    vertices_m: Annotated[tuple[Point, ...], Strict(False), FailFast(), Field(min_length=3), AfterValidator(_simple)]
    """Vertices in order round the shape: east, north. Repeated ones, also the first at the end, are dropped."""
    holes_m: Annotated[tuple[Ring, ...], Strict(False)] | None = None
    """Rings inside the shape, in either direction, within which it is free. Default: none."""

    @model_validator(mode="after")
    def _has_its_holes_inside(self) -> Polygon:
        import shapely

        if self.holes_m and not (shape := shapely.Polygon(self.vertices_m, self.holes_m)).is_valid:
            what, _, where = shapely.is_valid_reason(shape).partition("[")
            fault = f"{what.lower()} at ({where.rstrip(']').replace(' ', ', ')})"
            wrong = f"has holes_m that lie outside of it, cross or touch ({fault})"
            raise ValueError(f"{wrong}; each hole must lie inside, apart from the others")
        return self


class WorldFile(Section):
    """What of a file of terrain, buildings, airspace, fences or occupancy is solid at the mission's altitude."""

    path: Annotated[str, Field(min_length=1, max_length=1000)]
    """The file, from the scenario's folder or from here; package:path lies in an installed Python package."""
    kind: KindName | None = None
    """Its kind, or what it holds: terrain, buildings, airspace, fences or occupancy. Default: told from the file."""
    vertical_clearance_m: Annotated[float, Field(ge=0, le=10_000)] = 10.0
    """A part is an obstacle where it reaches into the band of so much below and above mission.altitude_m."""
    metres_per_cell: Annotated[float | None, Field(gt=0, le=MAX_COORDINATE_M)] = None
    """Side of a cell of an occupancy map, or of a grid with no place on earth. Default: the file's, else 1 m."""
    shift_m: Annotated[tuple[Shift, Shift], Strict(False)] = (0.0, 0.0)
    """East and north, added to the metres of a file that names no place on earth."""
    crs: Annotated[str | None, Field(min_length=1, max_length=200)] = None
    """Coordinate reference system of a file that names none, as EPSG:28992. Default: as the file says."""
    tolerance_m: Annotated[float | None, Field(ge=0, le=10_000)] = None
    """Notches of outlines up to so deep are filled. Default: a cell of a raster, else 0.1 m."""
    nodata: Literal["solid", "free"] = "solid"
    """What cells of terrain without a height are."""
    unknown: Literal["occupied", "free"] = "free"
    """What unknown cells of an occupancy map are."""
    default_height_m: Annotated[float, Field(ge=0, le=1000)] = 6.0
    """Height of a building that gives neither height nor levels above where it begins, from there on."""
    ground_m: Annotated[float | None, Field(ge=-1000, le=9000)] = None
    """Height of flat ground where no terrain is known. Default: 0 below buildings; zones above ground are refused."""


class Obstacle(Section):
    """One obstacle, unknown to the planner until sensed: a circle, a polygon, or what a file holds."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [given(e) for e in ("circle", "polygon", "file")]})

    circle: Circle | None = None
    """Its shape, if it is round."""
    polygon: Polygon | None = None
    """Its shape, if it has corners."""
    file: WorldFile | None = None
    """A file: what of it is solid at the mission's altitude."""
    velocity_mps: Velocity | None = None
    """Moves in a straight line: east, north; as its shape says at active_s[0]. Default: it stands still."""
    active_s: Interval | None = None
    """Pops up at the first time and is gone after the second. Default: there for the whole flight."""
    heights_m: Annotated[tuple[Height, Height], Strict(False), AfterValidator(in_order)] | None = None
    """Bottom and top above mean sea level, for drawings; twice the same: terrain, cut there. Default: without end."""

    @model_validator(mode="after")
    def _has_one_shape(self) -> Obstacle:
        have = [name for name in ("circle", "polygon", "file") if getattr(self, name) is not None]
        if len(have) != 1:
            which = f"both of {' and '.join(have)}" if have else "neither of circle, polygon and file"
            raise ValueError(f"has {which}; must have exactly one")
        for name, has in (("velocity_mps", "stands still"), ("heights_m", "has its own heights")):
            if self.file and getattr(self, name) is not None:
                raise ValueError(f"is a file with {name}; what a file holds {has}")
        return self

    @property
    def fixed(self) -> bool:
        """Whether the obstacle stands at one place for the whole flight."""
        return self.active_s is None and self.velocity_mps in (None, (0.0, 0.0))
