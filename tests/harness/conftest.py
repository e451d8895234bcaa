import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

from harness.cli.app import main
from harness.flight.record import AcceptedPlan, FloatArray, Track
from tests.harness.breaking import SCENARIO
from tests.page import NoBrowserError, browser
from wayproof import Path, Plan, PlanPicture, PlanStatus

Checked = Callable[..., tuple[int, Any]]


def track(rows: int, **columns: Any) -> Track:
    """A straight flight north at 25 m/s and 10 rows a second, with some columns replaced."""
    time_s = np.arange(rows) / 10.0
    level: dict[str, FloatArray | float] = {
        "time_s": time_s, "east_m": 0.0, "north_m": 25.0 * time_s, "up_m": 300.0, "course_deg": 0.0,
        "heading_deg": 0.0, "roll_deg": 0.0, "pitch_deg": 2.0, "airspeed_mps": 25.0, "groundspeed_mps": 25.0,
        "load_factor": 1.0, "roll_command_deg": 0.0, "cross_track_m": 0.0, "clearance_m": 1000.0,
        "plan_index": 0, "arc_length_m": 25.0 * time_s, "throttle": 0.5,
    }  # fmt: skip
    return Track(**{name: np.broadcast_to(value, rows) for name, value in {**level, **columns}.items()})


def plan(
    segments: Sequence[Sequence[float]],
    index: int = 0,
    time_s: float = 0.0,
    picture: Callable[[], PlanPicture] | None = None,
) -> AcceptedPlan:
    path = Path(np.array(segments, dtype=np.float64))
    return AcceptedPlan(
        index, time_s, 2.5, Plan(PlanStatus.FOUND, "a way was found", path.segments[:, :2], path, picture)
    )


STRAIGHT_PLAN = plan([(0.0, 0.0, 0.0, 1.0, 0.0, 5000.0)])
CIRCLE_PLAN = plan([(500.0, 0.0, 0.0, 1.0, 1 / 500.0, math.tau * 500.0)])


def circle_track(radius_m: float, seconds: float, speed_mps: float = 25.0) -> Track:
    """A left turn at constant speed round (0, 0), from due east of it."""
    time_s = np.arange(round(10 * seconds) + 1) / 10.0
    angle = speed_mps * time_s / radius_m
    return track(
        len(time_s), east_m=radius_m * np.cos(angle), north_m=radius_m * np.sin(angle),
        course_deg=np.degrees(-angle) % 360.0, heading_deg=np.degrees(-angle) % 360.0,
        groundspeed_mps=speed_mps, arc_length_m=speed_mps * time_s,
    )  # fmt: skip


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    with ExitStack() as stack:
        try:
            opened = stack.enter_context(browser())
        except NoBrowserError as error:
            pytest.skip(str(error))
        yield opened


@pytest.fixture
def checked(tmp_path: FilePath, capsys: pytest.CaptureFixture[str]) -> Checked:
    """Flies a path with the command `check` into the folder `run`: exit status and metrics."""

    def fly(path: FilePath, *options: str) -> tuple[int, Any]:
        aircraft = [] if "--aircraft" in options else ["--aircraft", "aerosonde"]
        given = [*aircraft, "--no-recording", "--json", "--out", str(tmp_path / "run"), *options]
        return main(["check", str(path), *given]), json.loads(capsys.readouterr().out)

    return fly


@pytest.fixture
def to_break(tmp_path: FilePath) -> FilePath:
    path = tmp_path / "straight.yaml"
    path.write_text(SCENARIO)
    return path
