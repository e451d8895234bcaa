"""The commands that show what was flown: `view`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from harness.commands.options import FAILED, bad_input


def view(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN_DIR...", help="Run folders; several are overlaid.")
    ],
) -> int:
    """Opens recordings in the rerun viewer."""
    return 0 if open_viewer(runs) else FAILED


def open_viewer(runs: Sequence[Path]) -> bool:
    """Shows recordings until the viewer is closed; says on standard error why, if it cannot start."""
    from harness.record import RunFolderError
    from harness.rerun_viewer import ViewerError, open_viewer

    try:
        open_viewer(runs)
    except RunFolderError as error:
        raise bad_input(error) from error
    except ViewerError as error:
        typer.echo(f"wayproof: {error}", err=True)
        return False
    return True
