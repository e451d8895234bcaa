"""Fences and areas that come with a path, which the aircraft must stay out of, or stay inside of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from harness.files.input_file import InputError
from harness.files.mavlink.items import Fence, Place

if TYPE_CHECKING:
    from shapely import Geometry


@dataclass(frozen=True)
class Fences:
    """All fences of a path; the aircraft stays `inside_all` inclusion fences (ArduPilot), or in one of them (PX4)."""

    every: tuple[Fence, ...] = ()
    inside_all: bool = False

    @property
    def inclusions(self) -> tuple[Fence, ...]:
        """Fences to stay inside of."""
        return tuple(fence for fence in self.every if fence.inclusion)

    @cached_property
    def allowed(self) -> Geometry | None:
        """The area where the inclusion fences let the aircraft be; None without any."""
        import shapely

        if not (areas := [fence.area for fence in self.inclusions]):
            return None
        return shapely.intersection_all(areas) if self.inside_all else shapely.union_all(areas)


def in_plane(fences: Fences, plane: Callable[[Place], Place], source: str) -> Fences:
    """Returns fences in the local plane; an InputError if one encloses no valid area, or no place is inside of all."""
    moved = replace(fences, every=tuple(fence.moved(plane) for fence in fences.every))
    for fence in moved.every:
        _check_area(fence, source)
    if moved.allowed is not None and moved.allowed.is_empty:
        names = ", ".join(fence.name for fence in moved.inclusions)
        raise InputError(f"{source}: {names}: have no place in common; must have one to stay inside")
    return moved


def _check_area(fence: Fence, source: str) -> None:
    import shapely

    if fence.center is None and any(len(set(ring)) < 3 for ring in fence.rings or ((),)):
        raise InputError(f"{source}: {fence.name}: has fewer than 3 distinct corners; must enclose an area")
    if not fence.area.area > 0.0:
        raise InputError(f"{source}: {fence.name}: encloses no area; must be a polygon or a circle")
    if not fence.area.is_valid:
        reason, _, where = shapely.is_valid_reason(fence.area).partition("[")
        place = ", ".join(f"{float(number):.0f}" for number in where.rstrip("]").split()[:2])
        text = f"{source}: {fence.name}: {reason.lower()} at ({place}) m from the path's origin"
        raise InputError(f"{text}; give its corners in order round the area")
