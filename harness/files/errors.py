"""Errors of folders and files, and what is told of code of others that raised: the same in every process."""

from __future__ import annotations

import re
import traceback


class RunFolderError(ValueError):
    """A run folder cannot be made or read; the message is one sentence that says why."""


class WriteError(OSError):
    """What was flown could not be written; the message is one sentence that says what became of it."""

    @classmethod
    def of(cls, what: str, folder: object, error: OSError) -> WriteError:
        """The error about what was being written to a folder when another error came."""
        reason = error.strerror or " ".join(str(error).split())
        return cls(f"cannot write {what} in {folder} ({reason}); it is marked incomplete")


MOST_LETTERS = 2000
"""Most characters of a text from other code that stand in a sentence."""


class PlannerError(RuntimeError):
    """A planner cannot be made; the message is one sentence that says why."""


def sentence(error: BaseException) -> str:
    """Its type and what it says, in one line; of a PlannerError what it says alone."""
    try:
        said = str(error)[:MOST_LETTERS]
    except KeyboardInterrupt:
        raise
    except BaseException:  # it may call sys.exit, too
        said = "it cannot be told what"
    if isinstance(error, PlannerError):
        return in_a_line(said)
    name = type(error).__name__[:MOST_LETTERS]
    return in_a_line(f"{name}: {said}" if said else name)


def trace(error: BaseException) -> str:
    """Its traceback; the middle of a very long one is left out."""
    told, half = "".join(traceback.format_exception(error)), 20_000
    if len(told) > 2 * half:
        told = f"{told[:half]}\n... {len(told) - 2 * half:,} characters left out ...\n{told[-half:]}"
    return _same(told)


def in_a_line(text: str) -> str:
    """Text of others as one line."""
    return " ".join(_same(text).split())


def _same(text: str) -> str:
    """Text without addresses of objects, and without what UTF-8 has no bytes for."""
    writable = text.encode("utf-8", "backslashreplace").decode()
    return re.sub(r"\b0x[0-9a-f]{6,16}\b", "0x...", writable)
