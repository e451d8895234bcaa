"""Checks a planner's answer before it is flown.

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

from planner.interface import UNIT_TOLERANCE, FloatArray, Mission, Path, Plan, PlanPicture, PlanStatus

MOST_REASON_LETTERS = 2000  # a reason is one sentence; a longer one than this is refused
MOST_SEGMENTS = 100_000
"""A path of more segments, or a plan of more waypoints, is refused: as many has a curve of 100 km at every metre."""
LONGEST_M, MOST_TURNING_RAD = 1e7, 1e5
"""Greatest length of a path, five times across the largest area, and most that it may turn: 16,000 full turns."""
FURTHEST_M = 1e8  # a waypoint further than this east, west, north or south of the origin is refused
START_S = 1.0
"""A path may begin this much flying time ahead of the aircraft or behind it; see `start_tolerance_m`."""
JOIN_M = 0.1
"""A path with a wider gap than this between two segments, or between end and begin of its loiter, is refused."""
FULL_TURN_RAD = 1e-3  # a loiter may turn by this (rad) more or less than a full turn


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
        raise WrongAnswerError(f"the planner answered with {_type_text(answer)}; an answer must be a Plan")
    assert isinstance(answer, Plan)
    status, reason, wants_more_time = answer.status, answer.reason, answer.wants_more_time
    if type(status) is not PlanStatus:
        raise _attribute_error("its status", status, "a PlanStatus")
    if not issubclass(type(reason), str):
        raise _attribute_error("its reason", reason, "a str")
    if not isinstance(wants_more_time, bool | np.bool_):
        raise _attribute_error("wants_more_time", wants_more_time, "True or False")
    if (letters := str.__len__(reason)) > MOST_REASON_LETTERS:
        text = f"the planner's plan has a reason of {letters:,} characters"
        raise WrongAnswerError(f"{text}; it must have at most {MOST_REASON_LETTERS:,}")
    text, more = reason, bool(wants_more_time)
    reason = str.encode(text, "utf-8", "replace").decode()  # a lone surrogate cannot be written
    if status is not PlanStatus.FOUND:
        same = type(answer) is Plan and type(text) is str and text == reason
        return answer if same else Plan(status, reason, wants_more_time=more)
    waypoints_m = _waypoints(answer.waypoints_m)
    path = _path(answer.path, position_m, start_tolerance_m(mission))
    return Plan(status, reason, waypoints_m, path, _picture(answer.picture), wants_more_time=more)


def type_name(value: object) -> str:
    """The name of a value's type, cut to 100 letters, without calling any code of the value or of its type."""
    name: str = type.__dict__["__name__"].__get__(type(value))
    return name[:100]


def text_of(error: BaseException) -> str:
    """The text of an error that code of others raised, cut to `MOST_REASON_LETTERS`; telling it may raise again."""
    try:
        return str.__str__(str(error))[:MOST_REASON_LETTERS]
    except KeyboardInterrupt:
        raise
    except BaseException:  # it may call sys.exit, too
        return "it cannot be told what"


def _attribute_error(name: str, value: object, must: str) -> WrongAnswerError:
    return WrongAnswerError(f"the planner's plan has {_type_text(value)} as {name}; it must be {must}")


def _type_text(value: object) -> str:
    return "None" if value is None else f"an object of type {type_name(value)}"


def _shape_text(value: Any) -> str:
    return str(value.shape) if isinstance(value, np.ndarray) else _type_text(value)


def _is_table(value: Any, columns: int) -> bool:
    return issubclass(type(value), np.ndarray) and value.ndim == 2 and value.shape[1] == columns


def _path_error(what: str) -> WrongAnswerError:
    """The error for a path that cannot be flown; `what` says why."""
    return WrongAnswerError(f"the planner gave a path that cannot be flown: {what}")


def _waypoints(waypoints_m: Any) -> FloatArray:
    """Returns the waypoints as an array; WrongAnswerError unless they are (n, 2) finite numbers."""
    text = "the planner gave"
    if not _is_table(waypoints_m, 2):
        noun = "shape " if isinstance(waypoints_m, np.ndarray) else ""
        found = f"waypoints with {noun}{_shape_text(waypoints_m)}"
        raise WrongAnswerError(f"{text} {found}; they must be an array of shape (n, 2)")
    if (count := len(waypoints_m)) > MOST_SEGMENTS:
        raise WrongAnswerError(f"{text} {count:,} waypoints; a plan must have at most {MOST_SEGMENTS:,}")
    for i in np.flatnonzero(~(np.abs(waypoints_m) <= FURTHEST_M).all(axis=1)).tolist():
        east, north = waypoints_m[i].tolist()
        must = f"its coordinates must be finite and within {FURTHEST_M:g} m of the origin"
        raise WrongAnswerError(f"{text} a waypoint {i} at ({east:g}, {north:g}) m; {must}")
    return np.asarray(waypoints_m, dtype=np.float64)


def _path(path: Any, position_m: tuple[float, float], start_m: float) -> Path:
    """Returns a copy of a path; WrongAnswerError if it cannot be flown, or begins further than `start_m` away."""
    if path is None:
        raise _path_error("it is none")
    if not issubclass(type(path), Path):
        raise _path_error(f"it is {_type_text(path)}; it must be a Path")
    rows, loiter = path.segments, path.loiter
    if not _is_table(rows, 6) or not len(rows):
        raise _path_error(f"its segments must have shape (n, 6), n > 0; got {_shape_text(rows)}")
    if not isinstance(loiter, bool | np.bool_):
        raise _path_error(f"it has {_type_text(loiter)} as its loiter; it must be True or False")
    if len(rows) > MOST_SEGMENTS:
        raise _path_error(f"it has {len(rows):,} segments; it must have at most {MOST_SEGMENTS:,}")
    rows = np.asarray(rows, dtype=np.float64)
    _check_segments(rows, position_m, start_m)
    if loiter:
        _check_loiter(rows)
    return Path(rows, bool(loiter))


def _require(fits: Any, text: str, *values: FloatArray) -> None:
    """Raises WrongAnswerError for the first segment `i` where `fits` is false; `text` is formatted with its values."""
    if len(bad := np.flatnonzero(~fits)):
        i = int(bad[0])
        raise _path_error(text.format(*(value[i] for value in values), i=i, following=i + 1))


def _check_segments(rows: FloatArray, position_m: tuple[float, float], start_m: float) -> None:
    """Raises WrongAnswerError unless all segments can be flown, join, begin at the aircraft and are not too long."""
    tangent, length = np.hypot(rows[:, 2], rows[:, 3]), rows[:, 5]
    each = "segment {i} is not finite: {:g}, {:g}, {:g}, {:g}, {:g}, {:g}"
    _require(np.isfinite(rows).all(axis=1), each, *rows.T)
    _require(length > 0.0, "segment {i} is {:g} m long; it must be longer than 0 m", length)
    each = "segment {i} begins with a tangent of length {:.9g}; it must be a unit vector"
    _require(np.abs(tangent - 1.0) < UNIT_TOLERANCE, each, tangent)
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
    """Raises WrongAnswerError unless the last segment is a full circle."""
    last = len(rows) - 1
    turn = abs(float(rows[-1, 4] * rows[-1, 5]))
    gap = math.dist(_ends(rows[-1:])[0].tolist(), rows[-1, :2].tolist())
    if not (abs(turn - math.tau) <= FULL_TURN_RAD and gap <= JOIN_M):
        text = f"turns by {math.degrees(turn):.6g} deg and ends {gap:.3g} m from where it begins"
        raise _path_error(f"segment {last}, its loiter, {text}; it must be a full circle")


def _ends(rows: FloatArray) -> FloatArray:
    """(n, 2) where segments of constant curvature end: the chord of an arc that turns by `a` is sinc(a / 2) as long."""
    half = 0.5 * rows[:, 4] * rows[:, 5]
    chord = rows[:, 5] * np.sinc(half / np.pi)
    ahead, left = (chord * np.cos(half))[:, None], (chord * np.sin(half))[:, None]
    return rows[:, :2] + ahead * rows[:, 2:4] + left * np.column_stack((-rows[:, 3], rows[:, 2]))


def _picture(make: Callable[[], PlanPicture] | None) -> Callable[[], PlanPicture] | None:
    """The picture of a plan, made now, so that a flight ends alike whether or not it is recorded."""
    if make is None:
        return None
    if type(made := make()) is not PlanPicture:
        text = f"the planner's picture of its plan is {_type_text(made)}"
        raise WrongAnswerError(f"{text}; it must be a PlanPicture")
    return lambda: made
