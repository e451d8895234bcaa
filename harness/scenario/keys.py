"""What a scenario file says: its sections as they were read. `resolving.resolve` fills in what follows from others."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import ConfigDict, FailFast, Field, Strict

from aircraft.guidance.interface import UPDATE_RATE_HZ
from aircraft.interface import STEP_RATE_HZ
from harness.scenario import sections
from harness.scenario.environment import Environment, GroundSpec, SourceSpec
from harness.scenario.navigation import Navigation
from harness.scenario.obstacles import Obstacle
from harness.scenario.sections import DERIVED, Length, Section, Sensor
from harness.scenario.validation import NAME_PATTERN, KeyFault

NORMALS: Final = (51, 8)  # standard normal numbers that draw a day's air, and the deviations of its aircraft
DEFAULT_RATES_HZ: Final = (STEP_RATE_HZ, 120)  # the first that the sensor's rate divides is the default
LEAST_RATE_HZ: Final = 30  # at this one the Aerosonde's track on 14 turns is 0.07 m from that at 480


class TrackabilitySpec(Section):
    """What a leg of the flight may be off before it counts as not trackable."""

    cross_track_m: Length = DERIVED
    """Distance of the true position from the plan. Default: a tenth of a written planner.clearance_m, else 10 m."""
    altitude_m: Length = DERIVED
    """Distance from mission.altitude_m. Default: 10 m."""
    airspeed_mps: Annotated[float, Field(gt=0, le=1000)] = DERIVED
    """Error of the true airspeed, averaged over 20 s. Default: a tenth of aircraft.airspeed_mps."""
    load_factor: Annotated[float, Field(gt=1, le=20)] = DERIVED
    """Load factor, averaged over 1 s. Default: 2.1 + 24000 / (weight in lb + 10000), 2.5 to 3.8 (14 CFR 25.337)."""


class Simulation(Section):
    """How finely the flight is integrated."""

    rate_hz: Annotated[int, Field(ge=LEAST_RATE_HZ, le=1200, multiple_of=UPDATE_RATE_HZ)] = DERIVED
    """Integration steps a simulated second, a multiple of 10. Default: 60, or 120 where sensor.rate_hz needs that."""


class ScenarioKeys(Section):
    """One flight as a file describes it. Attributes equal its keys, except `schema_`, which is `schema` there."""

    model_config = ConfigDict(title="Scenario")

    schema_: Literal["wayproof/scenario/1"] = Field(alias="schema")
    """Format and version."""
    name: Annotated[str, Field(pattern=NAME_PATTERN, max_length=100)]
    """Names the run folder."""
    seed: Annotated[int, Field(ge=0, le=2**53)] = 1
    """Root seed; every random stream derives from it."""
    area: sections.Area
    """The area of operations."""
    obstacles: Annotated[tuple[Obstacle, ...], Strict(False), FailFast()] = ()
    """Unknown to the planner until sensed."""
    ground: GroundSpec | None = None
    """The true ground. Default: that of terrain files among the obstacles."""
    sources: Annotated[tuple[SourceSpec, ...], Strict(False)] | None = None
    """Files that obstacles and ground were made of. Default: none."""
    mission: sections.MissionSpec
    """From where to where."""
    aircraft: sections.AircraftSpec = sections.AircraftSpec()
    """What flies."""
    sensor: Sensor = Sensor()
    """What it senses with."""
    planner: sections.PlannerSpec = sections.PlannerSpec()
    """What plans."""
    guidance: sections.GuidanceSpec = sections.GuidanceSpec()
    """What steers along the plan."""
    navigation: Navigation = Navigation()
    """What it believes of its state."""
    conditions: Literal["ideal", "typical", "rough"] = "ideal"
    """What kind of day fills what is left out of navigation, aircraft.actuators, environment and uncertainty."""
    uncertainty: sections.UncertaintySpec | None = None
    """By how much the flown aircraft differs from its model, 1 sigma. Default: that of the conditions."""
    normals: Annotated[
        tuple[Annotated[float, Field(ge=-9, le=9)], ...] | None,
        *(Strict(False), Field(min_length=sum(NORMALS), max_length=sum(NORMALS))),
    ] = None
    """Standard normal numbers from which conditions and uncertainty are drawn in place of the seed. Default: none."""
    simulation: Simulation = Simulation()
    """How finely it is integrated."""
    environment: Environment = Environment()
    """The air."""
    trackability: TrackabilitySpec = TrackabilitySpec()
    """What a leg may be off before it counts as not trackable."""

    def updated(self, **replaced: Any) -> ScenarioKeys:
        """Returns a copy with some sections replaced."""
        return self.model_copy(update=replaced)


def step_rate_hz(given_hz: int | None, sensor: Sensor) -> int:
    """Returns the step rate of a flight, given or chosen; raises a KeyFault if the sensor's does not divide it."""
    rates = DEFAULT_RATES_HZ if given_hz is None else (given_hz,)
    for rate_hz in rates:
        steps = rate_hz / sensor.rate_hz
        if steps > 0.5 and abs(steps - round(steps)) <= 1e-9 * steps:
            return rate_hz
    steps = max(1, round(rates[-1] / sensor.rate_hz))
    whose = f"{rates[-1]} Hz" if given_hz is None else f"simulation.rate_hz {given_hz}"
    fault = f"does not divide {whose}; the nearest that does is {rates[-1] / steps:.12g}"
    raise KeyFault(("sensor", "rate_hz"), f"is {sensor.rate_hz:g}, which {fault}")
