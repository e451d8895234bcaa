"""The steps of the flight model at which guidance or a scan is due."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

from aircraft.guidance.interface import UPDATE_RATE_HZ


class Instant(NamedTuple):
    """A step at which something is due: guidance with a row of the track, or a scan; and the steps to the next one.

    `half` are the steps to half way between two updates of guidance, negative after it.
    """

    guidance: bool
    scan: bool
    steps: int
    half: int


def intervals(step_rate_hz: int, scan_rate_hz: float) -> list[tuple[Instant, ...]]:
    """Returns the instants of consecutive guidance intervals until they repeat; guidance is due at the first.

    Without scans `scan_rate_hz` is 0. Raises `ValueError` where a rate does not divide that of the flight model.
    """
    update = _steps_between(step_rate_hz, UPDATE_RATE_HZ, "guidance")
    scan = _steps_between(step_rate_hz, scan_rate_hz, "scan") if scan_rate_hz else update
    found = []
    for begin in range(0, math.lcm(scan, update), update):
        end, half = begin + update, begin + update // 2
        instants = (
            Instant(step == begin, bool(scan_rate_hz) and step % scan == 0, after - step, half - step)
            for step, after in pairwise((begin, *range(begin + scan - begin % scan, end, scan), end))
        )
        found.append(tuple(instants))
    return found


def _steps_between(step_rate_hz: int, rate_hz: float, name: str) -> int:
    steps = round(step_rate_hz / rate_hz)
    if steps < 1 or abs(steps * rate_hz - step_rate_hz) > 1e-9 * step_rate_hz:
        whole = f"the simulation rate {step_rate_hz} Hz"
        raise ValueError(f"the {name} rate {rate_hz:g} Hz does not divide {whole}")
    return steps
