"""Takes one file out of a ZIP archive that somebody gives, without trust: it may be a bomb, torn, or hold several."""

from __future__ import annotations

import lzma
import struct
import zipfile
import zlib
from collections.abc import Sequence
from io import BytesIO
from typing import Final, NamedTuple

from harness.files.input_file import InputError
from harness.files.wording import counted, printable

FORKS: Final = ("__macosx/", "._")
"""How names begin that macOS adds to archives: they have the endings of files, and none of their content."""

TOLD: Final = 3
"""Names of files that a fault has at most."""

MOST_SHOWN: Final = 60
"""Characters of a name that a line shows."""


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
            held = [each for each in archive.infolist() if _is_a(each.filename.lower(), ending)]
            chosen = _chosen(held, ending, main)
            with archive.open(chosen.filename) as member:
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
    return Unpacked(_base(chosen.filename), inner, len(held) - 1)


DAMAGES: Final = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    EOFError,
    OSError,
    ValueError,
    IndexError,
)
"""What Python's unpacking raises of damaged archives."""


def _is_a(name: str, ending: str) -> bool:
    return name.endswith(ending) and not name.startswith(FORKS[0]) and not _base(name).startswith(FORKS[1])


def _base(name: str) -> str:
    return name.rpartition("/")[2]


def _chosen(held: Sequence[zipfile.ZipInfo], ending: str, main: str) -> zipfile.ZipInfo:
    """The file that is meant.

    Raises:
        InputError: there is none, or it cannot be told.
    """
    if not held:
        raise InputError(f"is a ZIP archive without a {ending} file")
    depth = min(each.filename.count("/") for each in held)
    near = [each for each in held if each.filename.count("/") == depth] if main else held
    called = [each for each in near if main and _base(each.filename).lower() == main]
    if len(near) > 1 and len(called) != 1:
        names = ", ".join(printable(each.filename)[:MOST_SHOWN] for each in near[:TOLD])
        more = ", ..." if len(near) > TOLD else ""
        wanted = f"one, or one called {main}" if main else "one"
        raise InputError(
            f"is a ZIP archive with {counted(len(near), f'{ending} file')} ({names}{more}); must have {wanted}: unpack "
            "it and give the file that is meant"
        )
    return called[0] if called else near[0]
