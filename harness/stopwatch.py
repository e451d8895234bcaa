"""What each block of the loop costs."""

from __future__ import annotations

import time


class Stopwatch:
    """Sums the wall-clock time since the last lap under the name of the block that it was spent in."""

    def __init__(self) -> None:
        self._seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, block: str) -> None:
        """Books the time since the last lap to a block."""
        now = time.perf_counter()
        self._seconds[block] = self._seconds.get(block, 0.0) + now - self._last
        self._last = now

    def shares(self) -> dict[str, float]:
        """Share of each block in the whole."""
        total = sum(self._seconds.values())
        return {block: seconds / total for block, seconds in self._seconds.items()} if total else {}
