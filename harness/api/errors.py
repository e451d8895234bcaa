"""Errors as the command line words them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from harness.files.errors import RunFolderError
from harness.files.input_file import InputError


@contextmanager
def as_input_errors() -> Iterator[None]:
    """Lets an error about an aircraft or a folder come out as an InputError with the text of the command line."""
    from aircraft.airframes import AircraftError
    from harness.scenario.validation import KeyFault

    try:
        yield
    except KeyFault as error:
        raise InputError(f"wayproof: {'.'.join(map(str, error.loc))}: {error}") from error
    except (AircraftError, RunFolderError) as error:
        raise InputError(f"wayproof: {error}") from error
