"""One writer at a time in a folder. The lock leaves no file, and a killed process leaves no lock."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from harness.record import RunFolderError


class FolderLock:
    """Holds a folder for this process (flock(2) on the folder itself) until it is released.

    Args:
        path: the folder; it must exist.

    Raises:
        RunFolderError: another process, or another lock of this one, holds it.
        OSError: the folder cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            self.release()
            raise RunFolderError(
                f"another wayproof is writing to {path}: wait until it has ended or choose another folder"
            ) from error
        except OSError:
            self.release()
            raise

    def release(self) -> None:
        """Lets others write; again it does nothing."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)
