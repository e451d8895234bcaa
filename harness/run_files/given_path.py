"""Turns a path as somebody gives it into lines and arcs that guidance can follow, with an arc at every corner.

Where points sample a curve, arcs are as wide as these leave room for, and give it back; else of the turn radius.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aircraft.interface import FloatArray
from aircraft.route import SHORTEST_M, SegmentRow, corner_arcs
from harness.flight.polylines import ROUNDED_M, SAME_LINE_M, needed
from harness.flight.polylines import SAME_PLACE_M as SAME_PLACE_M
from planner.interface import ComplexArray, IntArray

GIVEN: Final = "path as given"  # name that stands in place of the planner's for a flight without a planner
PAST_RAD: Final = np.radians(140.0)
"""A sharper corner is flown past and back; one that this keeps within its limit, and an arc inside does not, too."""
LATE_RAD: Final = np.radians(45.0)  # wind in so much of the end of a turn past a corner leads no further off
LEAST_CUT: Final = 1e-12  # least distance from a corner to its arc, in radii, so that nothing is over zero
LIMIT_SHARE: Final = 0.9  # a corner is cut by at most this share of its limit, if the aircraft turns so
CAREFUL_SHARE, CAREFUL_RADII = 0.6, 1.25
"""Only this share of a corner's limit is used if the arc has so many radii of the steepest turn kept, against gusts."""
SAME_TURN_RAD: Final = 0.01  # legs whose directions differ by less have no apex
ARC_POINTS: Final = 17  # number of points of an arc that are compared with the path
WIND_SAMPLES: Final = 9  # the ground speed is computed in this many directions of a turn
_Legs = tuple[FloatArray, ComplexArray, FloatArray]  # lengths (m), directions, turns or half turns' tangents


@dataclass(frozen=True)
class Tightest:
    """The limits of how tightly corners are rounded, one value each or (m,) point by point.

    Least radius in calm air; how far off a corner may be passed; wind over airspeed, east + i north where it blows to.
    """

    radius_m: float | FloatArray
    limit_m: float | FloatArray
    wind: complex | ComplexArray = 0j
    kept: float | FloatArray = 1.0  # radius of the steepest turn that keeps speed and altitude, in least ones

    def of(self, indices: IntArray, count: int) -> Tightest:
        """Returns the limits at the kept points, without the ends."""
        return Tightest(*(np.broadcast_to(each, count)[indices][1:-1] for each in vars(self).values()))


@dataclass(frozen=True)
class CutCorner:
    """A corner that the turn radius does not let an aircraft fly through, by its number in the path as given, from 0.

    The turn asked for is positive to the left. The arc that is flown instead has the radius, 0 where a loiter's circle
    is joined without one, and passes the corner at `cut_m`. The place that belongs to the corner is `arc_length_m`
    along the flown path, which is off the two legs for at most `half_m` before and after. Where the path is judged, the
    corner may be passed at `allowed_cut_m`. The course is that before the corner.
    """

    waypoint: int
    east_m: float
    north_m: float
    turn_deg: float
    radius_m: float
    cut_m: float
    arc_length_m: float
    half_m: float
    allowed_cut_m: float = 0.0
    course_deg: float = 0.0


@dataclass(frozen=True, eq=False)
class FlyBy:
    """A polyline with an arc at every corner.

    Waypoints are the (k, 2) given points that are needed, at the `indices`; stations are the arc length that
    belongs to each, of `segments`, (n, 6) as in `planner.interface.Path`. Corners are those that an arc as wide as
    wanted cuts by more than was left free, and kinks that are joined. `given_m` is (m, 3) the polyline with the points
    where arcs touch it: east, north, and the arc length that belongs there; an arc is shared out over what it cuts off.
    """

    waypoints_m: FloatArray
    segments: FloatArray
    corners: tuple[CutCorner, ...]
    indices: IntArray
    stations_m: FloatArray
    given_m: FloatArray

    def stations_of(self, points_m: FloatArray) -> FloatArray:
        """(m,) arc lengths of `segments` that belong to all points given."""
        along = np.append(0.0, np.cumsum(np.hypot(*np.diff(points_m, axis=0).T)))
        return np.asarray(np.interp(along, along[self.indices], self.stations_m))


def fly_by(
    points_m: FloatArray,
    radius_m: float | FloatArray,
    free_cut_m: float | FloatArray,
    tightest: Tightest | None = None,
    every: bool = False,
) -> FlyBy:
    """Rounds the corners of a polyline of (m, 2) points, not all in one place.

    The arc at a corner of angle `a` that touches the legs `t` before and after it has the radius
    `t / tan(a / 2)` and passes the corner at `radius (1 / cos(a / 2) - 1)`. It is as wide as it can be without
    passing further off than `free_cut_m`, but not tighter than `radius_m`, > 0, where there is room for that; both are
    (m,) if they differ from point to point. Corners that would be cut by more than `LIMIT_SHARE` of what they may be
    passed at are flown more tightly, down to `tightest`. Neighbouring corners share the leg between them in proportion
    to what they need. A corner sharper than `PAST_RAD`, or that only this keeps within its limit, is flown past the
    next leg and back, from one radius before it on. With `every`, corners are listed however little they are cut.
    """
    indices = needed(points_m, SAME_LINE_M if every else ROUNDED_M)
    points = points_m[indices]
    given = points[:, 0] + 1j * points[:, 1]
    place, own = given, np.arange(len(points))
    if tightest is not None and not every:
        place, own = _join_kinks(given, tightest.of(indices, len(points_m)), 2.0 * float(np.min(free_cut_m)))
    sharpest, first, count = np.unique(own, return_index=True, return_counts=True)
    place, last, of = place[sharpest], first + count - 1, indices[sharpest]
    least, free = (np.broadcast_to(each, len(points_m))[of][1:-1] for each in (radius_m, free_cut_m))
    length, ahead, turn = _legs(place)
    limits = None if tightest is None else tightest.of(of, len(points_m))
    shape = _shapes(turn, ahead, limits)
    wanted = np.where(shape.past, least, np.maximum(least, free / np.maximum(shape.cut, LEAST_CUT)))
    if limits is not None:
        wanted = _tighten(wanted, shape, ahead, turn, limits)
    radius = np.minimum(_fitting(length, least, shape), wanted)

    before, after = radius * shape.before, radius * shape.after
    starts = place[:-1] + np.append(0.0, after) * ahead
    rows: list[SegmentRow] = []
    begun, station = np.zeros(len(turn)), 0.0
    for leg, long in enumerate((length - np.append(before, 0.0) - np.append(0.0, after)).tolist()):
        if long > SHORTEST_M:
            rows.append((starts[leg].real, starts[leg].imag, ahead[leg].real, ahead[leg].imag, 0.0, long))
            station += long
        if leg < len(turn):
            begun[leg] = station
            touch = place[leg + 1] - before[leg] * ahead[leg]
            arcs = corner_arcs(touch, ahead[leg], turn[leg], radius[leg], float(shape.back_turn[leg]))
            station += sum(row[5] for row in arcs)
            rows += arcs
    # Where along the rounded path each turn begins, passes its corner, ends.
    middles, ended = begun + radius * shape.corner, begun + radius * (np.abs(turn) + 2.0 * shape.back_turn)
    # The given line is judged, not the legs to an apex: where along it each turn begins, passes its corner, ends.
    along = np.append(0.0, np.cumsum(np.abs(np.diff(given))))
    early = before - ((place - given[first])[1:-1] / ahead[:-1]).real
    late = after + ((place - given[last])[1:-1] / ahead[1:]).real
    begins, ends = along[first][1:-1] - np.maximum(early, 0.0), along[last][1:-1] + np.maximum(late, 0.0)
    joint = (first < last)[1:-1]
    leaves, returns = begun + np.minimum(early, 0.0), ended - np.minimum(late, 0.0)
    # The middle of kinks that are joined is shared out, since their apex may lie far from all of them.
    share = (middles - leaves) / np.maximum(returns - leaves, SHORTEST_M)
    centre = np.where(joint, begins + share * (ends - begins), along[first][1:-1])
    inner = np.transpose(((begins, centre, ends), (leaves, middles, returns)), (0, 2, 1)).reshape(2, -1)
    both = np.column_stack(((0.0, 0.0), inner, (along[-1], station)))
    knots, stations = np.maximum.accumulate(both, axis=1)  # an arc may reach beyond a short given leg
    # Kinks that are joined are listed as the sharpest of them.
    sharp = sharpest[1:-1]
    passed = np.where(joint, np.interp(along[sharp], knots, stations), middles)
    half = np.maximum(passed - leaves, returns - passed)
    away = np.abs(given[sharp] - place[1:-1] + (before - 1j * np.sign(turn) * radius) * ahead[:-1])
    cut = np.where(joint, np.abs(away - radius), radius * shape.cut)
    _, onto, turned = _legs(given)
    turn_deg, course = np.degrees((turned[sharp - 1], np.angle(1j / onto[sharp - 1]) % (2.0 * np.pi)))
    columns = np.column_stack((points[sharp], turn_deg, radius, cut, passed, half, 0.0 * half, course))
    corners = tuple(
        CutCorner(int(of[i + 1]), *columns[i].tolist())
        for i in np.flatnonzero(every | (wanted * shape.cut > free * (1.0 + 1e-9)) | joint).tolist()
    )
    every_m = np.union1d(along, knots)
    drawn, belongs = np.interp(every_m, along, given), np.interp(every_m, knots, stations)
    line = np.column_stack((drawn.real, drawn.imag, belongs))
    return FlyBy(points, np.array(rows), corners, indices, np.interp(along, knots, stations), line)


def _legs(place: ComplexArray) -> _Legs:
    """Returns lengths and directions of the legs between places, and the turns between legs."""
    length = np.abs(np.diff(place))
    ahead = np.diff(place) / length
    return length, ahead, np.angle(ahead[1:] / ahead[:-1])


def _join_kinks(place: ComplexArray, tightest: Tightest, near_m: float) -> tuple[ComplexArray, IntArray]:
    """Joins kinks whose legs have no room for the least turn with the neighbours that make room for it.

    An aircraft that turns at such a kink overshoots by about R (1 - cos(turn)). If the way round the apex of a run of
    kinks is off them by no more than that, they are flown as one: the sharpest of them, whose place becomes the apex.
    So are those back and forth within `near_m` of the first; those within it of an end of the line are that end.
    Returns all places, and the index of the corner as which each is flown.
    """
    length, ahead, turn = _legs(place)
    tangent = np.concatenate(([0.0], np.tan(0.5 * np.minimum(np.abs(turn), PAST_RAD)), [0.0]))
    least = least_m(ahead, turn, tightest)
    overshoot_m = (least - _fitting(length, least, _shapes(turn, ahead))) * (1.0 - np.cos(turn))
    joined, own, last = place.copy(), np.arange(len(place)), 0
    for kink in (1 + np.flatnonzero(overshoot_m > (1.0 - LIMIT_SHARE) * tightest.limit_m)).tolist():
        if kink <= last:
            continue
        end = kink - 1 + int(np.append(np.abs(place[kink:-1] - place[kink]) <= near_m, False).argmin())
        back = np.abs(turn[kink - 1 : end]).sum() - abs(np.angle(ahead[end] / ahead[kink - 1]))
        run = (kink, end, place[kink : end + 1].mean()) if back > 0.5 * np.pi else None
        run = run or _run_with_room(place, (length, ahead, tangent), kink, last, tightest, overshoot_m)
        if run is not None:
            first, last, apex = run
            sharpest = first + int(np.abs(turn[first - 1 : last]).argmax())
            joined[sharpest], own[first : last + 1] = apex, sharpest
    for way, bend, to in ((place, turn, own), (place[::-1], turn[::-1], own[::-1])):
        near = int((np.abs(way - way[0]) <= near_m).argmin())
        if np.abs(bend[: near - 1]).sum() > 0.25 * np.pi:
            to[:near] = to[0]
    return joined, own


def _run_with_room(
    place: ComplexArray, legs: _Legs, kink: int, before: int, tightest: Tightest, overshoot_m: FloatArray
) -> tuple[int, int, complex] | None:
    """Returns first, last and apex of the shortest run about a kink whose outer legs have room for the least turn.

    It comes after the point `before`. None if there is none, it is the kink alone, or the turn about the apex is off
    the points by more than the aircraft overshoots. Legs come with the tangents of half of the turns at their ends.
    """
    length, ahead, tangent = legs
    limits = Tightest(*(each[kink - 1] for each in vars(tightest).values()))
    first = last = kink
    while before < first and last < len(place) - 1:
        outer = ahead[[first - 1, last]]
        onto, gap = outer[1] / outer[0], (place[last] - place[first]) / outer[0]
        turned = np.angle(onto)
        if not SAME_TURN_RAD < abs(turned) < PAST_RAD:
            break
        beyond = gap.imag / onto.imag  # how far the apex lies before the last leg, and behind the first
        ahead_m = gap.real - beyond * onto.real
        half = float(np.tan(0.5 * abs(turned)))
        rooms = length[first - 1] + ahead_m, length[last] + beyond
        fits = rooms[0] / (half + tangent[first - 1]), rooms[1] / (half + tangent[last + 1])
        radius = float(least_m(outer, np.array([turned]), limits)[0])
        if min(fits) >= radius:
            apex = place[first] + ahead_m * outer[0]
            off_m = _off_given_m(place[first - 1 : last + 2], apex, outer, radius)
            joins = first < last and off_m <= overshoot_m[first - 1 : last].max()
            return (first, last, apex) if joins else None
        first, last = (first - 1, last) if fits[0] < fits[1] else (first, last + 1)
    return None


def _off_given_m(places: NDArray[Any], apex: complex, legs: NDArray[Any], radius_m: float) -> float:
    """Returns how far the first and last leg, with the arc that rounds their apex, are at most from given places."""
    import shapely

    turn = np.angle(legs[1] / legs[0])
    touch = apex - radius_m * np.tan(0.5 * abs(turn)) * legs[0]
    swept = np.exp(1j * turn * np.linspace(0.0, 1.0, ARC_POINTS))
    arc = touch + 1j * np.sign(turn) * radius_m * legs[0] * (1.0 - swept)
    given = np.repeat(places, 2)[:-1]
    given[1::2] = 0.5 * (places[1:] + places[:-1])
    way = np.concatenate((places[:1], arc, places[-1:]))
    lines = (shapely.LineString(np.column_stack((each.real, each.imag))) for each in (given, way))
    return float(shapely.hausdorff_distance(*lines))


class _Shapes(NamedTuple):
    """The shapes of rounded corners, each (k,), lengths in radii of the turn.

    A corner that is flown `past` has a turn by `back_turn` (rad) too far, and back. Turns begin and end so far before
    and after the corner, pass it at `cut`, are off the legs by `furthest`, and belong to it at the length `corner`.
    """

    past: NDArray[np.bool_]
    before: FloatArray
    after: FloatArray
    cut: FloatArray
    furthest: FloatArray
    corner: FloatArray
    back_turn: FloatArray


def _shapes(turn: FloatArray, ahead: ComplexArray, limits: Tightest | None = None) -> _Shapes:
    """Returns the shapes of corners by their angles, and by whether an arc inside them keeps their limits.

    A turn that begins one radius before a corner of angle `a` has its centre at (sin a - cos a, sin a + cos a), in
    radii, along the next leg and beside it. The turn back has its centre one radius on the other side of that leg,
    and two radii from the first.
    """
    angle, (inside, outside) = np.abs(turn), off_radii(turn)
    past = angle > PAST_RAD
    if limits is not None:
        begun, calm_m = np.sign(turn) * np.maximum(angle - LATE_RAD, 0.0), inside * limits.radius_m
        soon = np.maximum(least_m(ahead, begun, limits), limits.radius_m) * outside <= limits.limit_m
        kept = (least_m(ahead, turn, limits) * outside <= limits.limit_m) & (calm_m > LIMIT_SHARE * limits.limit_m)
        past |= (outside < inside) & (kept | (soon & (calm_m > limits.limit_m)))
    half = 0.5 * np.where(past, 0.0, angle)
    along, beside = np.sin(angle) - np.cos(angle), np.sin(angle) + np.cos(angle)
    share = np.clip(0.5 * (1.0 + beside), -1.0, 1.0)
    tangent = np.tan(half)
    return _Shapes(
        past=past,
        before=np.where(past, 1.0, tangent),
        after=np.where(past, along + 2.0 * np.sqrt(1.0 - share * share), tangent),
        cut=np.where(past, np.sqrt(2.0) - 1.0, inside),
        furthest=np.where(past, outside, inside),
        corner=np.where(past, 0.25 * np.pi, half),
        back_turn=np.where(past, np.arccos(share), 0.0),
    )


def off_radii(turn: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far an arc inside a corner, and a turn past it and back, are off the legs at most, in radii of the turn."""
    past = np.maximum(np.sqrt(2.0), 2.0 - np.sin(np.abs(turn)) - np.cos(turn)) - 1.0
    return 1.0 / np.cos(0.5 * turn) - 1.0, past


def _tighten(
    wanted_m: FloatArray, shape: _Shapes, ahead: NDArray[Any], turn: FloatArray, tightest: Tightest
) -> FloatArray:
    """(k,) radii that keep every corner within its limit, as far as calm air allows; of the wind the flight decides."""
    tight_m = least_m(ahead, turn, tightest)
    limit_m = tightest.limit_m / np.maximum(shape.furthest, LEAST_CUT)
    careful_m = np.maximum(CAREFUL_SHARE * limit_m, CAREFUL_RADII * tightest.kept * tight_m)
    radius_m = np.minimum(np.maximum(wanted_m, tight_m), np.minimum(careful_m, LIMIT_SHARE * limit_m))
    return np.maximum(radius_m, np.minimum(tight_m, tightest.radius_m))


def least_m(ahead: NDArray[Any], turn: FloatArray, tightest: Tightest) -> FloatArray:
    """(k,) least radii: that of calm air times the largest square of ground speed over airspeed along the turn."""
    course = ahead[:-1, None] * np.exp(1j * turn[:, None] * np.linspace(0.0, 1.0, WIND_SAMPLES))
    seen = np.conj(course) * np.asarray(tightest.wind)[..., None]
    ground_speed = seen.real + np.sqrt(np.maximum(1.0 - seen.imag**2, 0.0))
    return np.asarray(tightest.radius_m * np.square(ground_speed).max(axis=1))


def _fitting(length_m: FloatArray, radius_m: FloatArray, shape: _Shapes) -> FloatArray:
    """(k,) widest radii that (k + 1,) legs leave room for; neighbours share a leg in proportion to their needs."""
    before = np.append(radius_m * shape.before, 0.0)  # at the end of each leg
    after = np.append(0.0, radius_m * shape.after)  # at its begin
    needed_m = np.maximum(before + after, SHORTEST_M * SHORTEST_M)
    rooms = (length_m * before / needed_m)[:-1], (length_m * after / needed_m)[1:]
    fits = [
        np.divide(room, each, out=np.zeros_like(room), where=each > 0.0)
        for room, each in zip(rooms, (shape.before, shape.after), strict=True)
    ]
    return np.asarray(np.minimum(*fits))
