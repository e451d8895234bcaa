"""What each block of the loop costs."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any


class Stopwatch:
    """Sums the time spent in parts of the loop, block by block.

    A part is watched from outside, so that a loop that is not measured pays nothing.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        """Wall-clock time by block."""

    def over(self, part: Any, block: str, *methods: str) -> Any:
        """A stand-in for a part: its time in some methods is booked to a block.

        Args:
            part: any object; everything that is read of it goes to itself.
            block: name of the block.
            methods: names of the methods to be watched.
        """
        return _Watched(part, {name: self._timed(getattr(part, name), block) for name in methods})

    def _timed(self, method: Callable[..., Any], block: str) -> Callable[..., Any]:
        clock, seconds = time.perf_counter, self.seconds

        def timed(*arguments: Any, **named: Any) -> Any:
            begun = clock()
            try:
                return method(*arguments, **named)
            finally:
                seconds[block] += clock() - begun

        return timed


class _Watched:
    def __init__(self, part: Any, methods: dict[str, Callable[..., Any]]) -> None:
        self.__dict__.update(methods)
        self._part = part

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)
