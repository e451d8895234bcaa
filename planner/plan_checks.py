"""What a planner's answer must be before anything is flown by it.

An answer comes from code of others. It is read once, attribute by attribute; what is flown, judged and recorded is a
copy of what was read. A path is refused, with the number of the segment and the figure, if it does not begin at the
aircraft, does not join, or is larger than any path that is meant to be flown. A kink is allowed: the path of a point
that turns on the spot has them, and the trackability verdict counts each as a corner.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from planner.interface import NOT_UNIT, FloatArray, Mission, Path, Plan, PlanPicture, PlanStatus

MOST_REASON_LETTERS = 2000
"""A reason is one sentence, no longer than this."""
MOST_SEGMENTS = 100_000
"""A path has no more segments, and a plan no more waypoints. A sampled curve of 100 km at 1 m has as many."""
LONGEST_M, MOST_TURNING_RAD = 1e7, 1e5
"""A path is no longer: five times across the largest area; and turns no more: 16,000 full turns."""
FURTHEST_M = 1e8
"""No waypoint lies further east, west, north or south of the origin."""
START_S = 1.0
"""A path may begin so much flying time ahead of the aircraft or behind it; see `start_tolerance_m`."""
JOIN_M = 0.1
"""A segment begins no further than this from where the one before ends; a loiter ends so near to its beginning."""
FULL_TURN_RAD = 1e-3
"""A loiter turns by a full turn, give or take this."""


class WrongAnswerError(ValueError):
    """An answer that is no plan, or a plan that cannot be flown; the message is a sentence that says why."""


def start_tolerance_m(mission: Mission) -> float:
    """How far from the aircraft a path may begin: on the path in effect, also where that is after the latency."""
    return mission.off_path_m + mission.ground_speed_mps * (mission.compute_latency_s + START_S)


def checked_plan(answer: object, position_m: tuple[float, float], mission: Mission) -> Plan:
    """A planner's answer: itself where it is no new path; else a copy that nobody can change, with its picture made.

    Raises:
        WrongAnswerError: it is no plan, or its path cannot be flown.
        BaseException: whatever an attribute of the answer, or the making of its picture, raises.
    """
    if not issubclass(type(answer), Plan):
        raise WrongAnswerError(f"the planner answered with {_type(answer)}; an answer must be a Plan")
    assert isinstance(answer, Plan)
    status, reason, wants_more_time = answer.status, answer.reason, answer.wants_more_time
    for told, value, fits, must in (
        ("its status", status, type(status) is PlanStatus, "a PlanStatus"),
        ("its reason", reason, issubclass(type(reason), str), "a str"),
        ("wants_more_time", wants_more_time, isinstance(wants_more_time, bool | np.bool_), "True or False"),
    ):
        if not fits:
            raise WrongAnswerError(f"the planner's plan has {_type(value)} as {told}; it must be {must}")
    letters = str.__len__(reason)
    if letters > MOST_REASON_LETTERS:
        told = f"the planner's plan has a reason of {letters:,} characters"
        raise WrongAnswerError(f"{told}; it must have at most {MOST_REASON_LETTERS:,}")
    if status is not PlanStatus.FOUND:
        if type(answer) is Plan:
            return answer
        return Plan(status, str.__str__(reason), wants_more_time=bool(wants_more_time))
    waypoints_m = _waypoints(answer.waypoints_m)
    path = _path(answer.path, position_m, start_tolerance_m(mission))
    picture, more = _picture(answer.picture), bool(wants_more_time)
    return Plan(status, str.__str__(reason), waypoints_m, path, picture, wants_more_time=more)


def _type(value: object) -> str:
    """What a value is, told without asking the value."""
    return "None" if value is None else f"an object of type {type(value).__name__[:100]}"


def _shape(value: Any) -> str:
    return str(value.shape) if isinstance(value, np.ndarray) else _type(value)


def _is_table(value: Any, columns: int) -> bool:
    return issubclass(type(value), np.ndarray) and value.ndim == 2 and value.shape[1] == columns


def _refused(what: str) -> WrongAnswerError:
    return WrongAnswerError(f"the planner gave a path that cannot be flown: {what}")


def _waypoints(waypoints_m: Any) -> FloatArray:
    """The waypoints, if they are (n, 2) finite numbers."""
    told = "the planner gave"
    if not _is_table(waypoints_m, 2):
        shape = "shape " * isinstance(waypoints_m, np.ndarray) + _shape(waypoints_m)
        raise WrongAnswerError(f"{told} waypoints with {shape}; they must be an array of shape (n, 2)")
    count = len(waypoints_m)
    if count > MOST_SEGMENTS:
        raise WrongAnswerError(f"{told} {count:,} waypoints; a plan must have at most {MOST_SEGMENTS:,}")
    for i in np.flatnonzero(~(np.abs(waypoints_m) <= FURTHEST_M).all(axis=1)).tolist():
        east, north = waypoints_m[i].tolist()
        must = f"its coordinates must be finite and within {FURTHEST_M:g} m of the origin"
        raise WrongAnswerError(f"{told} a waypoint {i} at ({east:g}, {north:g}) m; {must}")
    return np.asarray(waypoints_m, dtype=np.float64)


def _path(path: Any, position_m: tuple[float, float], start_m: float) -> Path:
    """A copy of a path, if it can be flown and begins no further than `start_m` from the aircraft."""
    if path is None:
        raise _refused("it is none")
    if not issubclass(type(path), Path):
        raise _refused(f"it is {_type(path)}; it must be a Path")
    rows, loiter = path.segments, path.loiter
    if not _is_table(rows, 6) or not len(rows):
        raise _refused(f"its segments must have shape (n, 6), n > 0; got {_shape(rows)}")
    if not isinstance(loiter, bool | np.bool_):
        raise _refused(f"it has {_type(loiter)} as its loiter; it must be True or False")
    if len(rows) > MOST_SEGMENTS:
        raise _refused(f"it has {len(rows):,} segments; it must have at most {MOST_SEGMENTS:,}")
    rows = np.asarray(rows, dtype=np.float64)
    _check_segments(rows, position_m, start_m)
    if loiter:
        _check_loiter(rows)
    return Path(rows, bool(loiter))


def _require(fits: Any, told: str, *values: FloatArray) -> None:
    """Refuses the path where something does not fit: told of the first segment `i` for which it does not."""
    bad = np.flatnonzero(~fits)
    if len(bad):
        i = int(bad[0])
        raise _refused(told.format(*(value[i] for value in values), i=i, following=i + 1))


def _check_segments(rows: FloatArray, position_m: tuple[float, float], start_m: float) -> None:
    """Each segment can be flown, all are not too much, and they are joined from the aircraft on."""
    tangent, length = np.hypot(rows[:, 2], rows[:, 3]), rows[:, 5]
    each = "segment {i} is not finite: {:g}, {:g}, {:g}, {:g}, {:g}, {:g}"
    _require(np.isfinite(rows).all(axis=1), each, *rows.T)
    _require(length > 0.0, "segment {i} is {:g} m long; it must be longer than 0 m", length)
    each = "segment {i} begins with a tangent of length {:.9g}; it must be a unit vector"
    _require(np.abs(tangent - 1.0) < NOT_UNIT, each, tangent)
    with np.errstate(over="ignore"):
        way, turning = np.cumsum(length), np.cumsum(np.abs(rows[:, 4] * length))
    most = f"m long up to the end of segment {{i}}; it must be at most {LONGEST_M:g} m long"
    _require(way <= LONGEST_M, "it is {:.6g} " + most, way)
    most = f"rad up to the end of segment {{i}}; it must turn by at most {MOST_TURNING_RAD:g} rad"
    _require(turning <= MOST_TURNING_RAD, "it turns by {:.6g} " + most, turning)
    off_m = np.hypot(*(rows[:1, :2] - position_m).T)
    most = f"m from the aircraft; it must begin at most {start_m:.3g} m from it"
    _require(off_m <= start_m, "segment {i} begins {:.6g} " + most, off_m)
    gaps = np.hypot(*(rows[1:, :2] - _ends(rows)[:-1]).T)
    most = f"m from where segment {{i}} ends; they must meet within {JOIN_M:g} m"
    _require(gaps <= JOIN_M, "segment {following} begins {:.6g} " + most, gaps)


def _check_loiter(rows: FloatArray) -> None:
    """The last segment is a full circle."""
    last = len(rows) - 1
    turn = abs(float(rows[-1, 4] * rows[-1, 5]))
    gap = math.dist(_ends(rows[-1:])[0].tolist(), rows[-1, :2].tolist())
    if not (abs(turn - math.tau) <= FULL_TURN_RAD and gap <= JOIN_M):
        told = f"turns by {math.degrees(turn):.6g} deg and ends {gap:.3g} m from where it begins"
        raise _refused(f"segment {last}, its loiter, {told}; it must be a full circle")


def _ends(rows: FloatArray) -> FloatArray:
    """(n, 2) where segments of constant curvature end: the chord of an arc that turns by `a` is sinc(a / 2) as long."""
    half = 0.5 * rows[:, 4] * rows[:, 5]
    chord = rows[:, 5] * np.sinc(half / np.pi)
    ahead, left = (chord * np.cos(half))[:, None], (chord * np.sin(half))[:, None]
    ends: FloatArray = rows[:, :2] + ahead * rows[:, 2:4] + left * np.column_stack((-rows[:, 3], rows[:, 2]))
    return ends


def _picture(make: Callable[[], PlanPicture] | None) -> Callable[[], PlanPicture] | None:
    """The picture of a plan, made now, so that a flight ends alike whether or not it is recorded."""
    if make is None:
        return None
    made = make()
    if type(made) is not PlanPicture:
        raise WrongAnswerError(
            f"the planner's picture of its plan is {_type(made)}; it must be a PlanPicture"
        )
    return lambda: made
