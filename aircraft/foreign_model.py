"""Looks through the folder of somebody's JSBSim model before anything else reads it.

JSBSim reads XML with nothing to bound it: a deep file overflows its stack, and what a file refers to may lie
anywhere. The checks here are made on the text of the files, by expat, without building a tree.
"""

from __future__ import annotations

import os
import xml.parsers.expat as expat
from collections.abc import Iterator
from pathlib import Path, PurePath

MAX_FILES = 1000
MAX_BYTES = 5_000_000
"""Largest size of an XML file."""
MAX_FOLDER_BYTES = 200_000_000
"""Largest size of all files together; all go into the digest, also those that JSBSim does not read."""
MAX_ENTITY = 100
MAX_DEPTH = 60
"""Deepest nesting of elements; the deepest of JSBSim's own models has 13."""


def faults(folder: Path) -> Iterator[str]:
    """What keeps a folder from being loaded, as sentences that begin with the file's name.

    Args:
        folder: of a model, of engines or of systems. Only regular files count; other things are never opened.
    """
    count = size = 0
    for home, inner, names in os.walk(folder):
        for path in (Path(home, name) for name in sorted((*inner, *names))):
            count += 1
            if count > MAX_FILES:
                yield f"{folder}: has more than {MAX_FILES} files; must be the folder of one aircraft"
                return
            if path.is_symlink() and not path.resolve().is_relative_to(folder.resolve()):
                yield f"{path}: is a link that leads out of the folder; must be a file or folder in it"
            elif path.is_file():
                size += path.stat().st_size
                if size > MAX_FOLDER_BYTES:
                    told = f"{size / 1e6:.0f} MB; must be at most {MAX_FOLDER_BYTES // 10**6} MB together"
                    yield f"{path}: with it the files of {folder} have {told}"
                    return
                if path.suffix.lower() == ".xml":
                    yield from _file_faults(path)


def _file_faults(path: Path) -> Iterator[str]:
    if path.stat().st_size > MAX_BYTES:
        yield f"{path}: is larger than {MAX_BYTES // 10**6} MB; must be a JSBSim file"
        return
    parser, depth = expat.ParserCreate(), 0

    def begin(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_DEPTH:
            raise ForeignError(f"is nested deeper than {MAX_DEPTH} elements; must be flatter")
        file = PurePath(attributes.get("file", ""))
        if file.is_absolute() or ".." in file.parts:
            told = f'<{name:.40} file="{str(file)[:80]}"> leads out of the folder'
            raise ForeignError(f"{told}; copy the file into it and give its name")

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    def entity(name: str, parameter: bool, value: str | None, *_: object) -> None:
        if parameter or value is None or "&" in value or len(value) > MAX_ENTITY:
            raise ForeignError(
                f"declares the entity {name:.40}, which is not a short text of its own; write it out"
            )

    parser.StartElementHandler, parser.EndElementHandler, parser.EntityDeclHandler = begin, end, entity
    try:
        parser.Parse(path.read_bytes(), True)
    except expat.ExpatError:
        return  # whoever loads the model says where it is broken
    except OSError as error:
        yield f"{path}: cannot be read ({error.strerror})"
    except ForeignError as error:
        yield f"{path}:{parser.CurrentLineNumber}: {error}"


class ForeignError(ValueError):
    """Something that a model may not have."""
