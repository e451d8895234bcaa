"""Which moving obstacles of a world lie outside what the planner's promise of safety assumes of them.

The planner is told nothing of this: it sees what the sensor returns. This is for people, who want to know before a
flight whether its world is one that the promise covers. The assumptions stand in `planner/README.md`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from harness.scenario.scenario import Scenario
from harness.world.obstacle import Circle, Obstacle
from harness.world.world import World

SLOWEST_MPS: Final = 0.5
"""Slowest speed of an obstacle that is found to move. A slower one is taken to stand still."""

FASTEST_MPS: Final = 30.0
"""Fastest speed of an obstacle that is followed from scan to scan."""

FASTEST_SHARE: Final = 0.8
"""Fastest speed of an obstacle as a share of the airspeed. The aircraft cannot fly aside from a faster one."""

Shape = Any
"""Shapely has no types."""


def scenario_outside_assumptions(scenario: Scenario) -> tuple[str, ...]:
    """`outside_assumptions` of a scenario; of one in which nothing moves no world is made."""
    if not any(each.velocity_mps not in (None, (0.0, 0.0)) for each in scenario.obstacles):
        return ()
    obstacles = World.from_scenario(scenario).obstacles
    airspeed_mps, range_m = scenario.aircraft.airspeed_mps, scenario.sensor.range_m
    return outside_assumptions(obstacles, airspeed_mps, range_m, scenario.mission.time_limit_s)


def outside_assumptions(
    obstacles: Sequence[Obstacle], airspeed_mps: float, range_m: float, until_s: float
) -> tuple[str, ...]:
    """One sentence for each moving obstacle that lies outside the assumptions, and for each pair that does.

    Assumed are: a speed from `SLOWEST_MPS` to `FASTEST_MPS` and to `FASTEST_SHARE` of the airspeed; a width, across the
    velocity, of no more than the sensing range, so that an end comes into sight; and no contact with another
    obstacle: what comes out of another obstacle is seen too late.

    Args:
        obstacles: those of the world, in the order of the scenario file.
        airspeed_mps: true airspeed of the aircraft.
        range_m: sensing range.
        until_s: the end of the mission's time; what happens later is left out.
    """
    moving = [number for number, each in enumerate(obstacles) if each.velocity_mps != (0.0, 0.0)]
    fastest = min(FASTEST_MPS, FASTEST_SHARE * airspeed_mps)
    found = []
    for number in moving:
        each = obstacles[number]
        speed, width = math.hypot(*each.velocity_mps), _width_m(each)
        if not SLOWEST_MPS <= speed <= fastest:
            found.append(
                f"obstacles[{number}] moves at {speed:.3g} m/s; assumed are {SLOWEST_MPS:g} to {fastest:.3g} m/s"
            )
        if width > range_m:
            found.append(
                f"obstacles[{number}] is {width:,.0f} m wide across its motion; assumed is no more than the "
                f"sensing range, {range_m:,.0f} m"
            )
    return (*found, *_contacts(obstacles, moving, until_s))


def _width_m(obstacle: Obstacle) -> float:
    """Its extent across its velocity."""
    if isinstance(obstacle.shape, Circle):
        return 2.0 * obstacle.shape.radius_m
    east, north = np.array(obstacle.velocity_mps) / math.hypot(*obstacle.velocity_mps)
    across = np.array(obstacle.shape.vertices_m) @ np.array((-north, east))
    return float(np.ptp(across))


def _contacts(obstacles: Sequence[Obstacle], moving: list[int], until_s: float) -> Iterator[str]:
    """Sentences on pairs of which one moves and that touch at some time at which both are there."""
    import shapely

    cores = np.array([_core(each) for each in obstacles], dtype=object)
    radii = np.array([each.shape.radius_m if isinstance(each.shape, Circle) else 0.0 for each in obstacles])
    times = [(max(each.interval_s[0], 0.0), min(each.interval_s[1], until_s)) for each in obstacles]
    standing = [number for number, each in enumerate(obstacles) if each.velocity_mps == (0.0, 0.0)]
    tree = shapely.STRtree(cores[standing])
    largest = radii[standing].max(initial=0.0)
    for place, one in enumerate(moving):
        here, (begin, end) = obstacles[one], times[one]
        if begin > end:
            continue
        swept = _swept(cores[one], here.displacement_m(begin), here.displacement_m(end))
        near = tree.query(swept, predicate="dwithin", distance=largest + radii[one])
        for other in (*moving[place + 1 :], *(standing[index] for index in np.sort(near))):
            first, last = max(begin, times[other][0]), min(end, times[other][1])
            if first > last:
                continue
            there = obstacles[other]
            way = [np.subtract(here.displacement_m(t), there.displacement_m(t)) for t in (first, last)]
            met = _swept(cores[one], way[0], way[1])
            if shapely.distance(met, cores[other]) <= radii[one] + radii[other]:
                yield (
                    f"obstacles[{one}] and obstacles[{other}] touch or pass through each other; assumed is that "
                    "moving obstacles do not"
                )


def _core(obstacle: Obstacle) -> Shape:
    """Its polygon, or the centre of its circle."""
    import shapely

    shape = obstacle.shape
    if isinstance(shape, Circle):
        return shapely.Point(shape.center_m)
    return shapely.Polygon(shape.vertices_m, shape.holes_m)


def _swept(core: Shape, begin_m: ArrayLike, end_m: ArrayLike) -> Shape:
    """All that a core covers on its straight way from one displacement (east, north) to another."""
    import shapely

    first, last = (shapely.transform(core, lambda xy, by=by: xy + np.array(by)) for by in (begin_m, end_m))
    if isinstance(core, shapely.Point):
        return shapely.LineString([first, last])
    sides = [
        shapely.MultiPoint([*edge, *np.add(edge, np.subtract(end_m, begin_m))]).convex_hull
        for ring in (first.exterior, *first.interiors)
        for edge in zip(np.array(ring.coords)[:-1], np.array(ring.coords)[1:], strict=True)
    ]
    return shapely.union_all([first, last, *sides])
