"""The command in a process of its own, for what can only be done to a process, and in this one for all else."""

import io
import os
import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from harness.cli.app import main

ROOT = Path(__file__).parents[2]
FOREST = ROOT / "scenarios" / "aerosonde_forest.yaml"
TIMEOUT_S = 120.0
PIPES = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
PROGRESS = re.compile(r"^wayproof: (starting up|\d+ s flown, .*|\d+ of \d+.*)\n", re.MULTILINE)
"""Lines that come every ten seconds, where the machine is slow."""
CAMPAIGN_FILES = {
    "campaign.yaml": """\
schema: wayproof/campaign/1
name: short
seed: 5
scenarios: [short.yaml]
grid: {environment.wind.speed_mps: [0, 3, 6]}
recordings: all
""",
    "short.yaml": """\
schema: wayproof/scenario/1
name: short
area: {bounds_m: [0, 0, 2000, 2000]}
obstacles: [{circle: {center_m: [1000, 1000], radius_m: 100}}]
mission: {start_m: [500, 500], goal_m: [1500, 1500], goal_radius_m: 60}
sensor: {range_m: 900, rays: 360}
planner: {clearance_m: 40}
""",
}
"""A campaign of three short runs."""
KIND_OF = """
def kind_of(planner):
    from planner.registry import PlannerKind
    from planner.rolling_window.config import RollingWindowConfig

    return PlannerKind(planner.__name__.lower(), "for a test", RollingWindowConfig, planner)


"""


def start(folder: Path, *arguments: str, file_bytes: int | None = None, **keys: Any) -> subprocess.Popen[str]:
    """Starts the command in a folder; no file may become larger than some bytes. `keys` are those of `Popen`."""

    def limit() -> None:
        if file_bytes is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (file_bytes, file_bytes))

    usual: dict[str, Any] = {
        "env": {**os.environ, "PYTHONPATH": str(ROOT)},
        "stdin": subprocess.DEVNULL,
        **PIPES,
    }
    return subprocess.Popen(
        [sys.executable, "-m", "harness", *arguments],
        cwd=folder,
        preexec_fn=limit if file_bytes is not None else None,
        text=True,
        **usual | keys,
    )


def run(folder: Path, *arguments: str, **keys: Any) -> tuple[int, str, str]:
    """Exit status, standard output and standard error of a command."""
    process = start(folder, *arguments, **keys)
    try:
        out, err = process.communicate(timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise
    return process.returncode, out, PROGRESS.sub("", err)


def run_here(folder: Path, *arguments: str) -> tuple[int, str, str]:
    """The same of the command in this process, which has all imported: it takes half as long."""
    with chdir(folder), redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err:
        status = main(arguments)
    return status, out.getvalue(), err.getvalue()


def wait_until(true: Callable[[], bool], process: subprocess.Popen[str] | None = None) -> None:
    """Waits until something is so; fails if that takes too long, or a process ends before."""
    until = time.monotonic() + TIMEOUT_S
    while not true():
        assert process is None or process.poll() is None, process.communicate()[1]
        assert time.monotonic() < until, "too long"
        time.sleep(0.005)


def distribution(site: Path, name: str, source: str, *kinds: str, version: str = "1.0") -> Path:
    """Writes a distribution of one module into a folder: kinds of planners, of classes with the same names."""
    info = site / f"{name}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    points = "".join(f"{kind} = {name}:{kind.upper()}\n" for kind in kinds)
    (info / "entry_points.txt").write_text(f"[wayproof.planners]\n{points}")
    made = "".join(f"{kind.upper()} = kind_of({kind.capitalize()})\n" for kind in kinds)
    (site / f"{name}.py").write_text(source + KIND_OF + made)
    return site
