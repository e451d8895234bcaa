"""A campaign in rerun: thin recordings with typed properties, served as one table of runs."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from rerun.experimental import ViewerClient

from harness.analysis.metrics import metrics
from harness.campaign.results import recordings_of
from harness.flight.record import Flight, Outcome
from harness.recording.catalog import catalog, common_frame
from harness.recording.layout import _titles
from harness.recording.log import RerunLog
from harness.recording.overlay import chunks_of, properties_of
from harness.recording.properties import run_properties
from harness.recording.viewer import NO_DRIVER, VIEWER_LOG, ViewerError, free_port, viewer_process
from tests.faults.command import wait_until
from tests.harness.conftest import plan as make_plan
from tests.harness.conftest import track as make_track
from tests.harness.recording.test_rerun_log import LIMITS, SCENE, column, read, seconds
from tests.pictures import draw_settled
from tests.refusals import refused
from tests.scenarios import scenario_of

SCENARIO = """\
schema: wayproof/scenario/1
name: straight
area: {bounds_m: [-2000, -1000, 2000, 3000]}
mission: {start_m: [0, 0], goal_m: [0, 2500]}
planner: {clearance_m: 100}
environment: {wind: {speed_mps: 4, from_deg: 270}}
"""


def flight(outcome: Outcome, clearance_m: float) -> Flight:
    """100 s north."""
    track = make_track(1001, clearance_m=np.linspace(500.0, clearance_m, 1001))
    return Flight(track, (make_plan([(0, 0, 0, 1, 0.0, 2500.0)]),), outcome, "as it was", (2.5,), 100.0, 0.1)


def record(folder: Path, number: int, flown: Flight) -> dict[str, Any]:
    """The thin recording of a run of a campaign; returns the properties it was given."""
    path = folder / "runs" / str(number) / "flight.rrd"
    path.parent.mkdir(parents=True)
    figures = metrics(flown, LIMITS)
    log = RerunLog(path, SCENE, f"run {number}", thin=True)
    for plan in flown.plans:
        log.on_plan(plan, None)  # type: ignore[arg-type]
    log.on_block(flown.track)
    log.on_event(100.0, "over")
    given = run_properties(scenario_of(SCENARIO), figures)
    log.close(figures, given, {"environment.wind.speed_mps": 4.0 + number})
    return given


@pytest.mark.parametrize(
    ("wanted_m", "outcome", "whole"), [(0, "REACHED", 0), (300, "REACHED", 1), (0, "COLLISION", 8)]
)
def test_without_a_wanted_clearance_none_is_too_near(wanted_m: float, outcome: str, whole: int) -> None:
    """The figures before the point are those of the README of campaigns."""
    scenario = scenario_of(SCENARIO).with_({"planner.clearance_m": wanted_m})
    given = run_properties(scenario, metrics(flight(Outcome[outcome], 250.0), LIMITS))
    assert (int(float(given["severity"])), given["planner"]) == (whole, "rolling_window")
    checked = {**metrics(flight(Outcome[outcome], 250.0), LIMITS), "check": {}}
    assert run_properties(scenario, checked)["planner"] == "path as given", "no planner has flown"


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    """Three runs; the second hit something, the third was close."""
    for number, (outcome, clearance_m) in enumerate(
        [(Outcome.REACHED, 250.0), (Outcome.COLLISION, -3.0), (Outcome.REACHED, 120.0)]
    ):
        record(tmp_path, number, flight(outcome, clearance_m))
    return tmp_path


def test_the_clearance_of_one_run_is_not_called_that_of_others() -> None:
    whole = {"property:frame:bounds_m": [[0.0] * 4] * 2, "property:frame:altitude_m": [[300.0]] * 2}
    frame = common_frame(pa.table({**whole, "property:frame:clearance_m": [[60.0], [200.0]]}))
    assert (frame.clearance_m, _titles(frame, (), False)["clearance"]) == (200.0, "Clearance, m; red: wanted")


def test_a_thin_recording_is_small_and_has_typed_properties(tmp_path: Path) -> None:
    given = record(tmp_path, 7, flight(Outcome.TIMEOUT, 90.0))
    (path,) = recordings_of(tmp_path)
    assert path.stat().st_size < 325_000
    kept = {name: value for name, (value,) in properties_of(chunks_of(path))["run"].items()}
    assert kept == pytest.approx(given)
    kinds = {name: type(value) for name, value in kept.items()}
    assert kinds["outcome"] is str
    assert kinds["trackable"] is bool
    assert kinds["replans"] is int
    assert kinds["min_clearance_m"] is float
    assert given["clearance_ratio"] == pytest.approx(0.9)
    assert given["wind_mps"] == 4.0


def test_a_thin_recording_shows_the_whole_track(campaign: Path) -> None:
    entities = read(recordings_of(campaign)[0])
    assert len(column(entities, "/world/aircraft", "translation")) >= 1001 // 20 + 1
    ((line,), (flat,)) = (np.array(column(entities, f"/{view}/whole_track", "strips")[0]) for view in ("world", "plan"))
    assert len(line) == 1001 // 20 + 1
    assert line[[0, -1]].tolist() == [[0.0, 0.0, 300.0], [0.0, 2500.0, 300.0]]
    np.testing.assert_array_equal(line[:, :2], flat)
    drawn = {"/plan/chosen", "/plan/waypoints", "/plan/outlines", "/world/true_obstacles/circles"}
    assert {*drawn, "/summary", "/events"} <= entities.keys()


def test_the_plots_of_a_thin_recording_have_the_peaks_that_its_figures_name(tmp_path: Path) -> None:
    """Peaks of a tenth of a second, between the rows that are kept of the track."""
    cross_track_m, clearance_m, bank_deg = np.zeros(1001), np.full(1001, 250.0), np.zeros(1001)
    cross_track_m[[0, 1]] = np.nan
    cross_track_m[507], clearance_m[613], bank_deg[999] = -2.5, 37.5, -45.0
    track = make_track(1001, cross_track_m=cross_track_m, clearance_m=clearance_m, roll_deg=bank_deg)
    record(tmp_path, 0, replace(flight(Outcome.REACHED, 250.0), track=track))
    entities = read(recordings_of(tmp_path)[0])
    for name, at_s, peak in (("cross_track", 50.7, -2.5), ("clearance", 61.3, 37.5), ("bank", 99.9, -45.0)):
        entity = f"/series/{name}/flown"
        values = [cell[0] for cell in column(entities, entity, "scalars") if cell]
        assert dict(zip(np.round(seconds(entities, entity), 3), values, strict=True))[at_s] == peak
    assert len(column(entities, "/series/clearance/flown", "scalars")) <= 1001 // 20 + 3


def test_a_campaign_without_recordings_says_how_to_get_some(tmp_path: Path) -> None:
    """On a machine without a screen too, before it says what it would open."""
    (tmp_path / "campaign.json").write_text("{}")
    for arguments in ([str(tmp_path)], [str(tmp_path), "--web"]):
        said = refused("view", *arguments)
        assert said.startswith(f"wayproof: {tmp_path} has no recordings: `recordings: thin` in the campaign's file ")
        assert len(said.splitlines()) == 1
    for run in ("7", "07"):
        said = refused("view", tmp_path / "runs" / run)
        assert f"`wayproof fly --from {tmp_path}/results.parquet --run 7` flies the run again" in said
    assert "no such folder; give a run folder" in refused("view", tmp_path / "runs" / "none")


def test_a_campaign_is_one_table_worst_first(campaign: Path) -> None:
    pytest.importorskip("datafusion")
    with catalog("small", recordings_of(campaign)) as (url, dataset):
        assert url.startswith("rerun+http://127.0.0.1:")
        table = dataset.segment_table().to_arrow_table().to_pydict()
    worst_first = sorted(range(3), key=lambda row: -table["property:run:severity"][row][0])
    assert [table["rerun_segment_id"][row] for row in worst_first] == ["run 1", "run 2", "run 0"]
    outcomes = [table["property:run:outcome"][row] for row in worst_first]
    assert outcomes == [["collision"], ["reached"], ["reached"]]
    assert [table["property:run:min_clearance_m"][row] for row in worst_first] == [[-3.0], [120.0], [250.0]]
    varied = next(name for name in table if name.startswith("property:varied:"))
    assert [table[varied][row] for row in worst_first] == [[5.0], [6.0], [4.0]]


@contextlib.contextmanager
def driven(folder: Path) -> Iterator[None]:
    """Skips the test where nothing can be drawn."""
    try:
        yield
    except (ViewerError, ConnectionError) as error:  # without a driver it may listen for a moment
        if str(error) != NO_DRIVER and "render context" not in (folder / VIEWER_LOG).read_text():
            raise
        pytest.skip(NO_DRIVER)


@pytest.mark.flights
def test_the_table_is_drawn_and_a_run_opens_in_our_layout(campaign: Path, tmp_path: Path) -> None:
    pytest.importorskip("datafusion")
    png, port = tmp_path / "table.png", free_port()
    arguments = ["--headless", "--window-size", "1600x900", "--bind", "127.0.0.1", "--port", str(port)]
    with (
        driven(tmp_path),
        catalog("small", recordings_of(campaign)) as (url, _),
        viewer_process(arguments, tmp_path, port),
    ):
        client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
        client.open(url)
        draw_settled(client, png)
        table = seen(client, lambda state: "/dataset/" in state.location).location
        client.open(f"{table}?segment_id=run%201")
        opened = seen(client, lambda state: state.views and not state.loading)
    assert png.stat().st_size > 20_000
    assert opened.active_recording.endswith(":run 1")
    shown = {view.name: view.reports for view in opened.views}
    assert {"Plan view (north up)", "3-D flight", "Events", "Summary"} <= shown.keys()
    assert "Clearance, m; red: wanted 100" in shown
    assert not any(shown.values())


def seen(client: Any, there: Callable[[Any], object]) -> Any:
    """What a viewer shows, as soon as that is there; fails where it does not come."""
    wait_until(lambda: bool(there(client.get_state())))
    return client.get_state()
