"""What the closed loop costs on this machine, against the bare flight model.

All costs are processor time of the whole process, threads of libraries included, so that a ratio hides no
work and does not count the time for which other programs had the core. Flights and bare runs take turns,
and the least of each counts: what disturbs a measurement only ever adds to it. On a machine that others share they
take turns for longer, until the least of each has been measured twice.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from harness.closed_loop import Loop, Progress, fly
from harness.run import atmosphere, fly_to_folder, jsbsim_aircraft, make_loop, start_conditions
from harness.scenario import Scenario
from harness.stopwatch import Stopwatch

FEWEST_ROUNDS, MOST_ROUNDS = 3, 10
"""Each round is one bare run, one flight without and one with the recording."""
ALIKE = 0.01
"""A figure is steady if two of its measurements differ by no more than this share, and no other is less."""

T = TypeVar("T")


def bench(scenario: Scenario, progress: Progress | None = None) -> dict[str, Any]:
    """Measures one scenario, in this process.

    First the loop is flown once alone, with a stopwatch on its blocks and every update of guidance by itself: that
    gives their shares, and loads what is loaded at its first use. Then come rounds of three measurements,
    until the least of each is `ALIKE` to the next, but no more than `MOST_ROUNDS`:

    - bare: `run()` of the scenario's aircraft, autopilot on, commands set once, from the same trimmed start
      in the same air, for as many steps as the flight takes; loading and trimming not counted;
    - closed loop: the whole flight from the scenario to a complete run folder without the recording:
      loading, trimming, flying, metrics, writing and closing every file;
    - the same with the recording.

    Args:
        scenario: a complete scenario.
        progress: told of the first flight as it goes on, and of each round.

    Returns:
        `scenario`, `outcome`; `sim_s` and `steps` of the flight; `rounds`, how many there were, and whether the
        least of each is `steady`; `cpu_s`, the least seconds of `bare`,
        `closed_loop` and `closed_loop_recording`; `bare_step_us`; the ratios `closed_loop_ratio` and
        `closed_loop_recording_ratio` of those to `bare`; `planner_ms`, `p50`, `p99` and `max` of all searches
        of a flight, the least of all flights; `blocks`, the share of each block in the flight with the
        recording.

    Raises:
        AircraftError: the aircraft cannot be loaded or trimmed.
        ValueError: the flight is over before anything was planned or flown, so there is nothing to compare.
    """
    watch = Stopwatch()
    loop = watched(make_loop(scenario), watch)
    loop_s, flight = _cpu_s(lambda: fly(loop, (), progress))
    cpu = loop_s / flight.wall_s
    in_loop = {block: cpu * seconds for block, seconds in watch.seconds.items()}
    in_loop["loop"] = loop_s - sum(in_loop.values())
    steps = round(flight.sim_s * loop.model.step_rate_hz)
    if not steps or not flight.compute_ms:
        raise ValueError(f"nothing to measure: {flight.reason}")
    taken: dict[str, list[float]] = {"bare": [], "closed_loop": [], "closed_loop_recording": []}
    searches: list[Mapping[str, float]] = []
    for number in range(1, MOST_ROUNDS + 1):
        if progress is not None:
            progress(flight.sim_s, 0.0, f"round {number}")
        taken["bare"].append(_bare_s(scenario, steps))
        for name, recording in (("closed_loop", False), ("closed_loop_recording", True)):
            cpu_s, figures = _flown(scenario, recording=recording)
            taken[name].append(cpu_s)
            searches.append(figures["compute_ms"])
        steady = all(map(_steady, taken.values()))
        if steady and number >= FEWEST_ROUNDS:
            break
    least = {name: min(seconds) for name, seconds in taken.items()}
    bare, closed, recorded = least.values()
    return {
        "scenario": scenario.name,
        "outcome": flight.outcome.value,
        "sim_s": flight.sim_s,
        "steps": steps,
        "rounds": number,
        "steady": steady,
        "cpu_s": least,
        "bare_step_us": 1e6 * bare / steps,
        "closed_loop_ratio": closed / bare,
        "closed_loop_recording_ratio": recorded / bare,
        "planner_ms": {name: min(each[name] for each in searches) for name in ("p50", "p99", "max")},
        "blocks": block_shares(in_loop, closed, max(recorded, closed)),
    }


def watched(loop: Loop, watch: Stopwatch) -> Loop:
    """A loop whose blocks are timed; what is left over is the loop itself: verdicts, log and turns."""
    return replace(
        loop,
        world=watch.over(loop.world, "record", "clearance"),
        sensor=watch.over(loop.sensor, "sensor", "scan"),
        seen=watch.over(loop.seen, "map", "update"),
        planner=watch.over(loop.planner, "planner", "plan"),
        model=watch.over(loop.model, "dynamics", "state", "fault", "command", "advance"),
        follower=watch.over(loop.follower, "guidance", "follow", "update"),
    )


def block_shares(in_loop: Mapping[str, float], closed_s: float, recording_s: float) -> dict[str, float]:
    """Share of each block in a whole flight with the recording; they sum to 1.

    What comes before and after the loop (loading, metrics, files) is booked to `record`, what the recording
    adds to `recording`.

    Args:
        in_loop: seconds of each block in a flight of the loop alone.
        closed_s: processor time of the whole flight without the recording.
        recording_s: that of the whole flight with it, not less.
    """
    loop_s = sum(in_loop.values())
    scale = min(1.0, closed_s / loop_s)  # the lone flight may have been disturbed
    seconds = {block: each * scale for block, each in in_loop.items()}
    seconds["record"] = seconds.get("record", 0.0) + closed_s - scale * loop_s
    seconds["recording"] = recording_s - closed_s
    return {block: each / recording_s for block, each in seconds.items()}


def _bare_s(scenario: Scenario, steps: int) -> float:
    model = jsbsim_aircraft(scenario, start_conditions(scenario), atmosphere(scenario))
    return _cpu_s(lambda: model.advance(steps))[0]


def _flown(scenario: Scenario, *, recording: bool) -> tuple[float, dict[str, Any]]:
    """Processor time and figures of one flight into a folder that is thrown away."""
    with tempfile.TemporaryDirectory(prefix="wayproof-bench-") as folder:
        return _cpu_s(lambda: fly_to_folder(scenario, Path(folder) / "run", recording))


def _steady(seconds: Sequence[float]) -> bool:
    """Whether the least of some measurements was measured twice."""
    least = sorted(seconds)[:2]
    return least[-1] <= (1.0 + ALIKE) * least[0] and len(least) == 2


def _cpu_s(action: Callable[[], T]) -> tuple[float, T]:
    begun = time.process_time()
    result = action()
    return time.process_time() - begun, result
