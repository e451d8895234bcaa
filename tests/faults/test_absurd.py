"""Scenarios that are valid or nearly so, and absurd: refused with a reason, or flown in bounded time and memory."""

import math
import random
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.run_files.run_folder import load_run
from tests.faults.command import FOREST
from tests.processes import python
from tests.refusals import refused

GIB = 2**30
MEASURED = """
import resource, subprocess, sys
with open("said.txt", "w") as said:
    status = subprocess.call([sys.executable, "-m", "harness", *sys.argv[1:]], stdout=said, stderr=said)
print(status, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""
"""By a small process: a child's peak counts what its parent held as it began."""
HEAD = """\
schema: wayproof/scenario/1
name: absurd
area: {bounds_m: [0, 0, 280000, 280000]}
mission: {start_m: [1000, 1000], goal_m: [20000, 20000], time_limit_s: 15}
"""


def circles(number: int) -> str:
    draw = random.Random(1).uniform
    rows = (
        f"  - circle: {{center_m: [{draw(30e3, 2.8e5):.2f}, {draw(30e3, 2.8e5):.2f}], radius_m: {draw(10, 300):.2f}}}\n"
        for _ in range(number)
    )
    return HEAD + "obstacles:\n" + "".join(rows)


def star(corners: int) -> str:
    rows = []
    for number in range(corners):
        angle = math.tau * number / corners
        radius = 5000 + 50 * math.sin(500 * angle)
        rows.append(f"[{4e4 + radius * math.cos(angle):.6f}, {4e4 + radius * math.sin(angle):.6f}]")
    return HEAD + f"obstacles:\n  - polygon: {{vertices_m: [{', '.join(rows)}]}}\n"


def cost(folder: Path, *arguments: str) -> tuple[int, float, int]:
    """Exit status, seconds and the largest resident memory (bytes) of a command."""
    begun = time.monotonic()
    status, peak_kib = python("-c", MEASURED, *arguments, folder=folder, check=True).stdout.split()
    return int(status), time.monotonic() - begun, int(peak_kib) * 1024


@pytest.mark.slow
@pytest.mark.parametrize("world", [circles, star])
def test_a_hundred_thousand_are_flown(world: Callable[[int], str], tmp_path: Path) -> None:
    (tmp_path / "w.yaml").write_text(world(100_000))
    status, seconds, peak = cost(tmp_path, "fly", "w.yaml", "--out", "run", "--quiet")
    assert status == 1, (tmp_path / "said.txt").read_text()
    assert load_run(tmp_path / "run").metrics["outcome"] == "timeout"
    print(f"{seconds:.1f} s, {peak / 2**20:.0f} MiB")
    assert seconds < 240.0
    assert peak < GIB


HUGE: dict[str, Callable[[], str]] = {
    "numbers in a list": lambda: HEAD + "obstacles: [" + "1, " * 5_000_000 + "1]\n",
    "wrong obstacles": lambda: HEAD + "obstacles:\n" + "- circl: {}\n" * 600_000,
    "keys": lambda: HEAD + "".join(f"k{n}: 1\n" for n in range(1_000_000)),
    "lines": lambda: "ab\n" * 10_000_000,
    "a value": lambda: HEAD.replace("absurd", "a" * 20_000_000),
    "brackets": lambda: "a: " + "[" * 30_000_000,
    "more than is read": lambda: "#" * 40_000_000,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", HUGE)
def test_a_huge_file_is_refused_soon(name: str, tmp_path: Path) -> None:
    (tmp_path / "w.yaml").write_text(HUGE[name]())
    status, seconds, peak = cost(tmp_path, "validate", "w.yaml")
    said = (tmp_path / "said.txt").read_text()
    assert status == 2, said[:2000]
    assert said.startswith("w.yaml:")
    assert len(said) < 2000
    print(f"{seconds:.1f} s, {peak / 2**20:.0f} MiB")
    assert seconds < 60.0
    assert peak < GIB


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("sensor.rays", "1000000000", "at most 100000"),
        ("sensor.rays", "9" * 60, "must be"),
        ("sensor.rate_hz", "1e9", "at most 120"),
        ("sensor.rate_hz", "1e-9", "must be at least"),
        ("sensor.range_m", "1e-9", "too short"),
        ("planner.margin_m", "1e9", "at most 1000000"),
        ("aircraft.autopilot", "{roll_rate_limit_degps: 0.5}",
            "autopilot.roll_rate_limit_degps: is 0.5; must be another, or left out: aerosonde"),
        ("aircraft.deviation", "{centre_of_gravity_m: 3}", "is centre_of_gravity_m 3; must be smaller: aerosonde"),
        ("uncertainty", "{centre_of_gravity_m: 1}", "is centre_of_gravity_m 2.05 as drawn; another seed, airspeed_mps"),
        ("aircraft.airspeed_mps", "1e-9", "cannot hold"),
        ("aircraft.model", "/", "must be the folder of one aircraft"),
        ("aircraft.model", "../../../../../../../../etc", "JSBSim model"),
        ("aircraft.model", "~nobody-of-this-name", "unknown aircraft"),
        ("planner.kind", "../x", "must be one of"),
    ],
)  # fmt: skip
def test_a_value_beyond_reason_is_refused(key: str, value: str, sentence: str, tmp_path: Path) -> None:
    said = refused(*["fly", str(FOREST), "--set", f"{key}={value}", "--out", str(tmp_path / "run")])
    assert key.partition("[")[0] in said
    assert sentence in said
    assert not (tmp_path / "run").exists()


@pytest.mark.flights
@pytest.mark.parametrize(
    ("key", "value"),
    [("sensor.rays", "100000"), ("obstacles[0].circle.radius_m", "1e-9"),
     ("area.bounds_m", "[-2.8e5, -2.8e5, 2.8e5, 2.8e5]"), ("sensor.rate_hz", "120"),
     ("sensor.rate_hz", "0.01"), ("sensor.range_m", "1e6"), ("planner.clearance_m", "0")],
)  # fmt: skip
def test_the_outermost_values_are_flown(key: str, value: str, tmp_path: Path) -> None:
    keys = ["--set", f"{key}={value}", "--set", "mission.time_limit_s=3"]
    status, seconds, peak = cost(tmp_path, "fly", str(FOREST), *keys, "--out", "run", "--quiet")
    assert status == 1, (tmp_path / "said.txt").read_text()
    assert load_run(tmp_path / "run").metrics["outcome"] in ("timeout", "planner_failed")
    assert seconds < 60.0
    assert peak < GIB
