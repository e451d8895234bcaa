"""Whether the world has stood still long enough for a verdict on it."""

from __future__ import annotations

import math

from planner.interface import MapView

SETTLED_S = 600.0
"""No goal is called unreachable for this long after something last moved or appeared: the way may open again."""


class WorldStability:
    """Remembers when something last moved or appeared."""

    def __init__(self) -> None:
        self.changed_s = -math.inf  # simulated time (s) when something last moved or appeared; -inf for never

    @property
    def ever_changed(self) -> bool:
        """Whether anything has moved or appeared so far."""
        return math.isfinite(self.changed_s)

    def note(self, time_s: float, seen: MapView) -> bool:
        """Takes in what is seen; returns whether something has moved or appeared since the last call."""
        changed_s = time_s if seen.moving else seen.last_contradiction_s
        newer = changed_s > self.changed_s
        self.changed_s = max(self.changed_s, changed_s)
        return newer

    def settled(self, time_s: float) -> bool:
        """Tells whether nothing has moved or appeared for `SETTLED_S`, so that what closes the way is taken to stay."""
        return time_s - self.changed_s > SETTLED_S
