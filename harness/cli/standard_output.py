"""What is said on a terminal: no control character of others reaches it.

Standard output outlives its reader: what nobody takes any more is lost, and nothing else.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO

import typer

from harness.files.wording import printable


def say(text: str, *, err: bool = False) -> None:
    """A line of text, control characters in it spelt out, on standard output or standard error."""
    typer.echo(printable(text), err=err)


def results_alone() -> None:
    """From now on only what this program prints as its result reaches the standard output of the process.

    What code of others writes past Python, from C or a process of its own, goes to standard error, so that it cannot
    get into `--json`. So does what is printed when the interpreter ends, once `results_over` was called.
    """
    if sys.stdout is None or sys.stderr is None:
        return
    try:
        results, aside = os.dup(sys.stdout.fileno()), sys.stderr.fileno()
    except (OSError, ValueError):
        return  # no file of the process, or a closed one
    sys.stdout.flush()
    os.dup2(aside, sys.stdout.fileno())
    sys.stdout = open(  # noqa: SIM115  it stays open to the end
        results,
        "w",
        encoding=sys.stdout.encoding,
        errors=sys.stdout.errors,
        buffering=1 if os.isatty(results) else -1,
    )


def results_over() -> None:
    """The result is printed."""
    if sys.stdout is not None:
        try:
            sys.stdout.flush()
        except (OSError, ValueError):
            to_nowhere(sys.stdout)
    sys.stdout = sys.stderr


@contextmanager
def kept_up() -> Iterator[None]:
    """A reader that goes away meanwhile (`wayproof fly ... | head -1`) changes neither what is done nor its status."""
    stream = sys.stdout
    if stream is None:  # closed by whoever started us
        yield
        return
    sys.stdout = _Unread(stream)
    try:
        yield
        sys.stdout.flush()
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
        except OSError as error:
            to_nowhere(self._stream)
            raise OSError(error.errno, error.strerror, "standard output") from error

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def to_nowhere(stream: TextIO) -> None:
    """Has all that is still to be written to a stream lost, so that the interpreter does not try again at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
