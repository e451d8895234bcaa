"""Safety by construction: how far a path may be committed to.

Invariant: the path in effect ends in a full turn at the minimum radius, and path and turn lie in space seen to be free,
with the clearance kept from every edge seen: whatever the unseen part of the world holds, the aircraft can fly on for
ever. Where no such turn leads on, the path may end in the goal circle instead. (Schouwenaars et al., "Receding horizon
path planning with implicit safety guarantees", ACC 2004.) The turn is certified as a disc, for a circle can enclose the
tip of a wall, and one larger than the turn: at the edge of what is seen the hidden flank of something may begin.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from planner.geometry import curves
from planner.geometry.clearance import inside_bounds
from planner.geometry.curves import Limits, Point, Pose, Segment
from planner.geometry.terrain import Terrain
from planner.interface import BoolArray, FloatArray, MapView, Path

DISC_RADII = 1.04
"""Least radius of the certified disc, in radii of the turn in it: the rest is for tracking error and rolling in."""

DISC_BEYOND_SHARE = 0.5
"""The certified disc reaches beyond its turn by at least this share of the clearance. With all of the clearance the
aircraft flies round forests: trees hide each other until it is among them."""

PROGRESS_SHARE = 0.25
"""A certified part makes progress if it gains this share of the turn's radius along the way, and its turn lies as far
from the one before."""

MOST_ARC_LENGTHS = 32  # a safe turn is sought at no more arc lengths of a path than this

ARC_LENGTHS_AT_ONCE = 4  # turns at this many arc lengths are tested together: mostly one of the first is free

AHEAD_STEP_RADII, ASIDE_RADII = 0.25, (0.0, 0.5)
"""Turns about places ahead are tried in steps of `AHEAD_STEP_RADII` turn radii along a path; their centres lie beside
the path by one of `ASIDE_RADII`."""

STRAIGHT_ON_RADII = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0)
"""A path may be left on a straight of one of these numbers of turn radii: where it bends behind an obstacle, only the
space straight ahead is in sight."""

SPARSE_STEP = 16
"""One in this many places of a disc is tested before the others: most discs that are not free fail there."""

SIDES = (1.0, -1.0)  # signs of the curvature of a turn: left, right


class CertificateBroken(RuntimeError):
    """Something was seen at `time_s` where the plan in effect was certified to be free, and there is no way out."""

    def __init__(self, time_s: float) -> None:
        super().__init__(
            f"something was seen at {time_s:.1f} s where the plan in effect was certified to be free, "
            "and there is no room to turn away"
        )


@dataclass(frozen=True)
class Certified:
    """The part of a path that may be flown: up to a turn, begun at `loiter_entry_m`, and that; or all, to the goal."""

    path: Path
    loiter_entry_m: float


class _Exit(NamedTuple):
    """How a path is left for a full turn: by an arc to the other side, about a place ahead, or straight on."""

    side: float  # of the full turn, 1: left
    angle_rad: float  # of the arc, 0: straight on
    ahead_m: float  # centre of the turn, ahead of the place where the path is left
    aside_m: float  # and to its left

    @classmethod
    def about_place_ahead(cls, side: float, share: float, limits: Limits) -> _Exit:
        """The exit whose turn centre lies aside by a share of the radius: 2 R cos(a) - roll sin(a) = (1 + share) R."""
        radius, roll = limits.radius_m, 2.0 * limits.roll_m
        most = math.acos((1.0 + share) * radius / math.hypot(2.0 * radius, roll))
        angle = most - math.atan2(roll, 2.0 * radius)
        ahead_m = 2.0 * radius * math.sin(angle) + roll * math.cos(angle)
        return cls(side, angle, ahead_m, side * share * radius)

    def lead(self, pose: Pose, limits: Limits) -> list[Segment]:
        """The arc and the straight to roll after it, or the straight."""
        if not self.angle_rad:
            return [(*pose, 0.0, self.ahead_m)]
        arc: Segment = (*pose, -self.side / limits.radius_m, self.angle_rad * limits.radius_m)
        return [arc, (*curves.along(arc, arc[5]), 0.0, 2.0 * limits.roll_m)] if limits.roll_m else [arc]


class Certifier:
    """Looks for the last safe turn off a path up to `horizon_m`; space is asked to be free every `spacing_m`."""

    def __init__(self, limits: Limits, clearance_m: float, horizon_m: float, spacing_m: float) -> None:
        self._limits, self._horizon, self._spacing = limits, horizon_m, spacing_m
        self._beside = DISC_BEYOND_SHARE * clearance_m
        radius_m = limits.radius_m
        self._exits = [_Exit.about_place_ahead(side, at, limits) for at in ASIDE_RADII for side in SIDES]
        on = product(STRAIGHT_ON_RADII, SIDES)
        self._exits += [_Exit(side, 0.0, n * radius_m, side * radius_m) for n, side in on]
        self._disc = _disc(max(DISC_RADII * radius_m, radius_m + self._beside), spacing_m)

    def seen_free_to_m(self, path: Path, seen: MapView) -> float:
        """Arc length, at most the horizon, up to which a path lies in space that was seen to be free."""
        end = min(path.length_m, self._horizon)
        pieces = max(math.ceil(end / self._spacing), 1)
        free = seen.seen_free(curves.places_along(path, end, pieces))
        hidden = int(free.argmin())  # the first
        return end if free[hidden] else min(hidden * (end / pieces), math.nextafter(end, 0.0))

    def certify(self, path: Path, seen: MapView, terrain: Terrain, to_m: float = math.inf) -> Certified | None:
        """The longest part of a path that ends in a turn seen to be free, begun before `to_m` along it; else None.

        Up to there the path keeps its distance from all edges seen; `terrain` has the distance that the turn keeps.
        """
        free_to = min(self.seen_free_to_m(path, seen), to_m)
        step = max(0.5 * self._limits.radius_m, free_to / MOST_ARC_LENGTHS)
        arc_lengths_m: FloatArray = free_to - step * np.arange(int(free_to / step) + 1, dtype=np.float64)
        for i in range(0, len(arc_lengths_m), ARC_LENGTHS_AT_ONCE):
            some = arc_lengths_m[i : i + ARC_LENGTHS_AT_ONCE]
            for k, which in np.argwhere(self._discs_free(path, some, seen)).tolist():
                arc_length_m = float(some[k])
                turn = curves.turn_off(*curves.place_on(path, arc_length_m), SIDES[which], self._limits)
                if terrain.admits(Path(np.array(turn))):
                    way = curves.between(path, 0.0, arc_length_m)
                    return Certified(Path(np.array([*way, *turn]), loiter=True), arc_length_m)
        return None

    def certify_ahead(self, path: Path, seen: MapView, terrain: Terrain, to_m: float) -> Certified | None:
        """Certifies as `certify` does, but with turns about places ahead or straight on: in or beyond a narrow gap."""
        radius_m = self._limits.radius_m
        free_to = min(self.seen_free_to_m(path, seen), to_m)
        step = AHEAD_STEP_RADII * radius_m
        arc_lengths_m: FloatArray = free_to - step * np.arange(int(free_to / step) + 1, dtype=np.float64)
        poses = curves.poses_at(path, arc_lengths_m)
        ahead = poses[:, None, 2:]
        aside = np.stack((-ahead[..., 1], ahead[..., 0]), axis=-1)
        offsets = np.array([(each.ahead_m, each.aside_m) for each in self._exits])[:, :, None]
        centres = poses[:, None, :2] + offsets[:, 0] * ahead + offsets[:, 1] * aside
        places = centres[:, :, None] + self._disc[::SPARSE_STEP]
        free = seen.seen_free(places.reshape(-1, 2)).reshape(*centres.shape[:2], -1).all(axis=2)
        for i, which in np.argwhere(free).tolist():
            arc_length_m, leaving = float(arc_lengths_m[i]), self._exits[which]
            pose, curvature = curves.place_on(path, arc_length_m)
            if leaving.angle_rad and leaving.side * curvature > 0.0:
                continue  # that would take a straight to roll
            lead = Path(np.array(leaving.lead(pose, self._limits)))
            turn = curves.full_turn(curves.end_of(lead), radius_m, leaving.side)
            whole = Path(np.array([*lead.segments.tolist(), turn]), loiter=True)
            if (
                seen.seen_free(centres[i, which] + self._disc).all()
                and self.seen_free_to_m(lead, seen) >= lead.length_m
                and terrain.admits(whole)
            ):
                way = curves.between(path, 0.0, arc_length_m)
                return Certified(Path(np.array([*way, *whole.segments.tolist()]), loiter=True), arc_length_m)
        return None

    def certify_up_to(
        self, end_m: float, path: Path, seen: MapView, bounds_m: tuple[float, float, float, float]
    ) -> Certified | None:
        """All of a path, certified if up to `end_m`, the goal, it is inside and seen free, also beside; else None."""
        flown = curves.between(path, 0.0, end_m)
        if not flown or end_m > self._horizon or not inside_bounds(Path(np.array(flown)), bounds_m):
            return None
        arc_lengths_m: FloatArray = np.linspace(0.0, end_m, max(math.ceil(end_m / self._spacing), 1) + 1)
        poses = curves.poses_at(path, arc_lengths_m)
        aside = self._beside * np.column_stack((-poses[:, 3], poses[:, 2]))
        places = np.concatenate([poses[:, :2] + side * aside for side in (0.0, *SIDES)])
        if not seen.seen_free(np.clip(places, bounds_m[:2], bounds_m[2:])).all():
            return None
        return Certified(path, end_m)

    def _discs_free(self, path: Path, arc_lengths_m: FloatArray, seen: MapView) -> BoolArray:
        """(k, 2) whether the disc of a turn to each side, at each of (k,) arc lengths, has been seen to be free."""
        centres = curves.turn_centres(path, arc_lengths_m, self._limits.radius_m, self._limits.roll_m)
        places = (centres.reshape(-1, 1, 2) + self._disc).reshape(-1, 2)
        return np.asarray(np.all(seen.seen_free(places).reshape(len(arc_lengths_m), len(SIDES), -1), axis=2))


def hold_centre(turn: Sequence[float]) -> Point:
    """Centre of a full turn, a row of `Path.segments`."""
    return turn[0] - turn[3] / turn[4], turn[1] + turn[2] / turn[4]


@lru_cache(maxsize=8)
def _disc(radius_m: float, spacing_m: float) -> FloatArray:
    """(k, 2) places of a disc about the origin, no further apart than the spacing."""
    axis = np.linspace(-radius_m, radius_m, 2 * max(math.ceil(radius_m / spacing_m), 2) + 1)
    x, y = (each.ravel() for each in np.meshgrid(axis, axis))
    inside = x * x + y * y <= radius_m * radius_m
    disc = np.column_stack((x[inside], y[inside]))
    disc.setflags(write=False)
    return disc
