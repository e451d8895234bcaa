"""What the closed loop costs on this machine, against the bare flight model.

All costs are processor time of the whole process, threads of libraries included. The speed of a shared machine changes
from one second to the next: so a flight and its bare run take turns, and only their ratio counts.
"""

from __future__ import annotations

import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple, TypeVar

from aircraft.interface import AircraftState
from harness.flight.closed_loop import Loop, fly
from harness.flight.observer import Observer
from harness.flight.record import Flight
from harness.mapping.scan import RangeScan
from harness.run.scenario_flight import atmosphere, fly_to_folder, jsbsim_aircraft, make_loop
from harness.scenario.performance import start_conditions
from harness.scenario.scenario import Scenario

ROUNDS = 5
"""Each round is one flight without and one with the recording; a further one goes before and does not count."""
TURN_S = 30.0  # the bare model and the flight are flown by turns, for so long (simulated) each
TIMED_PARTS = {
    "world": ("record", "clearance"),
    "sensor": ("sensor", "scan"),
    "seen": ("map", "update"),
    "planner": ("planner", "plan"),
    "model": ("dynamics", "state", "fault", "command", "advance"),
    "guidance": ("guidance", "follow", "update"),
}
"""Parts of a loop whose time is measured: for each, the block that the time is booked to and its methods."""
T = TypeVar("T")


class Turns(NamedTuple):
    """Times (s) of a bare run and of its flight, taken in turns, and the flight's figures."""

    bare_s: float
    flight_s: float
    figures: Mapping[str, Any]


def bench(scenario: Scenario, report: Callable[[int, int, str], None] | None = None) -> dict[str, Any]:
    """Measures a complete scenario, in this process; reports how many flights were flown, and of how many.

    First the loop is flown once alone with its blocks timed: that gives their shares. Then come rounds of two whole
    flights to a complete run folder, without and with the recording. Either takes turns with `run()` of the aircraft,
    autopilot on, commands set once, from the same start in the same air at the same step rate; loading and trimming
    are not counted. `planner_ms` is the processor time of all searches of a flight, the least of all flights; `blocks`
    has the share of each in the flight with the recording.

    Raises AircraftError without an aircraft, ValueError if the flight is over before anything was planned or flown.
    """
    flight, blocks = _fly_alone(scenario)
    taken: dict[bool, list[Turns]] = {False: [], True: []}
    for number, recording in enumerate((False, True) * (ROUNDS + 1), start=1):
        if report is not None:
            report(number, 2 * ROUNDS + 3, "flights")
        taken[recording].append(in_turns(scenario, recording))
    closed, recorded = (median(each.flight_s / each.bare_s for each in turns[1:]) for turns in taken.values())
    searches = [each.figures["compute_ms"] for turns in taken.values() for each in turns[1:]]
    return {
        "scenario": scenario.name,
        "outcome": flight.outcome.value,
        "step_rate_hz": scenario.simulation.rate_hz,
        "bare_rate_hz": scenario.simulation.rate_hz,
        "closed_loop_ratio": closed,
        "closed_loop_recording_ratio": recorded,
        "planner_ms": {name: min(each[name] for each in searches) for name in ("p50", "p99", "max")},
        "blocks": block_shares(blocks, closed, max(recorded, closed)),
    }


def _fly_alone(scenario: Scenario) -> tuple[Flight, dict[str, float]]:
    """One flight of the loop, and what each block of it cost, over the bare run; ValueError if there is nothing."""
    seconds: dict[str, float] = defaultdict(float)
    bare, loop = Bare(scenario), watched(make_loop(scenario), seconds)
    whole_s, flight = _cpu_s(lambda: fly(loop, [bare]))
    if not bare.steps or not flight.compute_ms:
        raise ValueError(f"nothing to measure: {flight.reason}")
    blocks = {block: whole_s / flight.wall_s * cost_s for block, cost_s in seconds.items()}
    blocks["loop"] = whole_s - bare.cpu_s - sum(blocks.values())
    return flight, {block: cost_s / bare.cpu_s for block, cost_s in blocks.items()}


def watched(loop: Loop, seconds: dict[str, float]) -> Loop:
    """A loop whose blocks add their times to `seconds`; the rest is the loop itself: verdicts, log and turns."""
    parts = {
        name: _Watched(getattr(loop, name), block, methods, seconds) for name, (block, *methods) in TIMED_PARTS.items()
    }
    return replace(loop, **parts)  # type: ignore[arg-type]


def block_shares(in_loop: Mapping[str, float], closed: float, recorded: float) -> dict[str, float]:
    """Share of each block in a whole flight with the recording; they sum to 1.

    From its cost in a flight of the loop alone, and those of the whole flight without and with the recording. What
    comes before and after the loop (loading, metrics, files) is booked to `record`.
    """
    loop = sum(in_loop.values())
    scale = min(1.0, closed / loop)  # the lone flight may have been disturbed
    costs = {block: each * scale for block, each in in_loop.items()}
    costs["record"] = costs.get("record", 0.0) + closed - scale * loop
    costs["recording"] = recorded - closed
    return {block: each / recorded for block, each in costs.items()}


class _Watched:
    """A stand-in for a part of a loop, whose time in some methods is booked to a block."""

    def __init__(self, part: Any, block: str, methods: list[str], seconds: dict[str, float]) -> None:
        def timed(name: str, *arguments: Any, **named: Any) -> Any:
            begun = time.perf_counter()
            try:
                return getattr(part, name)(*arguments, **named)
            finally:
                seconds[block] += time.perf_counter() - begun

        self._part = part
        self.__dict__.update({name: partial(timed, name) for name in methods})

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)


class Bare(Observer):
    """Flies the bare model as far as the flight that it observes has come."""

    def __init__(self, scenario: Scenario) -> None:
        self.model = jsbsim_aircraft(scenario, start_conditions(scenario), atmosphere(scenario))
        self.cpu_s, self.steps, self._turn_s = 0.0, 0, TURN_S

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """Every `TURN_S`, flies the bare model up to the time of the flight."""
        if state.time_s >= self._turn_s:
            self._turn_s = state.time_s + TURN_S
            self._fly_to(state.time_s)

    def on_event(self, time_s: float, text: str) -> None:
        """Flies the bare model up to the time of the event: the last event is the end of the flight."""
        self._fly_to(time_s)

    def _fly_to(self, time_s: float) -> None:
        steps = round(time_s * self.model.step_rate_hz) - self.steps
        begun = time.thread_time()  # what another thread does meanwhile, it does for the flight
        self.model.advance(steps)
        self.cpu_s += time.thread_time() - begun
        self.steps += steps


def in_turns(scenario: Scenario, recording: bool) -> Turns:
    """Flies once into a folder that is thrown away, by turns with the bare model."""
    bare = Bare(scenario)
    with tempfile.TemporaryDirectory(prefix="wayproof-bench-") as folder:
        out = Path(folder) / "run"
        whole_s, figures = _cpu_s(lambda: fly_to_folder(scenario, out, recording, watching=[bare]))
    return Turns(bare.cpu_s, whole_s - bare.cpu_s, figures)


def _cpu_s(action: Callable[[], T]) -> tuple[float, T]:
    begun = time.process_time()
    result = action()
    return time.process_time() - begun, result
