"""What the number of obstacles in the world costs: the same flight in ever larger fields of one density.

The field grows outwards from the flight, and the smaller fields are the middle of the larger ones, so that the
aircraft meets the same obstacles in all of them. The area of operations stays the same, for it alone sets how fine
and how large the obstacle map is; most of a large field lies outside it.
"""

from __future__ import annotations

import math
import resource
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from harness.bench.costs import bare_model
from harness.flight.closed_loop import fly
from harness.run.scenario_flight import make_loop
from harness.scenario.scenario import Scenario, dump_scenario, load_scenario, parse_scenario

COUNTS: Final = (10, 100, 1_000, 10_000, 100_000)
SPACING_M: Final = 1000.0
"""One obstacle in each square of this side."""

RADIUS_M: Final = (50.0, 150.0)
JITTER: Final = 0.25
"""How far a centre may lie from the middle of its square, as a share of the side, to the east and to the north."""

HALF_WAY_M: Final = 1700.0
CLEARANCE_M: Final = 60.0
HALF_AREA_M: Final = 5000.0
FLIGHTS: Final = 5

FloatArray = NDArray[np.float64]


def field(count: int) -> FloatArray:
    """(count, 3) centre east, centre north and radius of circles about (0, 0), clear of start and goal.

    The first of a larger field are those of a smaller.
    """
    side = math.ceil(math.sqrt(count)) + 3  # more than enough for those that are left out
    cells = np.stack(np.meshgrid(*2 * [np.arange(-side // 2, side // 2 + 1)]), axis=-1).reshape(-1, 2)
    ring = np.abs(cells).max(axis=1)
    cells = cells[np.lexsort((cells[:, 1], cells[:, 0], ring))]
    drawn = np.random.default_rng(1).random((len(cells), 3))
    centres = SPACING_M * (cells + JITTER * (2.0 * drawn[:, :2] - 1.0))
    radii = RADIUS_M[0] + (RADIUS_M[1] - RADIUS_M[0]) * drawn[:, 2]
    away = np.hypot(np.abs(centres[:, 0]) - HALF_WAY_M, centres[:, 1]) - radii
    return np.column_stack((centres, radii))[away > 2.0 * CLEARANCE_M][:count]


def scenario_text(count: int) -> str:
    """A scenario file with so many obstacles."""
    return "\n".join(_lines(count))


def _lines(count: int) -> Iterator[str]:
    low, high = -HALF_AREA_M, HALF_AREA_M
    yield "schema: wayproof/scenario/1"
    yield f"name: field-{count}"
    yield f"area: {{bounds_m: [{low}, {low}, {high}, {high}]}}"
    yield f"mission: {{start_m: [{-HALF_WAY_M}, 0], goal_m: [{HALF_WAY_M}, 0]}}"
    yield f"planner: {{clearance_m: {CLEARANCE_M}}}"
    yield "obstacles:"
    for east, north, radius in field(count).tolist():
        yield f"  - circle: {{center_m: [{east:.2f}, {north:.2f}], radius_m: {radius:.2f}}}"


def bench_worlds(
    most: int = COUNTS[-1], progress: Callable[[int, int, str], None] | None = None
) -> list[dict[str, Any]]:
    """Measures every field, the smallest first.

    Args:
        most: fields of more obstacles are left out.
        progress: told what is done, of how much, and the field at hand.

    Returns:
        For each field: `obstacles`; `outcome` and `sim_s` of its flight; processor times, the least of
        `FLIGHTS` but for files: `load_s` from the file to the first step, `write_s` for the run folder's
        `scenario.yaml`, `loop_ms` of the loop for each simulated second, `closed_loop_ratio` of that to `run()`
        alone at 120 Hz; `planner_p99_ms`; `peak_mib`, the largest resident size of this process so far.
    """
    counts = [count for count in COUNTS if count <= most]
    make_loop(parse_scenario(scenario_text(COUNTS[0])))  # loads what is loaded at its first use
    rows = []
    for done, count in enumerate(counts):
        if progress is not None:
            progress(done, len(counts), f"{count:,} obstacles")
        rows.append(_measured(count))
    return rows


def _measured(count: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory(prefix="wayproof-bench-") as folder:
        file = Path(folder) / "scenario.yaml"
        file.write_text(scenario_text(count), "utf-8")
        begun = time.process_time()
        scenario = load_scenario(file)
    make_loop(scenario)
    loaded = time.process_time()
    dump_scenario(scenario)
    written = time.process_time()
    flights = [_flown(scenario) for _ in range(FLIGHTS)]
    first = flights[0]
    loop_s, bare_s = (min(each[name] for each in flights) for name in ("loop_s", "bare_s"))
    return {
        "obstacles": count,
        "outcome": first["outcome"],
        "sim_s": first["sim_s"],
        "load_s": loaded - begun,
        "write_s": written - loaded,
        "loop_ms": 1e3 * loop_s / first["sim_s"],
        "closed_loop_ratio": loop_s / bare_s,
        "planner_p99_ms": min(each["planner_p99_ms"] for each in flights),
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    }


def _flown(scenario: Scenario) -> dict[str, Any]:
    """One flight of the loop alone, and of the model alone for as long."""
    loop, bare = make_loop(scenario), bare_model(scenario)
    begun = time.process_time()
    flight = fly(loop)
    flown = time.process_time()
    bare.advance(round(flight.sim_s * bare.step_rate_hz))
    return {
        "outcome": flight.outcome.value,
        "sim_s": flight.sim_s,
        "loop_s": flown - begun,
        "bare_s": time.process_time() - flown,
        "planner_p99_ms": float(np.percentile(flight.compute_ms, 99)),
    }
