"""What the closed loop costs on this machine, against the bare flight model.

All costs are processor time of the whole process, threads of libraries included, so that a ratio hides no
work and does not count the time for which other programs had the core. On a machine that others share, its speed
changes from one second to the next: so a flight and its bare run take turns, half a minute of flight each, and
only their ratio counts. The one flown while the machine was fastest is taken, as what disturbs a measurement costs the
loop more, which needs more of the caches than the model alone.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from aircraft.guidance.interface import UPDATE_RATE_HZ
from aircraft.interface import AircraftState, FlightModel
from harness.bench.stopwatch import Stopwatch
from harness.flight.closed_loop import Loop, fly
from harness.flight.observer import Progress
from harness.flight.record import AcceptedPlan, Track
from harness.mapping.scan import RangeScan
from harness.run.scenario_flight import (
    atmosphere,
    fly_to_folder,
    jsbsim_aircraft,
    make_loop,
)
from harness.scenario.scenario import Scenario
from harness.scenario.start import start_conditions

FEWEST_ROUNDS, MOST_ROUNDS = 3, 10
"""Each round is one flight without and one with the recording, both in turns with the bare model."""
TURN_S = 30.0
"""The bare model follows the flight in turns of so long, simulated."""
ALIKE = 0.01
"""A ratio is steady if the two flown while the machine was fastest differ by no more than this share."""

T = TypeVar("T")


def bench(scenario: Scenario, progress: Progress | None = None) -> dict[str, Any]:
    """Measures one scenario, in this process.

    First the loop is flown once alone, with a stopwatch on its blocks: that gives their shares, and loads what is
    loaded at its first use. Then come rounds of two flights, until both ratios are steady, but no more than
    `MOST_ROUNDS`:

    - closed loop: the whole flight from the scenario to a complete run folder without the recording:
      loading, trimming, flying, metrics, writing and closing every file;
    - the same with the recording.

    Either takes turns with `run()` of the scenario's aircraft, autopilot on, commands set once, from the same trimmed
    start in the same air, for as long as the flight takes, at the flight's own step rate; its loading and trimming are
    not counted.

    Args:
        scenario: a complete scenario.
        progress: told of the first flight as it goes on, and of each round.

    Returns:
        `scenario`, `outcome`; `sim_s` and `step_rate_hz` of the flight; `steps` and `bare_rate_hz` (the same rate) of
        the bare run; `rounds`, how many there were, and whether both ratios are `steady`; `cpu_s`, for `closed_loop`
        and `closed_loop_recording` the seconds of `bare` and `flight`; their ratios `closed_loop_ratio` and
        `closed_loop_recording_ratio`; `outside_us`, the time of a guidance interval that the flight without the
        recording spends outside JSBSim; `bare_step_us`; `planner_ms`, `p50`, `p99` and `max` of the processor time of
        all searches of a flight, the least of all flights; `blocks`, the share of each block in the flight with the
        recording.

    Raises:
        AircraftError: the aircraft cannot be loaded or trimmed.
        ValueError: the flight is over before anything was planned or flown, so there is nothing to compare.
    """
    watch, bare = Stopwatch(), _Bare(scenario)
    loop = watched(make_loop(scenario), watch)
    whole_s, flight = _cpu_s(lambda: fly(loop, [bare], progress))
    if not bare.steps or not flight.compute_ms:
        raise ValueError(f"nothing to measure: {flight.reason}")
    in_loop = {block: whole_s / flight.wall_s * seconds for block, seconds in watch.seconds.items()}
    in_loop["loop"] = whole_s - bare.cpu_s - sum(in_loop.values())
    taken: dict[bool, list[_Turns]] = {False: [], True: []}
    for number in range(1, MOST_ROUNDS + 1):
        if progress is not None:
            progress(flight.sim_s, 0.0, f"round {number}")
        for recording, turns in taken.items():
            turns.append(_in_turns(scenario, recording))
        steady = all(map(_steady, taken.values()))
        if steady and number >= FEWEST_ROUNDS:
            break
    closed, recorded = (min(turns, key=_bare_s) for turns in taken.values())
    searches = [each.figures["compute_ms"] for turns in taken.values() for each in turns]
    return {
        "scenario": scenario.name,
        "outcome": flight.outcome.value,
        "sim_s": flight.sim_s,
        "step_rate_hz": scenario.simulation.rate_hz,
        "steps": bare.steps,
        "bare_rate_hz": scenario.simulation.rate_hz,
        "rounds": number,
        "steady": steady,
        "cpu_s": {
            name: {"bare": each.bare_s, "flight": each.flight_s}
            for name, each in (("closed_loop", closed), ("closed_loop_recording", recorded))
        },
        "outside_us": 1e6 * (closed.flight_s - closed.bare_s) / (flight.sim_s * UPDATE_RATE_HZ),
        "bare_step_us": 1e6 * closed.bare_s / bare.steps,
        "closed_loop_ratio": closed.ratio,
        "closed_loop_recording_ratio": recorded.ratio,
        "planner_ms": {name: min(each[name] for each in searches) for name in ("p50", "p99", "max")},
        "blocks": block_shares(
            {block: seconds / bare.cpu_s for block, seconds in in_loop.items()},
            closed.ratio,
            max(recorded.ratio, closed.ratio),
        ),
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
        guidance=watch.over(loop.guidance, "guidance", "follow", "update"),
    )


def block_shares(in_loop: Mapping[str, float], closed: float, recorded: float) -> dict[str, float]:
    """Share of each block in a whole flight with the recording; they sum to 1.

    What comes before and after the loop (loading, metrics, files) is booked to `record`, what the recording
    adds to `recording`.

    Args:
        in_loop: cost of each block in a flight of the loop alone, in any unit.
        closed: cost of the whole flight without the recording.
        recorded: that of the whole flight with it, not less.
    """
    loop = sum(in_loop.values())
    scale = min(1.0, closed / loop)  # the lone flight may have been disturbed
    costs = {block: each * scale for block, each in in_loop.items()}
    costs["record"] = costs.get("record", 0.0) + closed - scale * loop
    costs["recording"] = recorded - closed
    return {block: each / recorded for block, each in costs.items()}


def bare_model(scenario: Scenario) -> FlightModel:
    """The aircraft of a scenario at its start, to be flown with nothing around it."""
    return jsbsim_aircraft(scenario, start_conditions(scenario), atmosphere(scenario))


class _Bare:
    """Flies the bare model as far as the flight that it observes has come."""

    def __init__(self, scenario: Scenario) -> None:
        self._model = bare_model(scenario)
        self.cpu_s, self.steps, self._turn_s = 0.0, 0, TURN_S

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        if state.time_s >= self._turn_s:
            self._turn_s = state.time_s + TURN_S
            self._fly_to(state.time_s)

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        pass

    def on_block(self, block: Track) -> None:
        pass

    def on_event(self, time_s: float, text: str) -> None:
        self._fly_to(time_s)

    def _fly_to(self, time_s: float) -> None:
        steps = round(time_s * self._model.step_rate_hz) - self.steps
        begun = time.thread_time()  # what another thread does meanwhile, it does for the flight
        self._model.advance(steps)
        self.cpu_s += time.thread_time() - begun
        self.steps += steps


@dataclass(frozen=True)
class _Turns:
    """What a flight and its bare run cost in turns, and the flight's figures."""

    bare_s: float
    flight_s: float
    figures: Mapping[str, Any]

    @property
    def ratio(self) -> float:
        return self.flight_s / self.bare_s


def _in_turns(scenario: Scenario, recording: bool) -> _Turns:
    """One flight into a folder that is thrown away."""
    bare = _Bare(scenario)
    with tempfile.TemporaryDirectory(prefix="wayproof-bench-") as folder:
        whole_s, figures = _cpu_s(
            lambda: fly_to_folder(scenario, Path(folder) / "run", recording, watching=[bare])
        )
    return _Turns(bare.cpu_s, whole_s - bare.cpu_s, figures)


def _bare_s(turns: _Turns) -> float:
    return turns.bare_s


def _steady(taken: Sequence[_Turns]) -> bool:
    """Whether the two flown while the machine was fastest have the same ratio."""
    low, high = (
        sorted(turns.ratio for turns in sorted(taken, key=_bare_s)[:2]) if len(taken) > 1 else (0.0, 1.0)
    )
    return high <= (1.0 + ALIKE) * low


def _cpu_s(action: Callable[[], T]) -> tuple[float, T]:
    begun = time.process_time()
    result = action()
    return time.process_time() - begun, result
