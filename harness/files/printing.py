"""Where code of others prints to."""

from __future__ import annotations

import sys


class PrintingAside:
    """In this block what is printed goes to standard error: standard output carries the results of a command alone."""

    def __enter__(self) -> None:
        self._before, sys.stdout = sys.stdout, sys.stderr

    def __exit__(self, *_: object) -> None:
        sys.stdout = self._before
