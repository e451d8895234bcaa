"""kill -9 at any moment: what is left is complete, or says that it is not, and flying again mends it."""

import json
import os
import random
import shutil
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import psutil
import pyarrow.parquet as pq
import pytest
import rerun as rr

from harness.files.errors import RunFolderError
from harness.flight.record import digest
from harness.run_files.run_folder import load_run
from tests.faults.command import CAMPAIGN_FILES, FOREST, run, run_here, start
from tests.longer import longer

KILLED = [
    *longer([("fly", 2), ("sweep of one process", 2)]),
    *(pytest.param(name, 50, marks=pytest.mark.slow) for name in ("fly", "sweep")),
]
"""What is killed, and how often."""
ORPHANS_LIVE_S = 20.0
"""How long processes of a killed command may live on: one that has just been started imports everything before it sees
that nobody waits for it, which takes its time on a busy machine."""


@dataclass(frozen=True)
class Command:
    begin: tuple[str, ...]
    again: tuple[str, ...]  # the arguments that finish what a killed one began
    status: int
    files: dict[str, str]  # what must be there before, text by name
    claims: Callable[[Path], bool]  # whether what is in a folder says that it is complete
    kept: Callable[[Path], object]  # what has to be the same in every complete folder; reads all of it


def run_digest(folder: Path) -> str:
    """Of a whole run: every file can be read, and the track is what its digest says."""
    read = load_run(folder)
    assert digest(read.track) == read.metrics["digest"]
    chunks = rr.chunk.RrdReader(folder / "flight.rrd").stream().to_chunks()
    assert any(chunk.entity_path == "/__properties/metrics" for chunk in chunks)
    return str(read.metrics["digest"])


def run_claims(folder: Path) -> bool:
    """Whether a run folder can be taken for a complete one; no folder at all cannot."""
    try:
        load_run(folder)
    except RunFolderError as error:
        return not any(word in str(error) for word in ("is incomplete", "is not a run folder", "no such folder"))
    return True


def results(folder: Path) -> bytes:
    """The results of a whole campaign, every run of which has a whole folder that agrees with its row."""
    rows = pq.read_table(folder / "results.parquet").to_pylist()
    assert [run_digest(folder / "runs" / str(row["run"])) for row in rows] == [row["digest"] for row in rows]
    return (folder / "results.parquet").read_bytes()


def results_claim(folder: Path) -> bool:
    """Whether results can be taken for all of them; what rows and lines there are must be whole runs."""
    journal = folder / "journal.jsonl"
    lines = journal.read_bytes().split(b"\n")[:-1] if journal.exists() else []
    flown = {line["run"]: line["row"]["digest"] for line in map(json.loads, lines)}
    for number, flown_digest in flown.items():
        assert run_digest(folder / "runs" / str(number)) == flown_digest
    if not (folder / "results.parquet").exists():
        return False
    table = pq.read_table(folder / "results.parquet")
    assert {row["run"]: row["digest"] for row in table.to_pylist()}.items() <= flown.items()
    return bool(table.num_rows == 3)


FLY = ("fly", str(FOREST), "--set", "mission.time_limit_s=60", "--out", "run", "--quiet")


def sweep(workers: int) -> Command:
    begin = ("sweep", "campaign.yaml", "--out", "out", "--workers", str(workers), "--quiet")
    return Command(
        begin,
        (*begin, "--resume"),
        0,
        CAMPAIGN_FILES,
        lambda folder: results_claim(folder / "out"),
        lambda folder: results(folder / "out"),
    )


COMMANDS = {
    "fly": Command(
        FLY, FLY, 1, {}, lambda folder: run_claims(folder / "run"), lambda folder: run_digest(folder / "run")
    ),
    "sweep": sweep(2),
    "sweep of one process": sweep(1),
}


def made(folder: Path, command: Command) -> Path:
    folder.mkdir()
    for name, text in command.files.items():
        (folder / name).write_text(text)
    return folder


def names(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


def alive(group: int) -> list[int]:
    found = []
    for process in psutil.process_iter():
        try:
            if os.getpgid(process.pid) == group and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process.pid)
        except (ProcessLookupError, psutil.NoSuchProcess):
            continue  # ended meanwhile
    return found


@pytest.mark.parametrize(("name", "kills"), KILLED)
def test_killed_at_any_moment(name: str, kills: int, tmp_path: Path) -> None:
    command = COMMANDS[name]
    folder = made(tmp_path / "unbroken", command)
    begun = time.monotonic()
    status, _, err = run(folder, *command.begin)
    lasts_s = time.monotonic() - begun
    assert (status, err) == (command.status, "")
    assert command.claims(folder)
    unbroken, files = command.kept(folder), names(folder)
    moments = random.Random(7)
    killed = whole = 0
    for number in range(kills):
        folder = made(tmp_path / "killed", command)
        process = start(folder, *command.begin, start_new_session=True)
        # A quarter of them in the last tenth, where everything is written at once.
        share = moments.uniform(0.85, 1.02) if number % 4 == 0 else moments.uniform(0.0, 1.0)
        begun = time.monotonic()
        try:
            process.wait(share * lasts_s)
            lasts_s = time.monotonic() - begun  # the machine had other work when it took longer
        except subprocess.TimeoutExpired:
            process.kill()
        killed += process.wait() == -9
        until = time.monotonic() + ORPHANS_LIVE_S
        while left := alive(process.pid):
            assert time.monotonic() < until, left
            time.sleep(0.02)
        process.communicate()
        if command.claims(folder):
            whole += 1
            assert command.kept(folder) == unbroken
        status, _, err = run_here(folder, *command.again)
        assert (status, err) == (command.status, "")
        assert command.kept(folder) == unbroken
        assert names(folder) == files
        shutil.rmtree(folder)
    assert killed >= kills // 2
    assert whole < kills
