"""The command `export`: a run's path for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from harness.cli.options import bad_input


def export(
    run_dir: Annotated[Path, typer.Argument(metavar="RUN_DIR", help="A run folder.")],
    form: Annotated[
        Literal["plan", "waypoints", "geojson", "kml", "acmi"], typer.Option("--format", help="The format.")
    ],
    what: Annotated[Literal["flown", "planned"], typer.Option(help="The track, or the plans in effect.")] = (
        "flown"
    ),
    tolerance_m: Annotated[
        float,
        typer.Option(metavar="T", min=0.0, help="Points nearer to the path, seen from above, are left out."),
    ] = 0.25,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Default: standard output.")] = None,
) -> int:
    """Writes the flown or planned path for QGroundControl, MAVLink, maps (GeoJSON, KML) or Tacview (ACMI).

    For example: wayproof export runs/my_run --format plan --out way.plan
    """
    from harness.files.errors import RunFolderError
    from harness.files.input_file import InputError
    from harness.run_files.path_export import exported
    from harness.run_files.run_folder import WRONG_CONTENT, damaged, load_run

    try:
        text = exported(load_run(run_dir), form, what, tolerance_m)
    except InputError:
        raise
    except RunFolderError as error:
        raise bad_input(error) from error
    except WRONG_CONTENT as error:
        raise bad_input(damaged(run_dir, error)) from error
    if out is None:
        typer.echo(text, nl=False)
    else:
        out.write_text(text, encoding="utf-8", newline="\n")
    return 0
