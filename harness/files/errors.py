"""Errors of folders and files, and texts for errors that foreign code raised: the same in every process."""

from __future__ import annotations

import re
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager

MOST_CHARACTERS = 2000  # a text from other code is cut to this many characters before it stands in a sentence


class RunFolderError(ValueError):
    """A run folder cannot be made or read; the message is one sentence that says why."""


class WriteError(OSError):
    """What was flown could not be written; the message is one sentence that says what became of it."""

    @classmethod
    def of(cls, what: str, folder: object, error: OSError) -> WriteError:
        """Makes the error for writing `what` to a folder from the system's error."""
        reason = error.strerror or " ".join(str(error).split())
        return cls(f"cannot write {what} in {folder} ({reason}); it is marked incomplete")


class PlannerError(RuntimeError):
    """A planner cannot be made; the message is one sentence that says why."""


@contextmanager
def printing_aside() -> Iterator[None]:
    """In this block what foreign code prints goes to standard error; such blocks of several threads may overlap."""
    output, aside = sys.stdout, sys.stderr
    if output is not aside:  # else another thread sets it back
        sys.stdout = aside
    try:
        yield
    finally:
        if output is not aside:
            sys.stdout = output


def sentence(error: BaseException) -> str:
    """Returns an error's type and text in one line; of a PlannerError the text alone."""
    try:
        message = str(error)[:MOST_CHARACTERS]
    except KeyboardInterrupt:
        raise
    except BaseException:  # it may call sys.exit, too
        message = "it cannot be told what"
    if isinstance(error, PlannerError):
        return in_a_line(message)
    name = type.__dict__["__name__"].__get__(type(error))[:MOST_CHARACTERS]  # its metaclass may say otherwise
    return in_a_line(f"{name}: {message}" if message else name)


def trace(error: BaseException) -> str:
    """Returns an error's traceback; the middle of a very long one is left out."""
    text, half = "".join(traceback.format_exception(error)), 20_000
    if len(text) > 2 * half:
        text = f"{text[:half]}\n... {len(text) - 2 * half:,} characters left out ...\n{text[-half:]}"
    return _reproducible(text)


def in_a_line(text: str) -> str:
    """Returns foreign text as one line."""
    return " ".join(_reproducible(text).split())


def _reproducible(text: str) -> str:
    """Removes from a text the addresses of objects, and what UTF-8 has no bytes for."""
    return re.sub(r"\b0x[0-9a-f]{6,16}\b", "0x...", text.encode("utf-8", "backslashreplace").decode())
