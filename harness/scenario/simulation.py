"""The simulation section of a scenario: how many steps of the flight model there are in a second."""

from __future__ import annotations

from typing import Final

from pydantic import field_validator

from aircraft.guidance.interface import UPDATE_RATE_HZ
from aircraft.interface import STEP_RATE_HZ
from harness.scenario.sections import Section, Sensor, key
from harness.scenario.validation import KeyFault

RATES_HZ: Final = (STEP_RATE_HZ, 120)
"""The step rates that are taken where none is given, the first that the sensor's rate divides."""

SLOWEST_HZ: Final = 30
"""A step is then as long as the time constant of the Aerosonde's roll rate, 1/32 s; its track on 14 turns is 0.07 m
from that with 480 steps a second."""

FASTEST_HZ: Final = 1200


class Simulation(Section):
    """How finely the flight is integrated."""

    rate_hz: int = key(
        f"Integration steps per simulated second, a multiple of {UPDATE_RATE_HZ}, the guidance rate; every other rate "
        "must divide it.",
        unit="Hz",
        derived=f"{RATES_HZ[0]}, or {RATES_HZ[1]} where sensor.rate_hz does not divide {RATES_HZ[0]}",
        ge=SLOWEST_HZ,
        le=FASTEST_HZ,
    )

    @field_validator("rate_hz")
    @classmethod
    def _is_a_multiple_of_the_guidance_rate(cls, rate_hz: int) -> int:
        if rate_hz % UPDATE_RATE_HZ:
            near = round(rate_hz / UPDATE_RATE_HZ) * UPDATE_RATE_HZ
            raise ValueError(
                f"is {rate_hz}; must be a multiple of the guidance rate of {UPDATE_RATE_HZ} Hz, such as {near}"
            )
        return rate_hz


def step_rate_hz(given_hz: int | None, sensor: Sensor) -> int:
    """The step rate of a flight.

    Args:
        given_hz: what the scenario says; None: nothing.
        sensor: whose rate must divide it.

    Raises:
        KeyFault: it does not.
    """
    rates = RATES_HZ if given_hz is None else (given_hz,)
    for rate_hz in rates:
        steps = rate_hz / sensor.rate_hz
        if steps > 0.5 and abs(steps - round(steps)) <= 1e-9 * steps:
            return rate_hz
    steps = max(1, round(rates[-1] / sensor.rate_hz))
    whose = f"{rates[-1]} Hz" if given_hz is None else f"simulation.rate_hz {given_hz}"
    raise KeyFault(
        ("sensor", "rate_hz"),
        f"is {sensor.rate_hz:g}, which does not divide {whose}; the nearest that does is {rates[-1] / steps:.12g}",
    )
