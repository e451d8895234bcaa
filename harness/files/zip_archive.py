"""Takes one file out of a ZIP archive that somebody gives, without trust: it may be a bomb, torn, or hold several."""

from __future__ import annotations

import lzma
import struct
import zipfile
import zlib
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Final, NamedTuple

from harness.files.input_file import InputError
from harness.files.wording import counted, printable

DAMAGES: Final = (
    *(zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error),
    *(EOFError, OSError, ValueError, IndexError),
)
"""What Python's unpacking raises of damaged archives."""

FORKS: Final = ("__macosx/", "._")
"""How names begin that macOS adds to archives: they have the endings of files, and none of their content."""

TOLD: Final = 3
"""Names of files that a fault has at most, each of at most 60 characters."""


class Unpacked(NamedTuple):
    """A file out of an archive.

    Attributes:
        name: its name, without its folder.
        data: its bytes.
        others: how many further files with its ending are in the archive.
    """

    name: str
    data: bytes
    others: int


def unpacked(data: bytes, ending: str, most: int, main: str = "") -> Unpacked:
    """The file with an ending in a ZIP archive.

    Of several the one is taken that alone is nearest to the root, as KMZ has it, else the one called `main`.

    Args:
        data: the archive.
        ending: of its name, in lower case.
        most: bytes that it may unpack to.
        main: its name where there are several, in lower case; empty: there must be one.

    Raises:
        InputError: there is none or several, it is damaged or encrypted, or it unpacks to more. The text names no file.
    """
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            name, others = _chosen(archive.namelist(), (ending,), main)
            with archive.open(name) as member:
                inner = member.read(most + 1)
    except InputError:
        raise
    except RuntimeError as error:  # it wants a password, or is of a method that zipfile does not know
        why = " ".join(str(error).split())[:120]
        raise InputError(f"is a ZIP archive that cannot be unpacked ({why}); unpack it first") from error
    except DAMAGES as error:
        raise InputError("is a damaged ZIP archive; get it again") from error
    if len(inner) > most:
        raise InputError(f"unpacks to more than {most // 10**6} MB; must be one {ending} file")
    return Unpacked(_base(name), inner, others)


def member_path(path: Path, endings: tuple[str, ...], most: int) -> str:
    """The path by which GDAL opens the one file with one of some endings in a ZIP archive; the rest as `unpacked`."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except DAMAGES as error:
        raise InputError("is a damaged ZIP archive; get it again") from error
    if sum(each.file_size for each in members) > most:
        raise InputError(f"unpacks to more than {most // 10**6} MB; cut the area of interest out of it")
    return f"/vsizip/{path.absolute()}/{_chosen([each.filename for each in members], endings)[0]}"


def _base(name: str) -> str:
    return name.rpartition("/")[2]


def _is_a(name: str, endings: tuple[str, ...]) -> bool:
    return name.endswith(endings) and not name.startswith(FORKS[0]) and not _base(name).startswith(FORKS[1])


def _chosen(names: Sequence[str], endings: tuple[str, ...], main: str = "") -> tuple[str, int]:
    """The file that is meant of those in an archive, and how many more have such an ending."""
    held = [name for name in names if _is_a(name.lower(), endings)]
    kind = " or ".join(endings)
    if not held:
        raise InputError(f"is a ZIP archive without a {kind} file")
    depth = min(name.count("/") for name in held)
    near = [name for name in held if name.count("/") == depth] if main else held
    called = [name for name in near if _base(name).lower() == main]
    if len(near) > 1 and len(called) != 1:
        raise InputError(_several(near, kind, main))
    return (called or near)[0], len(held) - 1


def _several(near: Sequence[str], kind: str, main: str) -> str:
    """Says that it cannot be told which file is meant."""
    told = ", ".join(printable(name)[:60] for name in near[:TOLD]) + (", ..." if len(near) > TOLD else "")
    wanted = f"one, or one called {main}" if main else "one"
    return (
        f"is a ZIP archive with {counted(len(near), f'{kind} file')} ({told}); must have {wanted}: unpack it and give "
        "the file that is meant"
    )
