"""Finds the one wanted file in a ZIP archive that may be a bomb, or torn; the texts of faults name no file."""

from __future__ import annotations

import lzma
import struct
import zipfile
import zlib
from io import BytesIO
from pathlib import Path
from typing import Final

from harness.files.input_file import InputError
from harness.files.wording import counted, printable

DAMAGES: Final = (  # errors that Python's unpacking raises for damaged archives
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, EOFError, OSError, ValueError, IndexError
)  # fmt: skip


def unpacked(data: bytes, ending: str, most: int) -> tuple[str, bytes]:
    """Unpacks the one file with an ending, of at most `most` bytes; returns its name without folder and its bytes."""
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            name = _choose(archive.namelist(), ending)
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
    return name.rpartition("/")[2], inner


def _choose(names: list[str], ending: str) -> str:
    """Returns the name of the one file in an archive with an ending; InputError if there is not exactly one."""
    own = [name for name in names if not name.lower().startswith("__macosx/")]  # macOS adds forks of files
    held = [each for each in own if each.lower().endswith(ending) and not Path(each).name.startswith("._")]
    if len(held) == 1:
        return held[0]
    if not held:
        raise InputError(f"is a ZIP archive without a {ending} file")
    listed = ", ".join(printable(name)[:60] for name in held[:3]) + (", ..." if len(held) > 3 else "")
    many = f"is a ZIP archive with {counted(len(held), f'{ending} file')} ({listed})"
    raise InputError(f"{many}; must have one: unpack it and give the file that is meant")
