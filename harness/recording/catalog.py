"""A campaign's recordings as one table in the rerun viewer, served by rerun's own server on 127.0.0.1."""

from __future__ import annotations

import contextlib
import tempfile
import time
import webbrowser
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from harness.files.errors import RunFolderError
from harness.recording.properties import RUN, VARIED
from harness.recording.viewer import (
    LOCALHOST,
    NO_DRIVER,
    SETTLE_S,
    ViewerError,
    address_of,
    free_port,
    need_screen,
    viewer_process,
    web_viewer,
)

if TYPE_CHECKING:
    import pyarrow as pa

NEEDS_CATALOG: Final = (
    "the table of a campaign needs the extra wayproof[catalog]: pip install 'wayproof[catalog]'; without it open one "
    "run's folder"
)
COLUMNS: Final = {
    "outcome": "outcome",
    "clearance_ratio": "clearance / wanted",
    "min_clearance_m": "least clearance, m",
    "cross_track_max_m": "cross-track max, m",
    "bank_saturation_percent": "bank at limit, %",
    "trackable": "trackable",
    "causes": "causes",
    "wind_mps": "wind, m/s",
    "replans": "replans",
    "planner_max_ms": "planner max, ms",
    "flight_time_s": "flight, s",
    "planner": "planner",
    "aircraft": "aircraft",
    "seed": "seed",
    "severity": "severity",
}
"""Figures of a run that the table shows, in this order, and how they are headed."""


@dataclass(frozen=True)
class Catalog:
    """A campaign's recordings, being served.

    Attributes:
        url: of the dataset: what a viewer opens.
        dataset: rerun's handle of it, for queries.
    """

    url: str
    dataset: Any

    def table(self) -> pa.Table:
        """The runs as a table, one row a recording, worst first."""
        from datafusion import col

        runs = self.dataset.segment_table()
        table: pa.Table = runs.sort(col(f'"{_figure("severity")}"').sort(ascending=False)).to_arrow_table()
        return table


@contextlib.contextmanager
def catalog(name: str, recordings: Sequence[Path]) -> Iterator[Catalog]:
    """Serves recordings as one dataset on 127.0.0.1, as long as the block lasts.

    Args:
        name: of the campaign.
        recordings: files of runs, each with an identity of its own.

    Raises:
        RunFolderError: there are none.
        ViewerError: rerun's server is not installed or does not start.
    """
    if not recordings:
        raise RunFolderError(f"{name} has no recordings; fly it with `recordings: all`, `thin` or `failures`")
    try:
        import datafusion  # noqa: F401
    except ImportError as error:
        raise ViewerError(NEEDS_CATALOG) from error
    from rerun.server import Server

    try:
        server = Server(host=LOCALHOST, datasets={name: [str(path.resolve()) for path in recordings]})
    except (RuntimeError, ValueError, OSError, ConnectionError) as error:
        raise ViewerError(f"rerun's server does not start: {error}") from error
    with server, tempfile.TemporaryDirectory(prefix="wayproof-table-") as scratch:
        dataset = server.client().get_dataset(name)
        _lay_out(dataset, Path(scratch) / "table.rbl")
        yield Catalog(f"{server.url()}/entry/{dataset.id}", dataset)


def _figure(name: str) -> str:
    return f"property:{RUN}:{name}"


def _lay_out(dataset: Any, path: Path) -> None:
    """Has the table of runs show its figures under plain headings, the worst run first."""
    import rerun.blueprint as rrb
    from rerun.blueprint.table import Column, SortBy, TableLayout

    names = [field.name for field in dataset.segment_table().schema()]
    varied = [name for name in names if name.startswith(f"property:{VARIED}:")]
    columns = [
        Column("rerun_segment_id", name="run"),
        *(Column(name, name=name.rpartition(":")[2]) for name in varied),
        *(Column(_figure(name), name=label) for name, label in COLUMNS.items() if _figure(name) in names),
    ]
    shown = {column.source for column in columns}
    hidden = [Column(name, visible=False) for name in names if name not in shown]
    rrb.TableBlueprint(
        table_layout=TableLayout(columns=[*columns, *hidden]),
        sort_by=SortBy(_figure("severity"), direction="descending"),
    ).save("wayproof", str(path))
    dataset.register_blueprint(path.resolve().as_uri(), segment_table=True)


def open_table(
    name: str,
    recordings: Sequence[Path],
    web: bool = False,
    tell: Callable[[str], None] = lambda address: None,
) -> None:
    """Opens the table of a campaign in the viewer and waits until it is closed.

    Args:
        name: of the campaign.
        recordings: files of its runs.
        web: in a browser instead of a window; served until interrupted.
        tell: is told the address for the browser.

    Raises:
        RunFolderError: the campaign has no recordings.
        ViewerError: there is no screen, or the viewer or the server does not start.
    """
    if not web:
        need_screen()
    with catalog(name, recordings) as served, tempfile.TemporaryDirectory(prefix="wayproof-view-") as scratch:
        if web:
            with (
                contextlib.suppress(KeyboardInterrupt),
                web_viewer(Path(scratch)) as (viewer, address, _),
            ):
                page = address_of(address, served.url)
                tell(page)
                webbrowser.open(page)
                viewer.wait()
            return
        arguments = [served.url, "--bind", LOCALHOST, "--port", str(free_port())]
        with viewer_process(arguments, Path(scratch)) as viewer:
            if viewer.wait() != 0:
                raise ViewerError(f"the viewer ended with status {viewer.returncode}")


def table_screenshot(
    name: str, recordings: Sequence[Path], png: Path, size: tuple[int, int] = (1600, 900)
) -> None:
    """Draws the table of a campaign as the viewer shows it, without a screen.

    Raises:
        ViewerError: no driver, or no server.
    """
    from rerun.experimental import ViewerClient

    port = free_port()
    arguments = ["--headless", "--bind", LOCALHOST, "--port", str(port), "--hide-welcome-screen"]
    with (
        catalog(name, recordings) as served,
        tempfile.TemporaryDirectory(prefix="wayproof-view-") as scratch,
        viewer_process([*arguments, "--window-size", f"{size[0]}x{size[1]}"], Path(scratch), port),
    ):
        try:
            client = ViewerClient.connect(f"rerun+http://{LOCALHOST}:{port}/proxy")
            client.open(served.url)
            time.sleep(2.0 * SETTLE_S)
            client.save_screenshot(str(png.resolve()))
        except ConnectionError as error:
            raise ViewerError(NO_DRIVER) from error


def properties_of(recording: Path) -> Mapping[str, Any]:
    """The typed figures of one recording; empty where it was not closed."""
    import rerun as rr

    for chunk in rr.chunk.RrdReader(str(recording)).stream():
        if str(chunk.entity_path) == f"/__properties/{RUN}":
            row = chunk.to_record_batch().to_pylist()[0]
            return {name: value[0] for name, value in row.items() if isinstance(value, list)}
    return {}
