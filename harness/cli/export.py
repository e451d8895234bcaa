"""The command `export`: a run for other tools."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from harness.cli.command_line import written
from harness.cli.options import argument, option
from harness.cli.standard_output import say, to_nowhere
from harness.files.errors import RunFolderError
from harness.files.input_file import InputError

Form = Literal["plan", "waypoints", "geojson", "kml"]
What = Literal["flown", "planned"]


def export(
    run_dir: Annotated[Path, argument("RUN_DIR", "A run folder.")],
    form: Annotated[Form, option("FORMAT", "plan, waypoints, geojson or kml.", "--format")],
    what: Annotated[What, option("WHAT", "flown: the track; planned: the plans in effect.")] = "flown",
    out: Annotated[Path | None, option("FILE", "Default: standard output.")] = None,
) -> int:
    """Writes a run for QGroundControl (plan), MAVLink (waypoints) or maps (geojson, kml).

    For example: wayproof export runs/my_run --format plan --out way.plan
    """
    from harness.files.whole_file import replace_bytes
    from harness.run_files.exports import exported
    from harness.run_files.run_folder import WRONG_CONTENT, damaged, load_run

    try:
        content, notes = exported(load_run(run_dir), form, what)
    except (InputError, RunFolderError):
        raise
    except WRONG_CONTENT as error:
        raise damaged(run_dir, error) from error
    if out is None:
        _write(content)
    else:
        with written(out):
            replace_bytes(out, content)
    for note in notes:
        say(note, err=True)
    return 0


def _write(content: bytes) -> None:
    """Writes to standard output, where a reader that goes away is no fault."""
    try:
        sys.stdout.buffer.write(content)
        sys.stdout.flush()
    except BrokenPipeError:
        to_nowhere(sys.stdout)
