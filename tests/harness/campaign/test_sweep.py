"""Campaigns flown: the same bytes whoever flies, crashes as rows, what is done kept, and one at a time."""

import json
import multiprocessing
import shutil
import signal
import subprocess
import time
from pathlib import Path
from statistics import fmean
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from harness.campaign.campaign_file import load_campaign
from harness.campaign.flight import Answer, Job
from harness.campaign.folder import CampaignFolder
from harness.campaign.results import METRICS, RUN, TIMES, metric_cells, read_table, sealed
from harness.campaign.runs import CampaignRuns
from harness.campaign.workers import local_workers
from harness.cli.app import main
from harness.run_files.run_folder import load_run
from tests.faults import command
from tests.faults.command import ROOT, distribution, wait_until
from tests.harness.campaign.test_campaign import runs_of
from tests.refusals import refused
from wayproof import load_scenario

SCENARIO = command.CAMPAIGN_FILES["short.yaml"]
CAMPAIGN = """\
schema: wayproof/campaign/1
name: short
seed: 5
scenarios: [short.yaml]
planners: [rolling_window, vfh_plus]
grid:
  environment.wind.speed_mps: [0, 5]
random:
  environment.wind.from_deg: {uniform: [0, 360]}
draws: 2
"""
PLUGIN = """
import os
import signal

from planner.rolling_window.planner import RollingWindow


class Dies(RollingWindow):
    def plan(self, request):
        print("a planner that talks")
        os.kill(os.getpid(), signal.SIGKILL)


class Raises(RollingWindow):
    def __init__(self, config, mission):
        raise ValueError(f"not *to* be made: {object()}")


class Leaves(RollingWindow):
    error = SystemExit(0)

    def __init__(self, config, mission):
        raise self.error


class Lacks(Leaves):
    error = FileNotFoundError(2, "no such file", "model.bin")


class Full(Leaves):
    error = OSError(28, "no space left on device")


class Panics(Leaves):
    error = GeneratorExit("a panic")
"""
KINDS = ("dies", "raises", "leaves", "lacks", "full", "panics")


def written(place: Path, campaign: str = CAMPAIGN) -> Path:
    (place / "short.yaml").write_text(SCENARIO)
    (place / "campaign.yaml").write_text(campaign)
    return place


@pytest.fixture
def place(tmp_path: Path) -> Path:
    return written(tmp_path)


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The campaign's folder, flown by one process without a break."""
    place = written(tmp_path_factory.mktemp("unbroken"))
    assert sweep(place, "--workers", "1") == 0
    return place / "out"


def sweep(place: Path, *options: str) -> int:
    return main(["sweep", str(place / "campaign.yaml"), "--out", str(place / "out"), *options])


def refuses(place: Path, *options: str) -> str:
    return refused("sweep", place / "campaign.yaml", "--out", place / "out", *options)


def rows_of(folder: Path, name: str = "results") -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = pq.read_table(folder / f"{name}.parquet").to_pylist()
    return rows


def results(folder: Path) -> bytes:
    return (folder / "results.parquet").read_bytes()


def begun(place: Path, runs: int, *options: str) -> subprocess.Popen[str]:
    """A sweep that flies on, with so many runs done."""
    flying = command.start(place, "sweep", "campaign.yaml", "--out", "out", *options)
    wait_until(lambda: journal_lines(place / "out") >= runs)
    return flying


def journal_lines(folder: Path) -> int:
    journal = folder / "journal.jsonl"
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


@pytest.mark.flights
def test_results_have_a_row_a_run_and_every_metric(unbroken: Path) -> None:
    table = pq.read_table(unbroken / "results.parquet")
    varied = ["environment.wind.speed_mps", "environment.wind.from_deg"]
    assert table.column_names == [*RUN, *varied, *METRICS]
    assert [str(table.schema.field(name).type) for name in ("run", "case", "seed", *varied)] == [
        *["int64"] * 4,
        "double",
    ]
    rows = rows_of(unbroken)
    assert [row["run"] for row in rows] == list(range(8))
    assert [row["case"] for row in rows] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert {row["outcome"] for row in rows} == {"reached"}
    assert {row["error"] for row in rows} == {None}
    for first, second in zip(rows[::2], rows[1::2], strict=True):
        assert first["seed"] == second["seed"]
        assert [first[name] for name in varied] == [second[name] for name in varied]
    assert all(row["optimum_m"] > 1300 and 0.9 < row["length_ratio"] < 2 for row in rows)
    times = rows_of(unbroken, "timings")
    assert [list(row) for row in times] == [list(TIMES)] * 8
    assert all(row["wall_s"] > 0 and row["compute_ms.max"] > 0 for row in times)


def test_columns_are_what_metrics_json_has(place: Path) -> None:
    fly = ["fly", str(place / "short.yaml"), "--out", str(place / "run"), "--no-recording"]
    assert main([*fly, "--set", "navigation.kind=rtk"]) == 0
    metrics = load_run(place / "run").metrics
    cells = metric_cells(metrics, 60.0, 1500.0)
    assert cells["navigation_error_m.max"] == metrics["navigation_error_m"]["max"] > 0.0
    assert cells.keys() | {"error"} == METRICS.keys()
    assert cells["cross_track_m.p95"] == metrics["cross_track_m"]["p95"]
    assert cells["trackability.legs"] == len(metrics["trackability"])
    assert cells["length_ratio"] == metrics["flown_length_m"] / 1500.0
    for name, value in cells.items():
        kind = {"number": float, "int": int, "bool": bool, "text": str}[METRICS[name]]
        assert value is None or type(value) is kind, name
    legs = [{"trackable": not why, "cause": why} for why in (None, "wind drift", "bank limit", "wind drift")]
    hit = metric_cells({**metrics, "outcome": "collision", "trackability": legs}, 60.0, 1500.0)
    assert (hit["trackability.legs"], hit["trackability.not_trackable"]) == (4, 3)
    assert hit["trackability.causes"] == "bank limit; wind drift"
    assert hit["length_ratio"] is None


@pytest.mark.flights
def test_a_row_is_flown_again_alone_from_the_results_alone(
    place: Path, unbroken: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    elsewhere = place / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "r.parquet").write_bytes(results(unbroken))
    monkeypatch.chdir(elsewhere)
    words = ["--from", "r.parquet", "--run", "6", "--out", "run", "--no-recording", "--quiet"]
    assert main(["fly", *words]) == 0
    row = rows_of(unbroken)[6]
    assert load_run(elsewhere / "run").metrics["digest"] == row["digest"]
    assert load_scenario(elsewhere / "run" / "scenario.yaml").seed == row["seed"]
    assert capsys.readouterr().err == ""
    for arguments, said in (
        (["--from", "r.parquet", "--run", "8"], "has no run 8; must be 0 to 7"),
        (["--from", "r.parquet"], "--from and --run go together"),
        (["paper_circles", "--from", "r.parquet", "--run", "1"], "either a SCENARIO or --from"),
        (["--from", "run/track.parquet", "--run", "1"], "is not the results.parquet of a campaign"),
        (["--from", "nowhere", "--run", "1"], "nowhere: no such file"),
    ):
        assert said in refused("fly", *arguments)
    damaged = bytearray(results(unbroken))
    damaged[300:308] = b"XXXXXXXX"
    (elsewhere / "r.parquet").write_bytes(damaged)
    said = refused("fly", "--from", "r.parquet", "--run", "1")
    assert said.startswith("r.parquet: is damaged: ")
    assert len(said.splitlines()) == 1


@pytest.mark.flights
def test_a_row_that_was_flown_otherwise_is_told(
    place: Path, unbroken: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows, about = read_table(unbroken / "results.parquet")
    changed = rows.set_column(rows.column_names.index("digest"), "digest", pa.array(["0" * 64] * len(rows)))
    pq.write_table(changed, place / "r.parquet")
    said = refused("fly", "--from", place / "r.parquet", "--run", "1")
    assert "is not as it was written: its sha256 is another" in said
    pq.write_table(sealed(changed, about), place / "r.parquet")
    again = ["fly", "--from", str(place / "r.parquet"), "--run", "1", "--out", str(place / "run"), "--quiet"]
    assert main(again) == 1
    assert f"run 1 was flown otherwise (digest {'0' * 64})" in capsys.readouterr().err
    again[2] = str(unbroken / "results.parquet")
    assert main(again[:-1]) == 0
    assert "digest: as the campaign flew it" in capsys.readouterr().out
    assert main([*again[:-1], "--seed", "5"]) == 0
    assert "as the campaign flew it" not in capsys.readouterr().out


def with_plugin(place: Path, monkeypatch: pytest.MonkeyPatch, version: str = "1.0") -> None:
    site = place / f"site-{version}"
    monkeypatch.syspath_prepend(distribution(site, "campaign_plugin", PLUGIN, *KINDS, version=version))


@pytest.mark.flights
def test_a_crash_is_a_row_with_its_traceback_but_a_killed_process_is_no_result(
    place: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    with_plugin(place, monkeypatch)
    kept = CAMPAIGN.replace("draws: 2", "draws: 1\nrecordings: all")
    text = kept.replace("[rolling_window, vfh_plus]", "[rolling_window, dies, raises]")
    (place / "campaign.yaml").write_text(text.replace("[0, 5]", "[5]"))
    told = []
    for workers in ("1", "2"):
        assert sweep(place, "--workers", workers, "--json") == 1
        told.append(results(place / "out"))
        assert {each.name for each in (place / "out" / "runs").iterdir()} == {"0"}, "whole ones only"
        shutil.rmtree(place / "out")
    assert told[0] == told[1]
    (place / "r.parquet").write_bytes(told[0])
    rows = pq.read_table(place / "r.parquet").to_pylist()
    assert [(row["run"], row["outcome"]) for row in rows] == [(0, "reached"), (2, "error")]
    raised = rows[1]
    assert raised["error"].startswith("Traceback")
    assert "campaign_plugin.py" in raised["error"]
    why = "the planner raises cannot be made: ValueError: not *to* be made: <object object at 0x...>"
    assert raised["reason"] == why
    assert raised["digest"] is None
    out, err = capfd.readouterr()
    assert json.loads(out[: len(out) // 2])["outcomes"] == {"error": 1, "reached": 1}, "output is ours"
    assert "1 run was not flown to the end (1)" in err


def after_six_runs(place: Path, unbroken: Path, torn: bytes) -> list[bytes]:
    """Makes the campaign's folder after six of its runs and a line that is no whole one; the lines of all runs."""
    out = place / "out"
    out.mkdir()
    (out / "campaign.json").write_bytes((unbroken / "campaign.json").read_bytes())
    whole = (unbroken / "journal.jsonl").read_bytes().splitlines(keepends=True)
    (out / "journal.jsonl").write_bytes(b"".join(whole[:6]) + torn)
    return whole


TORN = b'{"run": 99, "row": {"outc'


@pytest.mark.flights
def test_resume_flies_only_what_is_missing(place: Path, unbroken: Path) -> None:
    out = place / "out"
    whole = after_six_runs(place, unbroken, TORN)
    assert "holds 6 runs: go on with --resume, or choose another folder" in refuses(place)
    assert sweep(place, "--resume", "--workers", "1") == 0
    assert results(out) == results(unbroken)
    lines = (out / "journal.jsonl").read_bytes().splitlines(keepends=True)
    assert lines[:6] == whole[:6]
    assert [json.loads(line)["run"] for line in lines[6:]] == [6, 7]


@pytest.mark.flights
@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("campaign.yaml", "seed: 5", "seed: 6", "campaign.seed was 5, is 6"),
        ("campaign.yaml", "draws: 2", "draws: 1", "campaign.draws was 2, is 1"),
        ("campaign.yaml", "[0, 5]", "[0, 6]", "grid.environment.wind.speed_mps was [0, 5], is [0, 6]"),
        ("short.yaml", ", rays: 360", "", "scenarios[0].keys.sensor.rays was 360, is not there"),
    ],
)
def test_resume_refuses_a_changed_campaign_and_says_what_changed(
    place: Path, unbroken: Path, file: str, old: str, new: str, said: str
) -> None:
    out = place / "out"
    out.mkdir()
    for name in ("campaign.json", "journal.jsonl", "results.parquet"):
        (out / name).write_bytes((unbroken / name).read_bytes())
    changed = (place / file).read_text().replace(old, new)
    assert changed != (place / file).read_text()
    (place / file).write_text(changed)
    assert said in refuses(place, "--resume")
    assert results(out) == results(unbroken), "nothing lost"
    (place / file).write_text(changed.replace(new, old) if new else SCENARIO)
    (place / file).write_text(f"# a comment is no change\n{(place / file).read_text()}")
    with CampaignFolder(out, CampaignRuns(load_campaign(place / "campaign.yaml")), resume=True) as folder:
        assert folder.finished.keys() == set(range(8))


def test_resume_refuses_an_added_null_and_another_order_of_keys(place: Path) -> None:
    """What a run flies follows from the order of grid and random keys; a null replaces what the scenario has."""
    grid = "  environment.wind.speed_mps: [0, 5]\n"
    rays, gusts = "  sensor.rays: [360, 720]\n", "environment.vertical_gusts"
    two = CAMPAIGN.replace(grid, grid + rays).replace("seed: 5\n", "seed: 5\nset: {sensor.dropout: 0}\n")
    with CampaignFolder(place / "out", runs_of(place, two), resume=False) as folder:
        folder.append(Answer(0, {"outcome": "reached"}, {}))
    order = 'order.grid was ["environment.wind.speed_mps", "sensor.rays"], is ["sensor.rays"'
    for other, said in (
        (two.replace(grid + rays, rays + grid), order),
        (two.replace(": 0}", f": 0, {gusts}: null}}"), f"campaign.set.{gusts} was not there, is null"),
    ):
        (place / "campaign.yaml").write_text(other)
        assert said in refuses(place, "--resume")


def test_resume_refuses_another_aircraft_planner_or_version(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "aircraft" / "aerosonde", place / "mine")
    with_plugin(place, monkeypatch)
    text = CAMPAIGN.replace("[rolling_window, vfh_plus]", "[rolling_window, leaves]\naircraft: [./mine]")
    with CampaignFolder(place / "out", runs_of(place, text), resume=False) as folder:
        folder.append(Answer(0, {"outcome": "reached"}, {}))
    model = place / "mine" / "aerosonde.xml"
    model.write_text(model.read_text() + "<!-- other -->\n")
    assert "aircraft." in refuses(place, "--resume")
    model.write_text(model.read_text().removesuffix("<!-- other -->\n"))
    with_plugin(place, monkeypatch, "2.0")
    assert 'planners.leaves was "campaign_plugin 1.0", is "campaign_plugin 2.0"' in refuses(place, "--resume")
    index = json.loads((place / "out" / "campaign.json").read_text())
    index["versions"]["jsbsim"] = "1.0.0"
    (place / "out" / "campaign.json").write_text(json.dumps(index))
    assert 'versions.jsbsim was "1.0.0", is' in refuses(place, "--resume")


@pytest.mark.flights
def test_a_planner_that_cannot_be_made_is_a_row_whatever_it_raises(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_plugin(place, monkeypatch)
    text = CAMPAIGN.replace("[rolling_window, vfh_plus]", "[leaves, lacks, full, panics, rolling_window]")
    (place / "campaign.yaml").write_text(text.replace("draws: 2", "draws: 1").replace("[0, 5]", "[5]"))
    assert sweep(place, "--workers", "1", "--quiet") == 1
    rows = rows_of(place / "out")
    assert [row["outcome"] for row in rows] == [*["error"] * 4, "reached"]
    why = ("SystemExit: 0", "FileNotFoundError: [Errno 2]", "OSError: [Errno 28]", "GeneratorExit: a panic")
    for row, told in zip(rows[:4], why, strict=True):
        assert f"cannot be made: {told}" in row["reason"]
        assert told.split(":")[0] in row["error"]
    said = refused("fly", place / "short.yaml", "--planner", "lacks", "--out", place / "run")
    assert "wayproof: the planner lacks cannot be made: FileNotFoundError" in said
    assert not (place / "run").exists()


def test_a_folder_that_holds_other_things_is_refused(place: Path) -> None:
    (place / "out").mkdir()
    (place / "out" / "thesis.tex").write_text("years of work")
    (place / "out" / "campaign.json").write_text("[]")
    assert "is not empty and not a campaign" in refuses(place)
    assert sorted(each.name for each in (place / "out").iterdir()) == ["campaign.json", "thesis.tex"]
    shutil.rmtree(place / "out")
    (place / "out").write_text("a file")
    assert "is a file" in refuses(place)


@pytest.mark.flights
def test_an_interrupt_keeps_what_is_done_and_says_how_to_go_on(place: Path) -> None:
    (place / "campaign.yaml").write_text(CAMPAIGN.replace("draws: 2", "draws: 3"))  # something to break off
    out, flying = place / "out", begun(place, 3, "--workers", "2")
    flying.send_signal(signal.SIGINT)
    told, said = flying.communicate(timeout=30)
    assert flying.returncode == 130
    assert said.splitlines()[-1] == "wayproof: interrupted; what is done is in out, --resume goes on"
    assert told == ""
    assert 3 <= len(rows_of(out)) == journal_lines(out) < 12
    assert sweep(place, "--resume", "--workers", "2") == 0
    assert [row["run"] for row in rows_of(out)] == list(range(12))


@pytest.mark.flights
def test_a_kill_leaves_no_lock_no_process_and_nothing_lost(place: Path, unbroken: Path) -> None:
    import psutil

    out, flying = place / "out", begun(place, 2, "--workers", "2")
    children = psutil.Process(flying.pid).children(recursive=True)
    flying.kill()
    flying.communicate(timeout=30)
    _, alive = psutil.wait_procs(children, timeout=10)
    assert alive == []
    assert journal_lines(out) >= 2
    assert sweep(place, "--resume", "--workers", "2", "--json") == 0
    assert results(out) == results(unbroken)


@pytest.mark.flights
def test_a_worker_killed_in_mid_run_costs_nothing(place: Path, unbroken: Path) -> None:
    import psutil

    out, flying = place / "out", begun(place, 2, "--workers", "2")
    children = psutil.Process(flying.pid).children()
    workers = [child for child in children if "spawn_main" in " ".join(child.cmdline())]
    assert len(workers) == 2
    workers[0].kill()
    assert flying.wait(timeout=120) == 0
    flying.communicate()
    assert results(out) == results(unbroken)


@pytest.mark.flights
def test_a_worker_killed_between_runs_is_replaced(place: Path) -> None:
    job = Job(0, runs_of(place, CAMPAIGN).packed(0), place / "run", "none", optimum=False)
    rows = []
    with local_workers(1, 1) as workers:
        for begun in (1, 2):
            for _ in range(begun):
                workers.start(job)
            assert workers.free() == 2 - begun, "one flies and one waits"
            while workers.free() < 2:
                rows += [answer.row for _, answer in workers.collect(0.1) if answer]
            for child in multiprocessing.active_children():
                child.kill()
                child.join()
            time.sleep(0.5)
    assert len(rows) == 3
    assert rows[0] == rows[1] == rows[2]
    wait_until(lambda: multiprocessing.active_children() == [])


@pytest.mark.flights
@pytest.mark.parametrize(("which", "kept"), [("all", {0, 1}), ("failures", {1}), ("none", set())])
def test_recordings_are_kept_of_all_of_failures_or_of_none(place: Path, which: str, kept: set[int]) -> None:
    once = CAMPAIGN.replace("draws: 2", "draws: 1")
    text = once.replace("[rolling_window, vfh_plus]", "[{kind: rolling_window}]")
    # In the second case there is no time to get there.
    text = text.replace("  environment.wind.speed_mps: [0, 5]", "  mission.time_limit_s: [900, 5]")
    (place / "campaign.yaml").write_text(f"{text}recordings: {which}\noptimum: false\n")
    assert sweep(place, "--workers", "1") == 0
    rows = rows_of(place / "out")
    assert {(row["optimum_m"], row["length_ratio"]) for row in rows} == {(None, None)}
    assert [row["outcome"] for row in rows] == ["reached", "timeout"], "no failure of the sweep"
    folders = {int(path.name): path for path in (place / "out").glob("runs/*")}
    assert set(folders) == kept
    for number, folder in folders.items():
        assert load_run(folder).metrics["digest"] == rows[number]["digest"]
        assert (folder / "flight.rrd").stat().st_size > 10_000


@pytest.mark.slow
def test_a_worker_does_not_grow(place: Path) -> None:
    """Means of twenty: the first flights fill caches and the heap. A leak of half a track a flight would show."""
    import psutil

    runs, used_mib, threads = runs_of(place, CAMPAIGN.replace("draws: 2", "draws: 128")), [], []
    with local_workers(1, 1) as workers:
        for number in range(len(runs)):
            workers.start(Job(number, runs.packed(number), place / "run", "none", optimum=True))
            while not (ended := workers.collect(0.1)):
                pass
            assert [answer and answer.row["outcome"] for _, answer in ended] == ["reached"]
            (child,) = multiprocessing.active_children()
            process = psutil.Process(child.pid)
            used_mib.append(process.memory_info().rss / 2**20)
            threads.append(process.num_threads())
    assert fmean(used_mib[-20:]) - fmean(used_mib[24:44]) < 10.0
    assert threads[-1] <= threads[24]
