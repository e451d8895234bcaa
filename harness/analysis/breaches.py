"""Where a flown track touched an obstacle, crossed a fence or left the area: when, where and how deep.

A track is known ten times a second; between two rows it is taken to be straight. What it crosses there counts as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from harness.flight.record import FloatArray, Track
from harness.run_files.fences import Fences
from harness.world.world import World

if TYPE_CHECKING:
    from shapely import Geometry

CONTACT: Final = "obstacle"  # kind of a breach: contact with an obstacle
TERRAIN: Final = "terrain"  # kind of a breach: contact with the ground
CONTACTS: Final = (CONTACT, TERRAIN)
"""Kinds of breaches that are contacts; the others are crossings of lines in the air."""


@dataclass(frozen=True)
class Breach:
    """A stretch of flight where the aircraft was where it must not be, and when, where and how far in it was deepest.

    `kind` is `obstacle`, `terrain`, `exclusion`, `inclusion` or `area`.
    """

    kind: str
    name: str
    start_s: float
    end_s: float
    time_s: float
    east_m: float
    north_m: float
    up_m: float
    depth_m: float


@dataclass(frozen=True, eq=False)
class Separation:
    """Result of comparing a track with the world: its distances from obstacles, fences and ground, and its breaches."""

    breaches: tuple[Breach, ...]  # in order of time
    nearest_m: FloatArray
    """(n,) distances from the nearest edge of obstacles and fences, negative if one was crossed; +inf without any."""
    height_m: dict[str, float] | None = None
    """Above ground: `min`, `mean` and where the least was; None where the ground is not known anywhere."""

    @property
    def contacts(self) -> tuple[Breach, ...]:
        """Returns the breaches that are contacts with obstacles or terrain."""
        return tuple(each for each in self.breaches if each.kind in CONTACTS)

    @property
    def crossings(self) -> tuple[Breach, ...]:
        """Returns the breaches that are crossings of fences and of the area's bounds."""
        return tuple(each for each in self.breaches if each.kind not in CONTACTS)


def compare(
    track: Track,
    world: World,
    fences: Fences,
    bounded: bool,
    others: tuple[Sequence[Breach], FloatArray | float] = ((), math.inf),
) -> Separation:
    """Compares a track with obstacles, fences and, if `bounded`, the area; `others`: breaches, margins found before."""
    import shapely

    found = [*_contacts(track, world), *others[0]]
    nearest_m = np.minimum(track.clearance_m, others[1])
    for area, kind, name in _fence_areas(fences):
        stays_in = kind == "inclusion"
        margin = inside_m(track, area) if stays_in else -inside_m(track, area)
        nearest_m = np.minimum(nearest_m, margin)
        found += stretches(track, crossed(track, margin, area, stays_in=stays_in), kind, name)
    rows = np.searchsorted(track.time_s, [each.time_s for each in found])  # of one between two rows the first
    np.minimum.at(nearest_m, rows, [-each.depth_m for each in found])
    found += stretches(track, np.nan_to_num(track.altitude_above_ground_m, nan=np.inf), TERRAIN, "the ground")
    if bounded:
        area = shapely.box(*world.bounds_m)
        margin = crossed(track, inside_m(track, area), area, stays_in=True)
        found += stretches(track, margin, "area", "area.bounds_m")
    return Separation(tuple(sorted(found, key=lambda each: each.start_s)), nearest_m, _heights(track))


def _fence_areas(fences: Fences) -> list[tuple[Geometry, str, str]]:
    """Returns area, kind and name of each fence; inclusion fences of which one suffices are one area."""
    alone = fences.every if fences.inside_all else [each for each in fences.every if not each.inclusion]
    areas = [(fence.area, fence.kind, fence.name) for fence in alone]
    if not fences.inside_all and fences.allowed is not None:
        names = ", ".join(fence.name for fence in fences.inclusions)
        name = names if len(fences.inclusions) == 1 else f"all of {names}"
        areas.append((fences.allowed, "inclusion", name))
    return areas


def _heights(track: Track) -> dict[str, float] | None:
    """Returns least and mean height of a track above ground, and where the least was; None if not known."""
    if not np.isfinite(heights_m := track.altitude_above_ground_m).any():
        return None
    row = int(np.nanargmin(heights_m))
    return {"min": float(heights_m[row]), "mean": float(np.nanmean(heights_m)), **_place(track, row)}


def _place(track: Track, row: int) -> dict[str, float]:
    return {name: float(getattr(track, name)[row]) for name in ("time_s", "east_m", "north_m")}


def _contacts(track: Track, world: World) -> list[Breach]:
    """Returns the contacts of a track with obstacles, one by one, those between two rows among them."""
    steps_m = np.append(np.hypot(np.diff(track.east_m), np.diff(track.north_m)), 0.0)
    steps_m += world.max_obstacle_speed_mps * np.append(np.diff(track.time_s), 0.0)
    fixes = np.column_stack((track.east_m, track.north_m, track.time_s))
    touched: set[int] = set()
    for row in np.flatnonzero(track.clearance_m <= steps_m).tolist():
        east, north, time_s = fixes[row].tolist()
        touched.update(world.near(east, north, float(steps_m[row]), time_s))
    found = []
    for index in sorted(touched):
        one = World([world.obstacles[index]], world.bounds_m)
        margin = one.clearance(fixes[:, :2], track.time_s)
        between = np.full(len(track), np.inf)
        near = np.flatnonzero((margin[:-1] >= 0.0) & (margin[1:] >= 0.0) & (margin[:-1] <= steps_m[:-1]))
        for row in near.tolist():
            (begin, end), (before, after) = fixes[row : row + 2].tolist(), margin[row : row + 2].tolist()
            between[row] = one.contact_between(tuple(begin), before, tuple(end), after)
        found += stretches(track, np.minimum(margin, between), CONTACT, f"obstacles[{index}]")
    return found


def inside_m(track: Track, area: Geometry) -> FloatArray:
    """Returns (n,) how far inside an area the rows of a track are; negative outside."""
    import shapely

    shapely.prepare(area)
    edge = area.boundary
    shapely.prepare(edge)
    away: FloatArray = shapely.distance(edge, shapely.points(track.east_m, track.north_m))
    return np.where(shapely.intersects_xy(area, track.east_m, track.north_m), away, -away)


def crossed(track: Track, margin_m: FloatArray, area: Geometry, *, stays_in: bool = False) -> FloatArray:
    """(n,) the margin from an area, or to the edge of one that it stays in; negative too where a step crosses it."""
    import shapely

    margin = margin_m.copy()
    steps_m = np.hypot(np.diff(track.east_m), np.diff(track.north_m))
    before, after = margin_m[:-1], margin_m[1:]
    for row in np.flatnonzero((before >= 0.0) & (after >= 0.0) & (before + after <= steps_m)).tolist():
        way = shapely.LineString(np.column_stack((track.east_m[row : row + 2], track.north_m[row : row + 2])))
        if (wrong := way.difference(area) if stays_in else way.intersection(area)).length > 0.0:
            middle = wrong.interpolate(0.5, normalized=True) if wrong.geom_type == "LineString" else wrong
            margin[row] = min(-shapely.distance(area.boundary, middle), -1e-9)
    return margin


def stretches(track: Track, margin_m: FloatArray, kind: str, name: str) -> list[Breach]:
    """Returns one breach for every run of rows with a negative margin, up to the first row after it."""
    wrong = np.concatenate(([False], margin_m < 0.0, [False]))
    edges = np.flatnonzero(wrong[1:] != wrong[:-1])
    found = []
    for first, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        row = first + int(margin_m[first:stop].argmin())
        ends_s = float(track.time_s[first]), float(track.time_s[min(stop, len(track) - 1)])
        place = {**_place(track, row), "up_m": float(track.up_m[row]), "depth_m": float(-margin_m[row])}
        found.append(Breach(kind, name, *ends_s, **place))
    return found
