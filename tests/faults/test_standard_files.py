"""A sweep whose standard files are closed, or that is interrupted early, loses nothing and says no traceback."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from tests.faults.command import CAMPAIGN_FILES, ROOT


@pytest.fixture
def place(tmp_path: Path) -> Path:
    for name, text in CAMPAIGN_FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


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
    done = subprocess.run(
        [sys.executable, "-m", "harness", *words],
        cwd=place,
        env={**os.environ, **keys},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert (done.returncode, "Traceback" in done.stderr) == (status, False)
