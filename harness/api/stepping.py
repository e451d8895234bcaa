"""Flights that a program steps through from Python: `make`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from harness.api.flights import as_input_errors, given_parts
from harness.api.results import FlightResult
from harness.flight.observer import Observer
from harness.flight.stepped import Status, SteppedLoop
from harness.scenario.scenario import Scenario


class SteppedFlight(SteppedLoop):
    """The closed loop of one scenario, flown step by step and as often as it is reset."""

    def __init__(self, scenario: Scenario, observers: Sequence[Observer] = ()) -> None:
        from harness.run.scenario_flight import make_loop

        super().__init__(lambda: make_loop(scenario), observers)
        self.scenario = scenario
        """What is flown, every default filled in."""

    def reset(self) -> Status:
        """Begins a new flight, whether or not the one before has ended, and returns its status at the start.

        An InputError says why the aircraft cannot be loaded or trimmed, a PlannerError why the planner cannot be made.
        """
        with as_input_errors():
            return super().reset()

    def result(self) -> FlightResult:
        """The result of the flight, as `fly` gives it; a RuntimeError says that none has begun, or it is not over."""
        return FlightResult.of(self.scenario, self.flight())


def make(
    scenario: Scenario | str | Path,
    planner: object = None,
    guidance: object = None,
    *,
    observers: Sequence[Observer] = (),
) -> SteppedFlight:
    """A scenario's flight that is stepped by the caller, 0.1 simulated seconds a step.

        flight = wayproof.make("aerosonde_forest")
        status = flight.reset()
        while not status.done:
            status = flight.step()
        run = flight.result()  # as wayproof.fly gives it, with the same digest

    Scenario, planner and law are as `fly` takes them; an object serves every flight, a class makes one for each. To
    decide itself, a caller changes its object between two steps: a planner is asked after every scan, a guidance law
    at every step. `step(roll_command_rad=...)` steers for one step in place of the law. `observers` are told of each
    scan, plan and event, and of the track in blocks (`harness.flight.observer.Observer`). An InputError says that the
    scenario or planner cannot be used.
    """
    return SteppedFlight(given_parts(scenario, planner, guidance), observers)
