"""kill -9 at any moment: what is left is complete, or says that it is not, and flying again mends it."""

from __future__ import annotations

import random
import shutil
import time
from dataclasses import dataclass
from pathlib import Path

import pytest
import rerun as rr

from harness.record import RunFolderError, digest
from harness.run_folder import load_run
from tests.faults.command import FOREST, run, start

KILLS = [3, pytest.param(50, marks=pytest.mark.slow)]


@dataclass(frozen=True)
class Command:
    """A command that is killed.

    Attributes:
        begin: its arguments.
        again: those that finish what a killed one began.
        runs: the run folders that it writes, below its own folder.
    """

    begin: tuple[str, ...]
    again: tuple[str, ...]
    runs: tuple[str, ...]


FLY = ("fly", str(FOREST), "--set", "mission.time_limit_s=60", "--out", "run", "--quiet")
COMMANDS = {"fly": Command(FLY, FLY, ("run",))}
"""`sweep`, for one, is another entry: begun, and begun again with `--resume`."""


def digests(folder: Path, command: Command) -> list[str]:
    """Of whole runs: every file can be read, and the track is what its digest says."""
    found = []
    for name in command.runs:
        read = load_run(folder / name)
        assert digest(read.track) == read.metrics["digest"]
        chunks = rr.chunk.RrdReader(folder / name / "flight.rrd").stream().to_chunks()
        assert any(chunk.entity_path == "/__properties/metrics" for chunk in chunks)
        assert not list((folder / name).glob("*.partial"))
        found.append(read.metrics["digest"])
    return found


def is_marked_incomplete(folder: Path) -> bool:
    """Whether a run folder cannot be taken for a complete one; no folder at all is that too."""
    try:
        load_run(folder)
    except RunFolderError as error:
        return "incomplete" in str(error) or "not a run folder" in str(error)
    return False


@pytest.mark.parametrize("kills", KILLS)
@pytest.mark.parametrize("name", COMMANDS)
def test_killed_at_any_moment(name: str, kills: int, tmp_path: Path) -> None:
    command = COMMANDS[name]
    folder = tmp_path / "unbroken"
    folder.mkdir()
    begun = time.monotonic()
    status, _, err = run(folder, *command.begin)
    lasts_s = time.monotonic() - begun
    assert (status, err) == (1, "")
    unbroken = digests(folder, command)
    moments = random.Random(7)
    killed = whole = 0
    for number in range(kills):
        folder = tmp_path / "killed"
        folder.mkdir()
        process = start(folder, *command.begin)
        # A quarter of them in the last tenth, where everything is written at once.
        share = moments.uniform(0.85, 1.02) if number % 4 == 0 else moments.uniform(0.0, 1.0)
        time.sleep(share * lasts_s)
        process.kill()
        killed += process.wait() == -9
        process.communicate()
        complete = [not is_marked_incomplete(folder / each) for each in command.runs]
        if all(complete):
            whole += 1
            assert digests(folder, command) == unbroken
        assert run(folder, *command.again)[0] == 1
        assert digests(folder, command) == unbroken
        shutil.rmtree(folder)
    assert killed >= kills // 2
    assert whole < kills
