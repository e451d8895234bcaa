"""Section 3.2, multi-step search: N steps inside the planning window, the n best kept at every step."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from planner.geometry.curves import Point
from planner.interface import FloatArray, Mission
from planner.paper import sectors
from planner.paper.config import ImprovedBugConfig
from planner.paper.model import crosses, guide_vector, most_units, step, within
from planner.paper.sectors import Sector

BACK_RAD = math.radians(135.0)
"""A direction further off the guide vector leads back: it is taken only where nothing near leaves another."""


@dataclass(frozen=True, eq=False)
class Window:
    """Section 3.3: the planning window U_1 = {x : |x - w_k| <= r_1}, and what was sensed in it."""

    center_m: Point  # w_k, where the aircraft is
    radius_m: float  # r_1; no track point lies beyond it
    points_m: FloatArray  # (m, 2) sensed edge points whose grown discs meet the window
    keep_m: float  # distance to be kept from each
    mission: Mission  # goal, area and turn radius
    config: ImprovedBugConfig  # the symbols of the paper

    @property
    def most_rad(self) -> float:
        """Section 2.1: the largest change of course from one step to the next."""
        unit_rad = self.config.unit_rad
        return unit_rad * most_units(self.config.resolved_step_m, self.mission.turn_radius_m, unit_rad)

    def holds(self, place_m: Point) -> bool:
        """Whether a track point may lie at a place: in U_1."""
        return math.dist(place_m, self.center_m) <= self.radius_m

    def free(self, a: Point, b: Point) -> bool:
        """Whether the line between two track points crosses no obstacle, nor the known boundary (section 2.2)."""
        xmin, ymin, xmax, ymax = self.mission.bounds_m
        return xmin <= b[0] <= xmax and ymin <= b[1] <= ymax and not crosses(a, b, self.points_m, self.keep_m)


@dataclass(frozen=True)
class Track:
    """Sub-segments w_s1 ... w_sn of a candidate."""

    nodes: tuple[Point, ...]  # the track points
    course_rad: float  # theta on arrival at the last
    flown_m: float  # length of the sub-segments
    left_m: float  # x, distance from the last track point to the goal
    ended: bool = False  # it leads to the goal, or to the rim of the window

    @property
    def cost_m(self) -> float:
        """Length and distance left, by which the n best are chosen."""
        return self.flown_m + self.left_m


def multi_step_search(window: Window, start_m: Point, course_rad: float) -> list[Track]:
    """Section 3.2: the process of one step, N times; n candidates of N sub-segments, best first.

    They begin at `start_m` on a course. Where no candidate gets on for N steps, the depth is halved until one does; the
    paper is silent on that.
    """
    left_m, _ = guide_vector(start_m, window.mission.goal_m)
    best = [[Track((start_m,), course_rad, 0.0, left_m)]]
    for _ in range(window.config.steps):
        longer = [new for track in best[-1] for new in next_steps(window, track)]
        best.append(sorted(longer, key=lambda track: track.cost_m)[: window.config.candidates])
    depth = window.config.steps
    while depth and not best[depth]:
        depth //= 2
    return best[depth] if depth else []


def next_steps(window: Window, track: Track) -> Iterator[Track]:
    """Section 3.2, Figure 1: (b) the step along the guide vector, or (a) a step in each of the selected sectors.

    A step to the goal is at most S_0 long. Where a step leads out of the window, the track itself is kept, as ended.
    """
    if track.ended:
        yield track
        return
    here, goal, step_m = track.nodes[-1], window.mission.goal_m, window.config.resolved_step_m
    guide_m, guide_rad = guide_vector(here, goal)
    reaches = guide_m <= step_m and abs(sectors.signed(guide_rad - track.course_rad)) <= window.most_rad
    if reaches and window.holds(goal) and window.free(here, goal):
        yield Track((*track.nodes, goal), guide_rad, track.flown_m + guide_m, 0.0, ended=True)
        return
    at_rim = False
    for units in directions(window, track, guide_m, guide_rad):
        x, y, course = step(*here, track.course_rad, units, window.config.unit_rad, step_m)
        if not window.holds((x, y)):
            at_rim = True
        elif window.free(here, (x, y)):
            left_m = sectors.distance_left_m(guide_m, step_m, course - guide_rad)
            yield Track((*track.nodes, (x, y)), course, track.flown_m + step_m, left_m)
    if at_rim and len(track.nodes) > 1:
        yield replace(track, ended=True)


def directions(window: Window, track: Track, guide_m: float, guide_rad: float) -> Iterator[int]:
    """Section 3.2, Figure 1: Delta of equation (1) for each step to be tried from the end of a track."""
    here, config, course = track.nodes[-1], window.config, track.course_rad
    unit_rad, step_m = config.unit_rad, config.resolved_step_m
    if not crosses(here, along_guide(window, here, guide_m, guide_rad), window.points_m, window.keep_m):
        whole = Sector(course - window.most_rad, course + window.most_rad)
        units = sectors.whole_units(whole, course + sectors.signed(guide_rad - course), course, unit_rad)
        assert units is not None
        x, y, _ = step(*here, course, units, unit_rad, step_m)
        if window.free(here, (x, y)):
            yield units
            return
    for part in sectors.select(sectors_at(window, track, guide_rad), guide_rad, config.sectors):
        direction = sectors.refine(part, guide_m, guide_rad, step_m, math.radians(config.refinement_deg))
        units_in = sectors.whole_units(part, direction, course, unit_rad)
        assert units_in is not None
        yield units_in


def sectors_at(window: Window, track: Track, guide_rad: float) -> list[Sector]:
    """Section 3.2, (1): the parts of free sectors at the end of a track that a step can turn to by a whole Delta.

    Where every direction meets something in the window or leads back, more than `BACK_RAD` off the guide vector, only
    obstacles count that a step, or a turn at R after it, can meet; the paper is silent on that.
    """
    here, course, config = track.nodes[-1], track.course_rad, window.config
    near_m = config.resolved_step_m + window.mission.turn_radius_m + window.keep_m
    parts: list[Sector] = []
    for reach_m in (math.inf, near_m):
        free = sectors.fan_shaped_sectors(within(window.points_m, here, reach_m), window.keep_m, here)
        parts = [part for sector in free for part in sectors.clip(sector, course, window.most_rad)]
        parts = [each for each in parts if sectors.whole_units(each, course, course, config.unit_rad) is not None]
        if any(sectors.off_guide(part, guide_rad) <= BACK_RAD for part in parts):
            break
    return parts


def along_guide(window: Window, here: Point, guide_m: float, guide_rad: float) -> Point:
    """Figure 1: how far the guide vector is looked along, to the goal or to the rim of the window.

    The rim is the far intersection of the ray p + t u with the circle |x - w_k| = r_1.
    """
    ux, uy = math.cos(guide_rad), math.sin(guide_rad)
    px, py = here[0] - window.center_m[0], here[1] - window.center_m[1]
    ahead = px * ux + py * uy
    reach = min(guide_m, -ahead + math.sqrt(max(ahead * ahead + window.radius_m**2 - px * px - py * py, 0.0)))
    return here[0] + reach * ux, here[1] + reach * uy
