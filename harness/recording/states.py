"""The lanes of the state timeline: what the planner does, whether the bank is at its limit, what is tracked."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from harness.recording import blueprint as look

if TYPE_CHECKING:
    from harness.flight.record import AcceptedPlan, Track

Change = tuple[float, str]
"""Simulated time in s, and the state from then on."""

WAITING = "waiting for a plan"
HOLDING = "holding"
AT_LIMIT, FREE = "bank command at its limit", "bank command below its limit"
TRACKABLE = "trackable"


def over(metrics: Mapping[str, Any]) -> str:
    """The state of a flight that has ended; an overlay shows it while other flights go on."""
    return f"over: {metrics['outcome']}"


class States:
    """Finds the changes of state, block by block.

    Args:
        bank_limit_deg: largest bank command of the guidance.
    """

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
        turn_m = float(path.segments[-1, 5])
        self._turns_at_m.append(path.length_m - turn_m if path.loiter else math.inf)

    def mode_colours(self) -> dict[str, look.Colour]:
        """Colours of the planner's states so far, in the order in which they came up."""
        modes = dict.fromkeys(self._modes)
        colours = {mode: look.MODES[place % len(look.MODES)] for place, mode in enumerate(modes)}
        return {WAITING: look.CALM, HOLDING: look.HOLD, **colours}

    def changes(self, block: Track) -> dict[str, list[Change]]:
        """The changes within a block, by lane."""
        turns_at = np.array([*self._turns_at_m, math.inf])[block.plan_index]
        holding = block.arc_length_m > turns_at
        numbers = np.where(holding, -2, block.plan_index)
        names = {-2: HOLDING, -1: WAITING} | dict(enumerate(self._modes))
        limited = np.abs(block.roll_command_deg) >= self._limit_deg
        return {
            look.PLANNER_LANE: self._new(look.PLANNER_LANE, block, numbers, names),
            look.BANK_LANE: self._new(look.BANK_LANE, block, limited, {0: FREE, 1: AT_LIMIT}),
        }

    def _new(
        self, lane: str, block: Track, numbers: np.ndarray[Any, Any], names: Mapping[int, str]
    ) -> list[Change]:
        rows = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist()]
        found: list[Change] = []
        for row in rows:
            state = names[int(numbers[row])]
            if state != self._now[lane]:
                self._now[lane] = state
                found.append((float(block.time_s[row]), state))
        return found


def mode_of(reason: str) -> str:
    """A plan's reason without its numbers: what stays the same while the planner does the same."""
    told = re.sub(r"\s+at\s+[\d.]+\s+k?m\b", "", reason)
    return re.split(r"[,;:]?\s+(?:(?:at|in|of|after|by)\s+)?[-+]?\d", told)[0].strip() or reason


def tracking_changes(legs: Sequence[Mapping[str, Any]]) -> list[Change]:
    """The lane of the verdicts, from `trackability` of `metrics.json`."""
    found: list[Change] = []
    for leg in legs:
        state = TRACKABLE if leg["trackable"] else str(leg["cause"])
        if not found or found[-1][1] != state:
            found.append((float(leg["start_s"]), state))
    return found


def send_changes(rec: rr.RecordingStream, lane: str, changes: Sequence[Change]) -> None:
    """Writes changes of state into a lane."""
    if changes:
        times, states = zip(*changes, strict=True)
        rec.send_columns(
            f"{look.STATES}/{lane}", [look.time_column(np.array(times))], rr.StateChange.columns(state=states)
        )


def log_colours(rec: rr.RecordingStream, lane: str, states: Mapping[str, look.Colour]) -> None:
    """Gives the states of a lane their colours."""
    rec.log(
        f"{look.STATES}/{lane}",
        rr.StateConfiguration(values=list(states), colors=list(states.values())),
        static=True,
    )
