"""Fences and areas that come with a path: what the aircraft must stay out of, or stay inside of."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from harness.files.input_file import InputError

if TYPE_CHECKING:
    from shapely import Geometry

FloatArray = NDArray[np.float64]
Place = tuple[float, float]

CIRCLE_SIDES = 720
"""A circle is compared as a polygon of so many sides: one of 10 km is off by 0.1 m."""


@dataclass(frozen=True)
class Fence:
    """An area to stay out of, or inside of.

    Attributes:
        name: what it is called: where in its file it stands.
        inclusion: to stay inside of; else to stay out of.
        rings: the outer ring and its holes, (east, north) in metres, or latitude and longitude in degrees while it
            is being read; empty for a circle.
        center: of a circle, likewise.
        radius_m: of a circle.
        stated: the file says which of both it is.
    """

    name: str
    inclusion: bool
    rings: tuple[tuple[Place, ...], ...] = ()
    center: Place | None = None
    radius_m: float = 0.0
    stated: bool = True

    @property
    def kind(self) -> str:
        """One word for people."""
        return "inclusion" if self.inclusion else "exclusion"

    @cached_property
    def area(self) -> Geometry:
        """What it encloses."""
        import shapely

        if self.center is not None:
            return shapely.Point(self.center).buffer(self.radius_m, quad_segs=CIRCLE_SIDES // 4)
        return shapely.Polygon(self.rings[0], self.rings[1:])

    def stated_as(self, inclusion: bool) -> Fence:
        """The same fence as one of both, unless its file says which."""
        return self if self.stated else replace(self, inclusion=inclusion)

    def moved(self, place: Callable[[Place], Place]) -> Fence:
        """The same fence with every position put elsewhere."""
        rings = tuple(tuple(map(place, ring)) for ring in self.rings)
        return replace(self, rings=rings, center=place(self.center) if self.center is not None else None)

    def plain(self) -> dict[str, Any]:
        """Its content for `metrics.json`."""
        shape: dict[str, Any] = {"rings_m": [[list(point) for point in ring] for ring in self.rings]}
        if self.center is not None:
            shape = {"center_m": list(self.center), "radius_m": self.radius_m}
        return {"name": self.name, "kind": self.kind, **shape}


@dataclass(frozen=True)
class Fences:
    """All fences of a path.

    Attributes:
        every: in the order of the file.
        inside_all: of several to stay inside of, all count, as ArduPilot has it; else one is enough, as PX4 has it.
    """

    every: tuple[Fence, ...] = ()
    inside_all: bool = False

    @property
    def exclusions(self) -> tuple[Fence, ...]:
        """Those to stay out of."""
        return tuple(fence for fence in self.every if not fence.inclusion)

    @property
    def inclusions(self) -> tuple[Fence, ...]:
        """Those to stay inside of."""
        return tuple(fence for fence in self.every if fence.inclusion)

    @cached_property
    def allowed(self) -> Geometry | None:
        """Where the inclusion fences let the aircraft be; None where there is none."""
        import shapely

        areas = [fence.area for fence in self.inclusions]
        if not areas:
            return None
        return shapely.intersection_all(areas) if self.inside_all else shapely.union_all(areas)

    def moved(self, place: Callable[[Place], Place]) -> Fences:
        """The same fences with every position put elsewhere."""
        return replace(self, every=tuple(fence.moved(place) for fence in self.every))


def checked(fence: Fence, source: str) -> Fence:
    """A fence in the plane, its rings cleaned of repeated and closing points.

    Raises:
        InputError: it encloses no area, or crosses itself.
    """
    import shapely

    rings = tuple(_cleaned(ring) for ring in fence.rings)
    clean = replace(fence, rings=rings)
    if fence.center is None and min(map(len, rings), default=0) < 3:
        raise InputError(f"{source}: {fence.name}: has fewer than 3 distinct corners; must enclose an area")
    if not clean.area.area > 0.0:
        raise InputError(f"{source}: {fence.name}: encloses no area; must be a polygon or a circle")
    if not clean.area.is_valid:
        reason, _, where = shapely.is_valid_reason(clean.area).partition("[")
        place = ", ".join(f"{float(number):.0f}" for number in where.rstrip("]").split()[:2])
        raise InputError(
            f"{source}: {fence.name}: {reason.lower()} at ({place}) m from the path's origin; give its "
            "corners in order round the area"
        )
    return clean


def _cleaned(ring: Sequence[Place]) -> tuple[Place, ...]:
    kept = [point for number, point in enumerate(ring) if not number or point != ring[number - 1]]
    if len(kept) > 1 and kept[0] == kept[-1]:
        kept.pop()
    return tuple(kept)
