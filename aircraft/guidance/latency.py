"""What a state was some time ago: the age of what guidance works with."""

from __future__ import annotations

import math
from collections import deque
from typing import Final

from aircraft.interface import AircraftState

GROWS_OLD: Final = AircraftState._fields[1 : AircraftState._fields.index("load_factor") + 1]
"""What of a state is as old as the latency: all from position to load factor."""


def as_it_was(past: deque[AircraftState], state: AircraftState, latency_s: float) -> AircraftState:
    """The state some time ago, but for its time; before the first one it moves evenly.

    `past` are states of earlier calls, the oldest first; this one is added, and those that are too old go.
    """
    if latency_s == 0.0:
        return state
    if not past or state.time_s > past[-1].time_s:
        past.append(state)
    then_s = state.time_s - latency_s
    while len(past) > 1 and past[1].time_s <= then_s:
        past.popleft()
    old = past[0]
    new = past[1] if len(past) > 1 else old
    share = (then_s - old.time_s) / (new.time_s - old.time_s) if then_s > old.time_s else 0.0
    lead_s = min(then_s - old.time_s, 0.0)
    values = {name: (1.0 - share) * a + share * b for name, a, b in zip(old._fields, old, new, strict=True)}
    values["heading_rad"] = old.heading_rad + share * math.remainder(
        new.heading_rad - old.heading_rad, math.tau
    )
    values |= {"east_m": values["east_m"] + lead_s * old.velocity_east_mps}
    values |= {"north_m": values["north_m"] + lead_s * old.velocity_north_mps}
    return state._replace(**{name: values[name] for name in GROWS_OLD})
