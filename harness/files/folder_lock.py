"""One writer at a time in a folder. A killed process leaves no lock, and no file stays behind in the user's folder."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from harness.files.errors import RunFolderError


class FolderLock:
    """Locks a folder for this process (flock(2) on the folder itself) until it is released; a RunFolderError if locked.

    With a name, a file of that name in it is held in its place, made where missing: on a network file system (NFS) only
    what is open for writing can be held.
    """

    def __init__(self, path: Path, name: str | None = None) -> None:
        flags = os.O_RDONLY | os.O_DIRECTORY if name is None else os.O_RDWR | os.O_CREAT
        self._descriptor = os.open(path / (name or ""), flags, 0o666)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self.release()
            if not isinstance(error, BlockingIOError):
                raise
            raise RunFolderError(
                f"another wayproof is writing to {path}: wait until it has ended or choose another folder"
            ) from error

    def release(self) -> None:
        """Lets others write; a second call does nothing."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)


def is_held(path: Path) -> bool:
    """Tells whether a folder, or a file, is locked as by `FolderLock`; it need not be writable, nor exist."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError as error:
        return isinstance(error, BlockingIOError)
    finally:
        os.close(descriptor)
    return False
