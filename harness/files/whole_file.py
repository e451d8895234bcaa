"""Files that are replaced whole: whoever reads one finds the old content or all of the new."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

PARTIAL: Final = ".partial"
"""Ends the name under which a file is written until it is whole."""


def replace_text(path: Path, text: str) -> None:
    """Writes a text file; it is on the disk when this returns."""
    partial = path.with_name(path.name + PARTIAL)
    try:
        with partial.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except OSError:
        partial.unlink(missing_ok=True)
        raise
