"""Python in a process of its own, which finds the packages of this project."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
FRONT_DOOR = ROOT / "harness" / "front_door"


def python(
    *words: str,
    folder: Path = ROOT,
    path: tuple[Path, ...] = (ROOT, FRONT_DOOR),
    check: bool = False,
    environment: dict[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:
    """Runs Python with some words in a folder; it finds packages in `path`, and may take ten minutes."""
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path))} | (environment or {}),
        capture_output=True,
        text=True,
        timeout=600,
        check=check,
    )
