"""Standard output that outlives its reader: what nobody takes any more is lost, and nothing else."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO


@contextmanager
def kept_up() -> Iterator[None]:
    """A reader that goes away meanwhile (`wayproof fly ... | head -1`) changes neither what is done nor its status."""
    stream = sys.stdout
    if stream is not None:  # None: closed by whoever started us
        sys.stdout = _Unread(stream)
    try:
        yield
    finally:
        sys.stdout = stream


class _Unread:
    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        self._quietly(lambda: self._stream.write(text))
        return len(text)

    def flush(self) -> None:
        self._quietly(self._stream.flush)

    def _quietly(self, action: Callable[[], object]) -> None:
        try:
            action()
        except BrokenPipeError:
            to_nowhere(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def to_nowhere(stream: TextIO) -> None:
    """Has all that is still to be written to a stream lost, so that the interpreter does not try again at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
