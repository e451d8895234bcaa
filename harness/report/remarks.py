"""What a reader of one flight should know beside its outcome, before the figures; of most flights nothing."""

from __future__ import annotations

from typing import Final, NamedTuple

from harness.analysis.metric import number
from harness.analysis.rows import Row

LONG_AT_LIMIT: Final = 0.05
"""Share of the time at the bank limit: in a flight as planned the command is hardly ever cut."""
MANY_LOST: Final = 0.25
"""Share of the returns: a sensor that loses more is no usual one."""
FAR_JUMP: Final = 0.5
"""Share of the wanted clearance. A jump of the believed position by more can carry a plan into an obstacle."""


class Remark(NamedTuple):
    """A remark: what it is about, and a clause on it."""

    about: str
    text: str


def remarks(row: Row, clearance_m: float, speed_mps: float, *, given: bool = False) -> list[Remark]:
    """What is not as usual in a flight, whatever its outcome.

    Args:
        row: its figures.
        clearance_m: the wanted clearance; 0 where none is.
        speed_mps: the airspeed flown.
        given: the path was given, so that nobody wanted a clearance.
    """
    found = []
    if not given and (row.clearance_violation_s or 0.0) > 0.0:
        least, time = number(row.min_clearance_m), number(row.clearance_violation_s)
        text = f"{least} m at the least; for {time} s nearer than the wanted {number(clearance_m)} m"
        found.append(Remark("nearer to an obstacle than wanted", text))
    if (row.bank_saturation_fraction or 0.0) > LONG_AT_LIMIT:
        found.append(
            Remark("long at the bank limit", f"{number(row.bank_saturation_fraction, 100.0)} % of the time")
        )
    delay_s = row.plan_delay_max_s or 0.0
    if not given and delay_s * speed_mps > clearance_m > 0.0:
        far = number(delay_s * speed_mps)
        text = f"a plan took effect up to {number(delay_s)} s after the scan that it was made from; the aircraft flew "
        text += f"{far} m meanwhile, more than the wanted clearance of {number(clearance_m)} m"
        found.append(Remark("late plans", text))
    if (row.lost_returns or 0.0) > MANY_LOST:
        lost = number(row.lost_returns, 100.0)
        found.append(
            Remark("many returns lost", f"{lost} % of the beams that met something returned nothing")
        )
    jump_m = row.navigation_jump_m or 0.0
    if jump_m > FAR_JUMP * clearance_m > 0.0:
        text = f"by {number(jump_m)} m at once, where the wanted clearance is {number(clearance_m)} m"
        found.append(Remark("the believed position jumped", text))
    return found
