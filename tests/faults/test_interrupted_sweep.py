"""A campaign on a full disk, two at once, a scenario changed, standard files closed: a line, nothing lost."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from harness.run_files.run_folder import load_run
from tests.faults.command import CAMPAIGN_FILES, ROOT, run, run_here, start, wait_until

SWEEP = ("sweep", "campaign.yaml", "--out", "out", "--workers", "1", "--quiet")


@pytest.fixture
def place(tmp_path: Path) -> Path:
    for name, text in CAMPAIGN_FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("unbroken")
    for name, text in CAMPAIGN_FILES.items():
        (place / name).write_text(text)
    assert run(place, *SWEEP) == (0, "", "")
    return place / "out"


@pytest.fixture(scope="module")
def unbroken(whole: Path) -> bytes:
    return results(whole.parent)


def results(place: Path) -> bytes:
    return (place / "out" / "results.parquet").read_bytes()


@pytest.mark.flights
@pytest.mark.parametrize(
    ("size", "status", "said"),
    [
        (100, 2, "wayproof: cannot write the campaign out: campaign.json: File too large\n"),
        (4_000, 1, "--resume goes on\n"),
        (100_000, 1, "--resume goes on\n"),
    ],
    ids=["index", "journal and track", "recording"],
)
def test_a_full_disk(size: int, status: int, said: str, place: Path, unbroken: bytes) -> None:
    """No file may grow beyond some bytes, neither the command's nor those of its processes."""
    ended, out, err = run(place, *SWEEP, file_bytes=size)
    assert (ended, out) == (status, "")
    assert err.endswith(said)
    assert len(err.splitlines()) == 1
    assert "File too large" in err
    if (place / "out" / "results.parquet").exists():
        assert pq.read_table(place / "out" / "results.parquet").num_rows < 3
    assert run_here(place, *SWEEP, "--resume") == (0, "", "")
    assert results(place) == unbroken


@pytest.mark.flights
def test_two_sweeps_into_one_folder(place: Path, unbroken: bytes) -> None:
    first = start(place, *SWEEP)
    wait_until((place / "out" / "campaign.json").exists, first)
    first.send_signal(signal.SIGSTOP)  # else it may end before the others have begun
    for resume in ((), ("--resume",)):
        status, out, err = run_here(place, *SWEEP, *resume)
        assert (status, out) == (2, "")
        assert err == (
            "wayproof: another wayproof is writing to out: wait until it has ended or choose another folder\n"
        )
    assert run_here(place, "report", "out") == (
        *(2, ""),
        "out: its campaign is being flown and has no tables yet; ask again in a minute, or when it has ended\n",
    )
    first.send_signal(signal.SIGCONT)
    assert first.communicate(timeout=60) == ("", "")
    assert first.returncode == 0
    assert results(place) == unbroken


@pytest.mark.flights
def test_a_scenario_changed_and_deleted_in_mid_campaign(place: Path, unbroken: bytes) -> None:
    scenario = place / "short.yaml"
    process = start(place, *SWEEP)
    wait_until((place / "out" / "campaign.json").exists, process)
    scenario.write_text(CAMPAIGN_FILES["short.yaml"].replace("rays: 360", "rays: 720"))
    wait_until((place / "out" / "runs" / "1").exists, process)
    process.kill()
    process.communicate(timeout=60)
    journal = (place / "out" / "journal.jsonl").read_bytes()
    status, _, err = run_here(place, *SWEEP, "--resume")
    assert status == 2
    assert "scenarios[0].keys.sensor.rays was 360, is 720" in err
    scenario.unlink()
    assert run_here(place, *SWEEP, "--resume")[0] == 2
    assert (place / "out" / "journal.jsonl").read_bytes() == journal, "nothing lost"
    assert (
        load_run(place / "out" / "runs" / "0").metrics["digest"] == json.loads(journal.splitlines()[0])["row"]["digest"]
    )
    scenario.write_text(CAMPAIGN_FILES["short.yaml"])
    assert run_here(place, *SWEEP, "--resume") == (0, "", "")
    assert results(place) == unbroken


@pytest.mark.flights
def test_a_sweep_with_closed_standard_files_flies_every_run(place: Path) -> None:
    shell = f"cd {place} && PYTHONPATH={ROOT} {sys.executable} -m harness sweep campaign.yaml --out out <&- >&- 2>&-"
    assert subprocess.run(["sh", "-c", shell], timeout=240).returncode == 0
    assert pq.read_table(place / "out" / "results.parquet")["outcome"].to_pylist() == ["reached"] * 3


INTERRUPTS = """
import os
import signal
import sys

class Finder:
    def find_spec(self, name, path=None, target=None):
        child = "--multiprocessing-fork" in sys.orig_argv
        if name == os.environ["INTERRUPT_AT"] and child == bool(os.environ["IN_CHILD"]):
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder())
"""
"""A module that Python imports when it starts: interrupts the process when it comes to import another module."""


@pytest.mark.flights
@pytest.mark.parametrize(
    ("module", "child", "status"),
    [
        ("harness.cli.app", "", 130),
        ("harness.campaign.runs", "", 130),
        ("harness.campaign.results", "yes", 0),
    ],
)
def test_an_interrupt_while_modules_are_imported_leaves_no_traceback(
    place: Path, module: str, child: str, status: int
) -> None:
    (place / "sitecustomize.py").write_text(INTERRUPTS)
    keys = {"PYTHONPATH": f"{place}:{ROOT}", "INTERRUPT_AT": module, "IN_CHILD": child}
    words = ["sweep", "campaign.yaml", "--out", "out", "--quiet", "--workers", "1"]
    status_then, _, err = run(place, *words, env={**os.environ, **keys})
    assert (status_then, "Traceback" in err) == (status, False)
