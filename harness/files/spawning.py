"""Child processes that do not run the caller's script again."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

_starting = threading.Lock()


@contextmanager
def without_main() -> Iterator[None]:
    """Processes that are begun in the block, by `spawn`, do not import the `__main__` of this one.

    Python lets a spawned process import it, for functions that are defined there. Ours need none, and a script that
    calls us at its top, without `if __name__ == "__main__":`, would begin processes without end.
    """
    with _starting:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main
