"""KMZ: a KML file packed as a ZIP archive, with what it links to (OGC 12-007r2, annex on KMZ)."""

from __future__ import annotations

from typing import Final

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.files.zip_archive import unpacked

ZIP: Final = b"PK"
"""How a ZIP archive begins, whatever it is called."""
MAIN_KML: Final = "doc.kml"
"""What the main KML file is called where there are several."""


def kml_of(data: bytes, source: str, most: int) -> tuple[bytes, str, tuple[str, ...]]:
    """The KML of a file that may be packed.

    Args:
        data: of the file.
        source: its name, for faults.
        most: bytes that it may unpack to.

    Returns:
        The KML, its name for faults, and notes on what else is packed.

    Raises:
        InputError: it is packed, and cannot be unpacked or has no main KML file.
    """
    if not data.startswith(ZIP):
        return data, source, ()
    try:
        name, inner, others = unpacked(data, ".kml", most, MAIN_KML)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
    return inner, f"{source} ({name})", (further_kml(others),) if others else ()


def further_kml(others: int) -> str:
    """What is said of KML files beside the main one."""
    return f"{counted(others, 'further KML file')} in the archive passed over"
