"""Errors of files: a folder that cannot be used, a file that cannot be written."""

from __future__ import annotations


class RunFolderError(ValueError):
    """A run folder cannot be made or read; the message is one sentence that says why."""


class WriteError(OSError):
    """What was flown could not be written; the message is one sentence that says what became of it."""

    @classmethod
    def of(cls, what: str, folder: object, error: OSError) -> WriteError:
        """The error about something that was being written to a folder when another error came."""
        reason = error.strerror or " ".join(str(error).split())
        return cls(f"cannot write {what} in {folder} ({reason}); it is marked incomplete")
