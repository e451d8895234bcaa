"""At which steps of the flight model something is due: guidance, a scan."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

from aircraft.guidance.interface import UPDATE_RATE_HZ


class Instant(NamedTuple):
    """A step at which something is due."""

    guidance: bool
    """Guidance is, and a row of the track."""
    scan: bool
    """A scan is."""
    steps: int
    """Steps of the flight model from here to the next instant."""


def intervals(step_rate_hz: int, scan_rate_hz: float) -> list[tuple[Instant, ...]]:
    """The instants of consecutive guidance intervals, until all of it begins again.

    Args:
        step_rate_hz: steps of the flight model a second.
        scan_rate_hz: scans a second; 0: there are none.

    Returns:
        For each interval its instants; guidance is due at the first of them, and only there.

    Raises:
        ValueError: one of the rates does not divide that of the flight model.
    """
    update = steps_between(step_rate_hz, UPDATE_RATE_HZ, "guidance")
    scan = steps_between(step_rate_hz, scan_rate_hz, "scan") if scan_rate_hz else update
    found = []
    for begin in range(0, math.lcm(scan, update), update):
        end = begin + update
        later = range(begin + scan - begin % scan, end, scan)
        found.append(
            tuple(
                Instant(step == begin, bool(scan_rate_hz) and step % scan == 0, after - step)
                for step, after in pairwise((begin, *later, end))
            )
        )
    return found


def steps_between(step_rate_hz: int, rate_hz: float, name: str) -> int:
    """Steps of the flight model from one event of a rate to the next.

    Raises:
        ValueError: the rate does not divide that of the flight model.
    """
    steps = round(step_rate_hz / rate_hz)
    if steps < 1 or abs(steps * rate_hz - step_rate_hz) > 1e-9 * step_rate_hz:
        raise ValueError(
            f"the {name} rate {rate_hz:g} Hz does not divide the simulation rate {step_rate_hz} Hz"
        )
    return steps
