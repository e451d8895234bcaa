"""The block between flight model and all that goes by the aircraft's own idea of its state.

Guidance, the altitude and airspeed that are held, the pose with which a scan enters the map, and the position that the
planner is told are believed ones. World, sensor, contact, `reached` and metrics are of the true state.
"""

from __future__ import annotations

from typing import Protocol

from aircraft.interface import AircraftState


class StateEstimator(Protocol):
    """Tells what the aircraft believes of its state. One object serves one flight."""

    @property
    def has_fix(self) -> bool:
        """Whether the position is that of a fix; without one it is reckoned, and drifts."""
        ...

    @property
    def jumps(self) -> int:
        """How often the believed position has jumped, which the aircraft notices: a fix came back after an outage."""
        ...

    @property
    def held_errors(self) -> tuple[float, float]:
        """Error of altitude (m) and airspeed (m/s) that the autopilot holds, as of the last call of `believed`.

        The age of the state is not in it: the flight model makes the autopilot work with an older one.
        """
        ...

    def believed(self, state: AircraftState) -> AircraftState:
        """What the aircraft believes a true state to be; the very object given where nothing is wrong with it.

        Times never go back from one call to the next; one may come twice.
        """
        ...


class PerfectEstimator:
    """The aircraft knows its state exactly. Implements `StateEstimator`."""

    has_fix, jumps, held_errors = True, 0, (0.0, 0.0)

    def believed(self, state: AircraftState) -> AircraftState:
        """The state itself."""
        return state
