"""Least distance of an aircraft from still and moving edge points; compiled, see `planner.kernels`."""

from __future__ import annotations

import math

from planner.compiled import FLOAT, ROWS, compiled
from planner.interface import FloatArray
from planner.kernels.buckets import BUCKETS, Buckets


@compiled(ROWS, BUCKETS, ROWS, FLOAT, FLOAT, FLOAT, FLOAT, FLOAT, FLOAT, FLOAT)
def room_along(
    places: FloatArray,
    still: Buckets,
    moving: FloatArray,
    step: float,
    speed: float,
    least: float,
    farther: float,
    earliest: float,
    latest: float,
    unknown_s: float,
) -> float:
    """Least distance (m) from all edge points of an aircraft that flies along (n, 2) places, `step` (m) apart.

    `still` are those that stand; `moving` are (k, 5): edge points now, their velocity, and how fast they may come
    nearer beyond that, for `unknown_s`. For each metre along the way, what is met counts as `farther` m further away.
    At each place the aircraft may be from `earliest` to `latest` times the time at its speed. With less room than
    `least` the rest is not looked at.
    """
    room, i, fastest, beside, (standing, first, circles) = math.inf, 0, 0.0, 0, still
    for j in range(len(moving)):
        fastest = max(fastest, math.hypot(moving[j, 2], moving[j, 3]) + moving[j, 4])
    # From one place to the next, something comes nearer by at most this.
    closer = step * (1.0 + latest * fastest / speed)
    while i < len(places) and room >= least:
        x, y, later = places[i, 0], places[i, 1], farther * step * i
        nearest, squared, begin = math.inf, math.inf, beside
        for k in range(len(first) - 1):
            block = (begin + k) % (len(first) - 1)
            dx, dy, reach = circles[0, block] - x, circles[1, block] - y, circles[2, block] + nearest
            if dx * dx + dy * dy >= reach * reach:
                continue
            for j in range(first[block], first[block + 1]):
                dx, dy = standing[0, j] - x, standing[1, j] - y
                if dx * dx + dy * dy < squared:
                    squared, beside = dx * dx + dy * dy, block
            nearest = math.sqrt(squared)
        begins = earliest * step * i / speed
        lasts = latest * step * i / speed - begins
        for j in range(len(moving)):
            # The distance is taken to the line along which the point moves while the aircraft may be here.
            vx, vy = moving[j, 2] * lasts, moving[j, 3] * lasts
            dx, dy = moving[j, 0] + moving[j, 2] * begins - x, moving[j, 1] + moving[j, 3] * begins - y
            share = 0.0
            if vx != 0.0 or vy != 0.0:
                share = min(max(-(dx * vx + dy * vy) / (vx * vx + vy * vy), 0.0), 1.0)
            away = math.hypot(dx + share * vx, dy + share * vy)
            nearest = min(nearest, away - moving[j, 4] * min(begins + lasts, unknown_s))
        if nearest == math.inf:
            break
        here = nearest + later
        room = min(room, here)
        i += max(int((here - room) / closer), 1)
    return room
