"""Ctrl-C, SIGTERM, output that nobody takes, a full disk, two at once: one line, nothing lost."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from harness.files.errors import RunFolderError
from harness.files.folder_lock import FolderLock
from harness.run_files.run_folder import load_run
from tests.faults.command import FOREST, PROGRESS, ROOT, run, run_here, start, wait_until

FLY = ("fly", str(FOREST), "--out", "run")
SHORT = ("--set", "mission.time_limit_s=15")
LONG = ("fly", "paper_circles", "--out", "run", "--quiet")


def in_shell(folder: Path, script: str, *words: str) -> subprocess.CompletedProcess[str]:
    env, words = {**os.environ, "PYTHONPATH": str(ROOT)}, ("bash", "-c", script, "bash", *words)
    return subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True, timeout=120)


@pytest.mark.flights
@pytest.mark.parametrize(
    ("signum", "recording"),
    [(signal.SIGINT, ()), *((signum, ("--no-recording",)) for signum in (signal.SIGTERM, signal.SIGHUP))],
)
def test_a_signal_in_flight_is_said_in_a_line(
    signum: signal.Signals, recording: tuple[str, ...], tmp_path: Path
) -> None:
    process = start(tmp_path, *LONG, *recording)
    wait_until((tmp_path / "run" / "scenario.yaml").exists, process)
    time.sleep(0.5)  # while the folder is being made, an interrupt takes it away again
    process.send_signal(signum)
    out, err = process.communicate(timeout=30)
    assert (process.returncode, out) == (128 + signum, "")
    assert err == "wayproof: interrupted; the run in run is marked incomplete\n"
    with pytest.raises(RunFolderError, match="incomplete"):
        load_run(tmp_path / "run")
    assert run_here(tmp_path, *FLY, *SHORT, "--quiet")[0] == 1
    assert load_run(tmp_path / "run").metrics["outcome"] == "timeout"


@pytest.mark.flights
def test_an_interrupt_in_code_that_is_a_text_ends_with_the_same_status(tmp_path: Path) -> None:
    """Python would then end the process by SIGINT, though the interrupt was caught."""
    (tmp_path / "own.py").write_text("def own(mission):\n    exec('raise KeyboardInterrupt')\n")
    status, out, err = run(tmp_path, *FLY, "--planner", "own.py:own", "--no-recording")
    assert (status, out, err) == (130, "", "wayproof: interrupted; nothing was written\n")


SLEEPER = """
import time
from harness.scenario.kinds import planner_kinds


class Sleeper:
    # Plans forty times, and then waits for something that never comes.

    def __init__(self, mission):
        kind, self.calls = planner_kinds()["rolling_window"], 0
        self.inner = kind.make(kind.config().resolved(mission), mission)

    def plan(self, request):
        self.calls += 1
        if self.calls > 40:
            open("asleep", "w").close()
            time.sleep(3600)
        return self.inner.plan(request)
"""


@pytest.mark.flights
def test_a_flight_whose_planner_hangs_can_be_broken_off_and_leaves_what_was_flown(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(SLEEPER)
    words = ("fly", str(FOREST), "--planner", "own.py:Sleeper", "--out", "run", "--quiet", "--no-recording")
    process = start(tmp_path, *words)
    wait_until((tmp_path / "asleep").exists, process)
    process.send_signal(signal.SIGTERM)
    assert process.communicate(timeout=60) == (
        "",
        "wayproof: interrupted; the run in run is marked incomplete\n",
    )
    assert process.returncode == 143
    track = pq.read_table(tmp_path / "run" / "track.parquet")
    last_s = track["time_s"].to_numpy()[-1]
    assert last_s > 1.0
    flown_m = np.hypot(*(np.ptp(track[name]) for name in ("east_m", "north_m")))
    assert flown_m == pytest.approx(25.0 * last_s, rel=0.2)
    assert pq.read_table(tmp_path / "run" / "plans.parquet").num_rows >= 1
    with pytest.raises(RunFolderError, match=r"track\.parquet and plans\.parquet have what was flown"):
        load_run(tmp_path / "run")


@pytest.mark.flights
@pytest.mark.parametrize(
    ("shell", "told"),
    [
        ("ulimit -n 14; exec {} sweep forest_planners --workers 2 --out out",
            "raise the limit with `ulimit -n 1024`"),
        ("cd gone; rmdir ../gone; exec {} fly {forest}",
            "the working directory has been deleted: change to another"),
        ("ulimit -v 1100000; exec {} list campaigns", "lift the limit with `ulimit -v unlimited`"),
    ],
)  # fmt: skip
def test_what_the_process_may_not_have_is_told_with_its_remedy(shell: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    done = in_shell(tmp_path, shell.format(f"{sys.executable} -m harness", forest=FOREST))
    assert told in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.flights
@pytest.mark.parametrize(("signum", "send"), [(signal.SIGTERM, os.kill), (signal.SIGINT, os.killpg)])
def test_a_comparison_is_ended_with_its_flights(
    signum: signal.Signals, send: Callable[[int, int], None], tmp_path: Path
) -> None:
    """By a signal to its process, or by Ctrl-C to all of them; then none of them lives."""
    words = "compare paper_circles --planners bug2,rolling_window --out c --workers 2"
    process = start(tmp_path, *words.split(), start_new_session=True)
    runs = [tmp_path / "c" / "paper_circles" / kind / "manifest.json" for kind in ("bug2", "rolling_window")]
    wait_until(lambda: all(each.exists() for each in runs), process)
    send(process.pid, signum)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 128 + signum
    assert PROGRESS.sub("", err) == "wayproof: interrupted; the comparison in c is marked incomplete\n"
    assert json.loads((tmp_path / "c" / "comparison.json").read_text())["complete"] is False
    for each in runs:
        FolderLock(each.parent).close()
        assert json.loads(each.read_text())["complete"] is False
    asked: Callable[[], object] = partial(os.killpg, process.pid, 0)
    with pytest.raises(ProcessLookupError):
        wait_until(lambda: bool(asked()))


@pytest.mark.flights
@pytest.mark.parametrize(("size", "more"), [(60_000, "--no-recording"), (300_000, "--quiet")])
def test_a_full_disk(size: int, more: str, tmp_path: Path) -> None:
    """No file may grow beyond some bytes, which a write finds out as it would a full disk."""
    status, out, err = run(tmp_path, *FLY, "--quiet", more, file_bytes=size)
    assert (status, out) == (1, "")
    what = "track.parquet: " if more == "--no-recording" else ""
    assert err == f"wayproof: cannot write the run in run ({what}File too large); it is marked incomplete\n"
    with pytest.raises(RunFolderError, match="incomplete"):
        load_run(tmp_path / "run")
    assert run_here(tmp_path, *FLY, *SHORT, "--quiet")[0] == 1
    assert load_run(tmp_path / "run").manifest["complete"] is True


@pytest.mark.flights
def test_two_flights_into_one_folder(tmp_path: Path) -> None:
    first = start(tmp_path, *LONG)
    wait_until((tmp_path / "run" / "scenario.yaml").exists, first)
    first.send_signal(signal.SIGSTOP)  # it need not fly on meanwhile
    status, out, err = run_here(tmp_path, *FLY, *SHORT)
    assert (status, out) == (2, "")
    told = "wayproof: another wayproof is writing to run: wait until it has ended or choose another folder\n"
    assert err == told
    first.kill()
    first.communicate()
    assert run_here(tmp_path, *FLY, *SHORT, "--quiet")[0] == 1, "a killed process leaves no lock"
    assert load_run(tmp_path / "run").metrics["outcome"] == "timeout"


@pytest.mark.flights
def test_output_onto_a_full_disk(tmp_path: Path) -> None:
    with open("/dev/full", "w") as full:
        status, _, err = run(tmp_path, "schema", stdout=full)
    assert (status, err) == (1, "wayproof: [Errno 28] No space left on device: 'standard output'\n")


@pytest.mark.flights
@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_streams_that_are_closed(closed: str, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "harness", *FLY, *SHORT, "--no-recording"]
    done = in_shell(tmp_path, f'"$@" {closed}', *words)
    assert (done.returncode, PROGRESS.sub("", done.stderr)) == (1, "")
    assert load_run(tmp_path / "run").manifest["complete"] is True
    for more in (("list", "scenarios"), ("export", "run", "--format", "kml")):
        assert in_shell(tmp_path, f'"$@" {closed}', *words[:3], *more).returncode == 0
