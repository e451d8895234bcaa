"""Lines and arcs along a stretch of a boundary that is made of arcs of discs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from planner.geometry.curves import SHORTEST_M, Point, Segment
from planner.interface import FloatArray

ANGLE_OFF_RAD = 1e-7
"""Angles nearer to each other than this are the same: intersections of circles are no better known."""


class Contact(NamedTuple):
    """The arc of one disc that lies on the boundary, in the sense of travel.

    Attributes:
        disc: index of the disc.
        begin_rad: bearing of its beginning from the centre of the disc, counted in the sense of travel.
        end_rad: that of its end, not less.
    """

    disc: int
    begin_rad: float
    end_rad: float


def path_along(
    begin: Point, contacts: Sequence[Contact], centers_m: FloatArray, radii_m: FloatArray, side: float
) -> list[Segment]:
    """Lines and arcs along a stretch of the boundary, from a place on it or beside it.

    Dents between neighbouring discs are bridged by the common tangent, so that a straight wall is followed
    on a straight line and a bend that is hollow has a corner.

    Args:
        begin: where the path begins.
        contacts: the stretch, from the place nearest to `begin` on.
        centers_m: (k, 2) centre of the disc of each.
        radii_m: (k,) their radii.
        side: 1 to go round counter-clockwise, -1 clockwise.
    """
    centers, radii = centers_m * (1.0, side), radii_m
    bearings = _tangents(contacts, centers, radii)
    x, y = begin[0], side * begin[1]
    places: list[tuple[float, float, float, float]] = [(x, y, 0.0, 0.0)]  # x, y, curvature and turn up to it
    first = _first_touch(x, y, contacts, centers, radii, bearings)
    for k in range(first[0], len(contacts)):
        enter, leave = (first[1] if k == first[0] else bearings[k][0]), bearings[k][1]
        cx, cy, radius = float(centers[k, 0]), float(centers[k, 1]), float(radii[k])
        if enter <= leave:
            places.append((cx + radius * math.cos(enter), cy + radius * math.sin(enter), 0.0, 0.0))
            end = cx + radius * math.cos(leave), cy + radius * math.sin(leave)
            places.append((*end, 1.0 / radius, leave - enter))
        else:  # hollow: the two tangents meet before they touch
            middle, reach = 0.5 * (enter + leave), radius / math.cos(0.5 * (enter - leave))
            places.append((cx + reach * math.cos(middle), cy + reach * math.sin(middle), 0.0, 0.0))
    return _joined(places, side)


def _tangents(
    contacts: Sequence[Contact], centers: FloatArray, radii: FloatArray
) -> list[tuple[float, float]]:
    """The bearings at which each disc is reached and left: of the common tangents, else of the crossings."""
    count = len(contacts)
    step = np.diff(centers, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    across = np.arctan2(step[:, 1], step[:, 0]) - 0.5 * math.pi
    bridged = (length > SHORTEST_M) & (np.diff(radii) == 0.0)
    begin = np.array([contact.begin_rad for contact in contacts])
    end = np.array([contact.end_rad for contact in contacts])
    leave, reach = np.append(across, 0.0), np.append(0.0, across)
    # Bearings of one disc are counted from the middle of its arc.
    middle = 0.5 * (begin + end)
    leave, reach = (middle + (angle - middle + math.pi) % math.tau - math.pi for angle in (leave, reach))
    while True:
        out, into = np.append(bridged, False), np.append(False, bridged)
        enter, left = np.where(into, reach, begin), np.where(out, leave, end)
        hollow = np.maximum(enter - left, 0.0)
        trim = radii * np.tan(np.minimum(0.5 * hollow, 1.5))
        # A corner between two tangents takes at most half of each; one between a tangent and an arc is none.
        room = np.minimum(np.append(length, math.inf), np.append(math.inf, length))
        bad = (hollow > ANGLE_OFF_RAD) & (~(out & into) | (trim > 0.5 * room))
        if not bad.any():
            break
        worst = np.flatnonzero(bad)
        bridged[worst[worst < count - 1]] = False
        bridged[worst[worst > 0] - 1] = False
    return list(zip(enter.tolist(), left.tolist(), strict=True))


def _first_touch(
    x: float,
    y: float,
    contacts: Sequence[Contact],
    centers: FloatArray,
    radii: FloatArray,
    bearings: list[tuple[float, float]],
) -> tuple[int, float]:
    """The first disc that a straight line from a place beside the boundary reaches, and at which bearing."""
    for k in range(min(3, len(contacts))):
        dx, dy = x - float(centers[k, 0]), y - float(centers[k, 1])
        distance, radius = math.hypot(dx, dy), float(radii[k])
        if distance < radius:
            continue
        touch = math.atan2(dy, dx) + math.acos(radius / distance)
        low, high = contacts[k].begin_rad, bearings[k][1]
        touch = low + (touch - low + ANGLE_OFF_RAD) % math.tau - ANGLE_OFF_RAD
        if touch <= high:
            return k, touch
    return 0, contacts[0].begin_rad


def _joined(places: list[tuple[float, float, float, float]], side: float) -> list[Segment]:
    """Segments from place to place, each given with the curvature and the turn of the way to it."""
    out: list[Segment] = []
    for (x, y, _, _), (to_x, to_y, curvature, turn) in pairwise(places):
        chord = math.hypot(to_x - x, to_y - y)
        length = turn / curvature if curvature else chord
        if length <= SHORTEST_M:
            continue
        if curvature:
            # The tangent at the beginning is the chord turned back by half the turn.
            direction = math.atan2(to_y - y, to_x - x) - 0.5 * turn
            ux, uy = math.cos(direction), math.sin(direction)
        else:
            ux, uy = (to_x - x) / chord, (to_y - y) / chord
        out.append((x, side * y, ux, side * uy, side * curvature, length))
    return out
