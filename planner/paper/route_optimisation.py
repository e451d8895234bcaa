"""Section 3.2, route optimisation: track points between which the connection is free are cancelled."""

from __future__ import annotations

import math
from collections.abc import Iterable

from planner.geometry.clearance import first_breach, inside_bounds
from planner.geometry.course import Route
from planner.geometry.curves import Limits, Point, Pose, fillet
from planner.paper.model import guide_vector, track_cost_m
from planner.paper.multi_step_search import Track, Window
from planner.paper.sectors import signed


def cancel_nodes(nodes: tuple[Point, ...], before_m: Point, window: Window) -> tuple[Point, ...]:
    """Section 3.2, route optimisation: from w_si to the furthest w_sk with a free connection, until w_si is w_sn.

    The track points between the two are cancelled. A connection counts where the turn onto it keeps the minimum turn
    radius; w_s1 is come to from `before_m`.
    """
    needed, i = [nodes[0]], 0
    while i < len(nodes) - 1:
        k = len(nodes) - 1
        while k > i + 1 and not (
            window.free(nodes[i], nodes[k])
            and turn_fits(before_m, nodes[i], nodes[k], window.mission.turn_radius_m, first=i == 0)
        ):
            k -= 1
        before_m, i = nodes[i], k
        needed.append(nodes[k])
    return tuple(needed)


def turn_fits(before_m: Point, corner_m: Point, after_m: Point, radius_m: float, *, first: bool) -> bool:
    """Section 3.2, the minimum turning radius: whether the corner between two legs can be rounded at a radius R.

    The arc takes R tan(phi / 2) of each leg. A leg between two corners has half of its length for each, the leg before
    the first corner all of it.
    """
    length_in, course_in = guide_vector(before_m, corner_m)
    length_out, course_out = guide_vector(corner_m, after_m)
    trim = radius_m * abs(math.tan(0.5 * signed(course_out - course_in)))
    return trim <= (length_in if first else 0.5 * length_in) and trim <= 0.5 * length_out


def flyable(nodes: tuple[Point, ...], start: Pose, window: Window) -> Route | None:
    """The curve that connects the track points according to the aircraft's turn radius (section 4.1); None: none is.

    Corners are rounded; with them the curve keeps the wanted clearance.
    """
    mission = window.mission
    path = fillet(start, nodes, Limits.of(mission), window.keep_m - mission.clearance_m)
    if path is None or not inside_bounds(path, mission.bounds_m):
        return None
    keeps_clear = math.isinf(first_breach(path, window.points_m, mission.clearance_m))
    return Route(nodes, path) if keeps_clear else None


def optimise(track: Track, start: Pose, window: Window) -> Route | None:
    """Section 3.2, route optimisation of one of the n candidates.

    It stays as it was searched where its optimised curve cannot be flown. None: neither can.
    """
    if window.config.route_optimisation:
        route = flyable(cancel_nodes(track.nodes, start[:2], window), start, window)
        if route is not None:
            return route
    return flyable(track.nodes, start, window)


def shortest(routes: Iterable[Route], goal_m: Point) -> list[Route]:
    """Section 3.2, route optimisation: the candidates, the shortest first, what is left to the goal included."""
    return sorted(routes, key=lambda route: track_cost_m(route.nodes) + math.dist(route.nodes[-1], goal_m))
