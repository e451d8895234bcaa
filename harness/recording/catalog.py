"""A campaign's recordings as one table in the rerun viewer, served by rerun's own server on 127.0.0.1."""

from __future__ import annotations

import contextlib
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from harness.analysis.registry import METRICS
from harness.recording.blueprint import FRAME, Frame
from harness.recording.layout import layout_of
from harness.recording.properties import RUN, VARIED
from harness.recording.viewer import LOCALHOST, ViewerError, empty_viewer, wait_for

if TYPE_CHECKING:
    import pyarrow as pa

NEEDS_CATALOG: Final = (
    "the table of a campaign needs the extra wayproof[catalog]: pip install 'wayproof[catalog]'; without it open one "
    "run's folder"
)
COLUMNS: Final = {
    "outcome": "outcome",
    "severity": "severity",
    "clearance_ratio": "clearance/wanted",
    **{metric.recorded_as: metric.heading for metric in METRICS if metric.heading},
    **{name: name for name in ("planner", "aircraft", "seed")},
    "wind_mps": "wind, m/s",
}
"""Figures of a run that the table shows, in this order, with their headings.
A browser cuts a heading that is longer than the name of its figure by more than a letter."""
LEADING_COLUMNS: Final = 3
"""Number of columns before the varied keys, of which more may be varied than fit a window."""
ENDING_S: Final = 2.0  # the server is given this time to end


@contextlib.contextmanager
def catalog(name: str, recordings: Sequence[Path]) -> Iterator[tuple[str, Any]]:
    """Serves recordings as one dataset on 127.0.0.1 for the length of the block; reading a thousand takes seconds.

    Gives the address that a viewer opens, and rerun's handle of the dataset. A ViewerError says that rerun's server is
    not installed or does not start.
    """
    try:
        import datafusion  # noqa: F401
    except ImportError as error:
        raise ViewerError(NEEDS_CATALOG) from error
    from rerun.server import Server

    try:
        server = Server(host=LOCALHOST, datasets={name: [str(path.resolve()) for path in recordings]})
    except (RuntimeError, ValueError, OSError, ConnectionError) as error:
        raise ViewerError(f"rerun's server does not start: {error}") from error
    try:
        with tempfile.TemporaryDirectory(prefix="wayproof-table-") as scratch:
            dataset = server.client().get_dataset(name)
            _lay_out(dataset, Path(scratch))
            yield f"{server.url()}/entry/{dataset.id}", dataset
    finally:  # without waiting for clients that are still connected
        ender = threading.Thread(target=server.shutdown, name="server", daemon=True)
        ender.start()
        ender.join(ENDING_S)


def _figure(name: str) -> str:
    return f"property:{RUN}:{name}"


def _lay_out(dataset: Any, scratch: Path) -> None:
    """Lays out the table of runs, the worst run first under plain headings, and each run as our recordings are."""
    import rerun.blueprint as rrb
    from rerun.blueprint.table import Column, SortBy, TableLayout

    runs = dataset.segment_table().to_arrow_table()
    names = runs.column_names
    figures = [Column(_figure(name), name=label) for name, label in COLUMNS.items() if _figure(name) in names]
    keys = [name for name in names if name.startswith(f"property:{VARIED}:")]
    varied = [Column(name, name=name.rpartition(":")[2]) for name in keys]
    columns = [Column("rerun_segment_id", name="run"), *figures[:LEADING_COLUMNS], *varied]
    columns += figures[LEADING_COLUMNS:]
    shown = {column.source for column in columns}
    hidden = [Column(name, visible=False) for name in names if name not in shown]
    rrb.TableBlueprint(
        table_layout=TableLayout(columns=[*columns, *hidden]),
        sort_by=SortBy(_figure("severity"), direction="descending"),
    ).save("wayproof", str(scratch / "table.rbl"))
    dataset.register_blueprint((scratch / "table.rbl").resolve().as_uri(), segment_table=True)
    if f"property:{FRAME}:bounds_m" in names:
        # A viewer does not take the layout inside a recording that is one of a dataset.
        entities = {str(each.entity_path) for each in dataset.schema().component_columns()}
        layout = layout_of(common_frame(runs), entities)
        layout.save("wayproof", str(scratch / "run.rbl"))
        layout.close()
        dataset.register_blueprint((scratch / "run.rbl").resolve().as_uri())


def common_frame(runs: pa.Table) -> Frame:
    """Returns an area that holds those of all recordings in a table; unfinished ones have none."""
    names = ("bounds_m", "altitude_m", "clearance_m")
    columns = (runs[f"property:{FRAME}:{name}"].to_pylist() for name in names)
    bounds_m, altitudes_m, clearances_m = ([each for each in cells if each] for cells in columns)
    west, south, east, north = zip(*bounds_m, strict=True)
    whole_m, alike = (min(west), min(south), max(east), max(north)), max(clearances_m) == min(clearances_m)
    return Frame(whole_m, max(altitudes_m)[0], max(clearances_m)[0], clearances_alike=alike)


def open_table(name: str, recordings: Sequence[Path], web: bool, report: Callable[[str], None]) -> None:
    """Opens the table of a campaign in the viewer and waits until it is closed.

    `report` gets the address for a browser. A ViewerError says that there is no screen, or what does not start.
    """
    with catalog(name, recordings) as (url, _), empty_viewer(web, report, url) as (viewer, source):
        if not web:
            from rerun.experimental import ViewerClient

            ViewerClient.connect(source).open(url)
        wait_for(viewer)
