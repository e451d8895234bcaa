"""Opens world files without trust: bounded in size, depth and what they unpack to."""

from __future__ import annotations

import codecs
import gc
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree
from xml.parsers import expat

from harness.files.input_file import InputError, open_regular
from harness.files.zip_archive import Unpacked, unpacked
from harness.world_files.parts import WorldFileError

MAX_BYTES: Final = 400_000_000
"""Of a file that is read in pieces, or whose numbers take little more room than its bytes."""
MAX_TREE_BYTES: Final = 64_000_000
"""Of JSON and XML that is read whole: it takes about ten times the room."""


@contextmanager
def uncollected() -> Iterator[None]:
    """Holds Python's search for reference cycles off: among millions of objects that are kept, it finds none.

    It takes most of the time of reading a large file otherwise.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


UTF_16: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
"""How a text begins that Windows' editors call Unicode."""


def read_bytes(path: Path, most: int = MAX_BYTES) -> bytes:
    """The bytes of a regular file.

    Raises:
        WorldFileError: it cannot be read or is too large.
    """
    try:
        with open_regular(path) as file:
            data: bytes = file.read(most + 1)
    except InputError as error:
        raise WorldFileError(str(error).removeprefix(f"{path}: ")) from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise WorldFileError(f"cannot be read ({reason}); give the path of a file") from error
    _check_bytes(len(data), most)
    return data


def check_size(path: Path, most: int = MAX_BYTES) -> None:
    """Raises WorldFileError if a file is too large."""
    _check_bytes(path.stat().st_size, most)


def _check_bytes(size: int, most: int) -> None:
    if size > most:
        raise WorldFileError(f"is larger than {most // 10**6} MB; cut the area of interest out of it first")


def head(path: Path, size: int = 65_536) -> bytes:
    """The first bytes of a regular file."""
    try:
        with open_regular(path) as file:
            first: bytes = file.read(size)
            return first
    except InputError as error:
        raise WorldFileError(str(error).removeprefix(f"{path}: ")) from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise WorldFileError(f"cannot be read ({reason}); give the path of a file") from error


def text_of(data: bytes) -> str:
    """Bytes as text: UTF-8, UTF-16 that says so, or Latin-1 as older airspace files are."""
    if data.startswith(UTF_16):
        return data.decode("utf-16", "replace")
    if b"\0" in data:
        raise WorldFileError("is not a text file; give a file of one of the kinds that are known")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def json_of(path: Path, lines: bool = False) -> Any:
    """The content of a JSON file; numbers that are not finite are refused.

    Args:
        path: of the file.
        lines: it may be several texts, one a line; a list of them is returned, of one where it is not.

    Raises:
        WorldFileError: it is too large or is not JSON.
    """
    data = read_bytes(path, MAX_TREE_BYTES)

    def refuse(word: str) -> float:
        raise WorldFileError(f"has the number {word}; must have finite numbers only")

    try:
        text = text_of(data)
        first, _, more = text.lstrip().partition("\n")
        if lines and first.rstrip().endswith("}") and more.lstrip().startswith("{"):
            return [json.loads(line, parse_constant=refuse) for line in text.splitlines() if line.strip()]
        whole = json.loads(text, parse_constant=refuse)
        return [whole] if lines else whole
    except (RecursionError, MemoryError) as error:
        raise WorldFileError("is nested too deeply; must be a map") from error
    except ValueError as error:
        if isinstance(error, WorldFileError):
            raise
        line = getattr(error, "lineno", 1)
        raise WorldFileError(f"is not whole JSON (line {line}); it may be torn: get it again") from error


def xml_events(data: bytes, ends_only: bool = True) -> Iterator[tuple[str, ElementTree.Element]]:
    """Elements of an XML text as they end; whoever reads them clears them.

    Declarations of entities are refused: a few lines of them unpack to gigabytes.

    Raises:
        WorldFileError: it is not whole XML.
    """
    _refuse_entities(data)
    try:
        if ends_only:
            yield from ElementTree.iterparse(BytesIO(data), events=("end",))
        else:
            yield from ElementTree.iterparse(BytesIO(data), events=("start", "end"))
    except ElementTree.ParseError as error:
        raise WorldFileError(
            f"is not whole XML (line {error.position[0]}); it may be torn: get it again"
        ) from error


def xml_tags(data: bytes, begin: Callable[[str, dict[str, str]], None]) -> None:
    """Tells of the tags of an XML text in their order, without keeping anything: for files of millions of elements.

    Args:
        data: the text.
        begin: told the name and the attributes of each element.

    Raises:
        WorldFileError: it is not whole XML, or declares entities.
    """
    parser = expat.ParserCreate()
    parser.EntityDeclHandler = _no_entities
    parser.StartElementHandler = begin
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise WorldFileError(
            f"is not whole XML (line {error.lineno}); it may be torn: get it again"
        ) from error


def _no_entities(*_: object) -> None:
    raise WorldFileError("declares XML entities; must be plain XML")


def _refuse_entities(data: bytes) -> None:
    # Entities can only be declared before the first element.
    if b"<!DOCTYPE" in data[:100_000] or b"<!ENTITY" in data[:100_000]:
        xml_tags(data, lambda name, attributes: None)


def unzipped(data: bytes, ending: str, most: int, main: str = "") -> Unpacked:
    """The file with an ending in a ZIP archive, as `harness.files.zip_archive.unpacked` has it.

    Raises:
        WorldFileError: there is none or several, it is damaged or encrypted, or it unpacks to more than `most` bytes.
    """
    try:
        return unpacked(data, ending, most, main)
    except InputError as error:
        raise WorldFileError(str(error)) from error
