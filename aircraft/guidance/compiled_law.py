"""A built-in law in flight: its parameters, its memory and its route, given to machine code at every update."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLimits, GuidanceOutput
from aircraft.guidance.progress import place_on_rows, route_rows
from aircraft.interface import AircraftState, FloatArray, Route


class NoMemory(NamedTuple):
    """Of a law that needs none; a record must have a field."""

    nothing: float = 0.0


class CompiledLaw:
    """Follows a route by one of the laws of `aircraft.guidance.machine_code`. Implements `GuidanceLaw`.

    Args:
        kind: which.
        parameters: constants of the flight, a NamedTuple of the law's file.
        memory: what the law remembers, a NamedTuple at its start.
        limits: what may be asked of the aircraft.
    """

    def __init__(
        self,
        kind: str,
        parameters: NamedTuple,
        limits: GuidanceLimits,
        memory: NamedTuple = NoMemory(),  # noqa: B008
    ) -> None:
        from aircraft.guidance import machine_code  # half a second

        self._update = machine_code.UPDATES[kind]
        self._parameters, self._memory = _record(parameters), _record(memory)
        self._flight = np.zeros(1, machine_code.FLIGHT)
        self._flight["bank_limit_rad"] = limits.bank_limit_rad
        self._flight["roll_step_rad"] = limits.roll_rate_radps / UPDATE_RATE_HZ
        self._rows: FloatArray | None = None

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes a new route; the roll command goes on from where it is."""
        self._rows = route_rows(route)
        self._flight["row"], self._flight["along_m"] = place_on_rows(self._rows, arc_length_m)

    def update(self, state: AircraftState) -> GuidanceOutput:
        """Decides the roll command for the next update interval."""
        if self._rows is None:
            raise RuntimeError("follow() a route before update()")
        roll_command_rad, cross_track_m, arc_length_m, bank_saturated, past_end, airspeed_mps = self._update(
            self._rows,
            self._parameters,
            self._flight,
            self._memory,
            state.time_s,
            state.east_m,
            state.north_m,
            state.velocity_east_mps,
            state.velocity_north_mps,
            state.heading_rad,
            state.airspeed_mps,
        )
        return GuidanceOutput(
            roll_command_rad, cross_track_m, arc_length_m, bank_saturated, past_end, airspeed_mps
        )


def _record(values: NamedTuple) -> NDArray[Any]:
    """An array of one record with the fields of a NamedTuple, which machine code reads and changes."""
    plain = values._asdict()
    types = [(name, np.bool_ if isinstance(value, bool) else np.float64) for name, value in plain.items()]
    return np.array([tuple(values)], np.dtype(types))
