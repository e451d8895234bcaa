"""Files that are replaced whole: whoever reads one finds the old content or all of the new.

Every output is a fresh file that takes its name when whole. A link is replaced, never followed; a pipe is refused.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

PARTIAL: Final = ".partial"  # a file that is being written has a name with this ending until it is whole


def replace_text(path: Path, text: str) -> None:
    """Writes a text file, UTF-8, what has no bytes there spelt out; it is on the disk when this returns."""
    replace_bytes(path, text.encode(errors="backslashreplace"))


def replace_bytes(path: Path, content: bytes) -> None:
    """Writes a file; it is on the disk when this returns."""
    with replacing(path) as file:
        file.write(content)


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Gives a new file, which replaces `path` when the block ends without an error; an OSError names the file."""
    partial = path.with_name(path.name + PARTIAL)
    with _naming(path):
        _check_replaceable(path)
        with fresh(partial) as file:
            try:
                yield file
                file.flush()
                os.fsync(file.fileno())
                partial.replace(path)
            except BaseException:
                partial.unlink(missing_ok=True)
                raise


def fresh(path: Path) -> BinaryIO:
    """Opens a new file in place of one that lies there; a link there is not followed. OSErrors as `replacing`."""
    with _naming(path):
        _check_replaceable(path)
        path.unlink(missing_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        return os.fdopen(os.open(path, flags, 0o666), "wb", buffering=0 if path.suffix == ".rrd" else -1)


def append_to(path: Path) -> BinaryIO:
    """Opens a regular file to append to, made where missing; a link is not followed. OSErrors as `replacing`."""
    with _naming(path):
        if path.is_symlink() or (path.exists() and not path.is_file()):
            raise OSError(errno.EINVAL, "is a link, a pipe or a device, not a file")
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW | os.O_CLOEXEC
        return os.fdopen(os.open(path, flags, 0o666), "ab")


def _check_replaceable(path: Path) -> None:
    """Raises OSError if something other than a file or a link lies at a path."""
    try:
        kind = stat.S_IFMT(path.lstat().st_mode)
    except FileNotFoundError:
        return
    if kind == stat.S_IFDIR:
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if kind not in (stat.S_IFREG, stat.S_IFLNK):
        raise OSError(errno.EINVAL, "is a pipe or a device, not a file")


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Names the file in an error that does not."""
    try:
        yield
    except OSError as error:
        if error.errno is None or str(error.strerror).startswith(path.name):
            raise
        raise type(error)(error.errno, f"{path.name}: {error.strerror}", str(path)) from error
