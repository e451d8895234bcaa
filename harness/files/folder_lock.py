"""One writer at a time in a folder. A killed process leaves no lock, and no file stays behind in the user's folder."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import Final

from harness.files.errors import RunFolderError
from harness.files.input_file import read_index
from harness.files.whole_file import PARTIAL

MAX_INDEX_BYTES: Final = 10**9  # largest index of a folder that is read


class FolderLock:
    """Locks a folder for this process (flock(2) on the folder itself) until it is released; a RunFolderError if locked.

    With a name, that file in it is held instead, made where missing: on NFS only what is open for writing can be held.
    """

    def __init__(self, path: Path, name: str | None = None) -> None:
        flags = os.O_RDONLY | os.O_DIRECTORY if name is None else os.O_RDWR | os.O_CREAT
        self._descriptor = os.open(path / (name or ""), flags, 0o666)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self.close()
            if not isinstance(error, BlockingIOError):
                raise
            text = f"another wayproof is writing to {path}: wait until it has ended or choose another folder"
            raise RunFolderError(text) from error

    def close(self) -> None:
        """Lets others write; a second call does nothing."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)


def claim_folder(path: Path, what: str, index: str, schema: str, lock: str | None = None) -> FolderLock:
    """Locks the folder that a command writes (`what`), with its file `lock` if named; or raises RunFolderError."""
    if not str(path).isprintable():  # the libraries that write tables take names in UTF-8 only
        raise RunFolderError(f"cannot write the {what} {str(path)!r}: its name must be printable")
    if path.exists() and not path.is_dir():
        raise RunFolderError(f"{path} is a file: choose another place for the {what}")
    try:
        path.mkdir(parents=True, exist_ok=True)
        others = {each.name for each in path.iterdir() if not each.name.endswith(PARTIAL)} - {lock}
        if others and read_index(path / index, schema, MAX_INDEX_BYTES) is None:
            raise RunFolderError(f"{path} is not empty and not a {what}: choose another folder or empty it first")
        return FolderLock(path, lock)
    except OSError as error:
        raise RunFolderError(f"cannot write the {what} {path}: {error.strerror or error}") from error


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
