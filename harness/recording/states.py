"""Lanes of states in a recording (planner, bank at its limit, what is tracked), and lines of events."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import rerun as rr

from harness.flight.observer import Caution
from harness.flight.record import AcceptedPlan, Track
from harness.recording import blueprint as look

Change = tuple[float, str]  # simulated time in s, and the state from then on

WAITING = "waiting for a plan"  # state of the planner before its first plan
HOLDING = "holding"  # state of the planner on the turn that ends its plan
OVER = "over"  # state of every lane after the flight, while others of an overlay go on
AT_LIMIT, FREE = "bank command at its limit", "bank command below its limit"
TRACKABLE = "trackable"  # state of a leg that was tracked
CLEAR_AGAIN_FACTOR: Final = 1.05
"""An aircraft that came too near is clear again at this many times the wanted clearance."""
TOLD_DELAY_S: Final = 0.05  # the event of a plan tells its delay after the scan if it is at least this


class States:
    """Finds the changes of state in the track, block by block."""

    def __init__(self, bank_limit_deg: float) -> None:
        self._limit_deg = bank_limit_deg - 0.01
        self._modes: list[str] = []
        self._turns_at_m: list[float] = []
        self._now = {look.PLANNER_LANE: "", look.BANK_LANE: ""}

    def on_plan(self, accepted: AcceptedPlan) -> None:
        """Takes the plan of the rows to come; call it before their block."""
        path = accepted.plan.path
        assert path is not None
        self._modes.append(mode_of(accepted.plan.reason))
        self._turns_at_m.append(path.length_m - float(path.segments[-1, 5]) if path.loiter else math.inf)

    def mode_colours(self) -> dict[str, look.Colour]:
        """Colours of the planner's states so far, in the order in which they came up."""
        modes = dict.fromkeys(self._modes)
        colours = {mode: look.MODES[place % len(look.MODES)] for place, mode in enumerate(modes)}
        return {WAITING: look.CALM, HOLDING: look.HOLD, OVER: look.CALM, **colours}

    def changes(self, block: Track) -> dict[str, list[Change]]:
        """Returns the changes within a block, by lane."""
        holding = block.arc_length_m > np.array([*self._turns_at_m, math.inf])[block.plan_index]
        numbers = np.where(holding, -2, block.plan_index)
        names = {-2: HOLDING, -1: WAITING} | dict(enumerate(self._modes))
        limited = np.abs(block.roll_command_deg) >= self._limit_deg
        return {
            look.PLANNER_LANE: self._changes(look.PLANNER_LANE, block, numbers, names),
            look.BANK_LANE: self._changes(look.BANK_LANE, block, limited, {0: FREE, 1: AT_LIMIT}),
        }

    def _changes(
        self, lane: str, block: Track, numbers: np.ndarray[Any, Any], names: Mapping[int, str]
    ) -> list[Change]:
        found: list[Change] = []
        for row in [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist()]:
            if (state := names[int(numbers[row])]) != self._now[lane]:
                self._now[lane] = state
                found.append((float(block.time_s[row]), state))
        return found


def mode_of(reason: str) -> str:
    """Replaces each number in a plan's reason by an ellipsis; it stays the same while the planner does the same."""
    return re.sub(r"[-+]?\d+(?:[.,]\d+)*", "\N{HORIZONTAL ELLIPSIS}", reason)


def send_changes(rec: rr.RecordingStream, lane: str, changes: Sequence[Change]) -> None:
    """Writes changes of state into a lane."""
    if changes:
        times, states = zip(*changes, strict=True)
        columns = rr.StateChange.columns(state=states)
        rec.send_columns(f"{look.STATES}/{lane}", [look.time_column(np.array(times))], columns)


def log_colours(rec: rr.RecordingStream, lane: str, states: Mapping[str, look.Colour]) -> None:
    """Gives the states of a lane their colours."""
    shown = rr.StateConfiguration(values=list(states), colors=list(states.values()))
    rec.log(f"{look.STATES}/{lane}", shown, static=True)


def plan_text(accepted: AcceptedPlan) -> str:
    """Returns the event line of a plan that takes effect."""
    late = f", {accepted.delay_s:.1f} s after its scan" if accepted.delay_s >= TOLD_DELAY_S else ""
    return f"{accepted.plan.reason} (plan {accepted.plan_index}, {accepted.compute_ms:.1f} ms{late})"


def send_events(
    rec: rr.RecordingStream, events: Sequence[tuple[float, str, look.Colour]], after_s: float = -math.inf
) -> float:
    """Writes lines into the log of events, a `Caution` as a warning; returns the time of the last line."""
    if not events:
        return after_s
    times, texts, colours = zip(*sorted(events, key=lambda event: event[0]), strict=True)
    # A table by time keeps one event of each time: of several at once each is a nanosecond later.
    rising = itertools.accumulate(times, lambda before, at_s: max(at_s, before + 1e-9), initial=after_s)
    apart_s = np.array([*rising][1:])
    warned = [isinstance(text, Caution) for text in texts]
    rec.send_columns(
        look.EVENTS,
        [look.time_column(apart_s)],
        rr.TextLog.columns(
            text=[f"t = {at:.0f} s: {text}" for at, text in zip(times, texts, strict=True)],
            level=[rr.TextLogLevel.WARN if each else rr.TextLogLevel.INFO for each in warned],
            color=[look.WARNED if warns else own for warns, own in zip(warned, colours, strict=True)],
        ),
    )
    return float(apart_s[-1])


class NearMisses:
    """Finds when the aircraft comes nearer to an obstacle than was wanted, and when it is clear again."""

    def __init__(self, wanted_m: float) -> None:
        self._wanted_m, self._least_m = wanted_m, math.inf

    def events(self, block: Track) -> list[tuple[float, str]]:
        """Returns times and texts for consecutive rows of the track."""
        found: list[tuple[float, str]] = []
        if self._least_m == math.inf and not (block.clearance_m < self._wanted_m).any():
            return found
        for time_s, clearance_m in zip(block.time_s.tolist(), block.clearance_m.tolist(), strict=True):
            if clearance_m < self._wanted_m:
                if self._least_m == math.inf:
                    near = f"nearer to an obstacle than the wanted {self._wanted_m:g} m"
                    found.append((time_s, Caution(near if self._wanted_m else "inside an obstacle")))
                self._least_m = min(self._least_m, clearance_m)
            elif self._least_m < math.inf and clearance_m > CLEAR_AGAIN_FACTOR * self._wanted_m:
                text = f"clear of the obstacle again, after {self._least_m:.1f} m at the least"
                found.append((time_s, text))
                self._least_m = math.inf
        return found
