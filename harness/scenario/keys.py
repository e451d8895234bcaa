"""What a scenario file says: its sections as they were read. `resolving.resolve` fills in what follows from others."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, FailFast, Strict

from harness.scenario.environment import Environment, GroundSpec, SourceSpec
from harness.scenario.navigation import Navigation
from harness.scenario.obstacles import Obstacle
from harness.scenario.sections import (
    MAX_COORDINATE_M,
    AircraftSpec,
    Area,
    GuidanceSpec,
    MissionSpec,
    PlannerSpec,
    Section,
    Sensor,
    UncertaintySpec,
    key,
)
from harness.scenario.simulation import Simulation
from harness.scenario.validation import NAME_PATTERN


class TrackabilitySpec(Section):
    """What a leg of the flight may be off before it counts as not trackable."""

    cross_track_m: float = key(
        "Distance of the true position from the plan; what the planner keeps for navigation errors comes on top.",
        unit="m",
        derived="a tenth of planner.clearance_m where the file gives that, else 10 m",
        gt=0,
        le=MAX_COORDINATE_M,
    )
    altitude_m: float = key(
        "Distance from mission.altitude_m.",
        unit="m",
        derived="10 m",
        gt=0,
        le=MAX_COORDINATE_M,
    )
    airspeed_mps: float = key(
        "Error of the true airspeed, averaged over 20 s.",
        unit="m/s",
        derived="a tenth of aircraft.airspeed_mps",
        gt=0,
        le=1000,
    )
    load_factor: float = key(
        "Load factor, averaged over 1 s.",
        unit="1",
        derived="the limit manoeuvring load factor of 14 CFR 23.337 (amendment 23-48) for the aircraft's mass, "
        "2.1 + 24000 / (weight in lb + 10000) and at most 3.8",
        gt=1,
        le=20,
    )


class ScenarioKeys(Section):
    """One flight as a file describes it; flying it twice gives the same track bit for bit.

    Attributes equal the keys of the file, except `schema_`, which is `schema` there.
    """

    model_config = ConfigDict(title="Scenario")

    schema_: Literal["wayproof/scenario/1"] = key("Format and version.", alias="schema")
    name: str = key("Names the run folder.", pattern=NAME_PATTERN, max_length=100)
    seed: int = key("Root seed; every random stream derives from it.", unit="1", default=1, ge=0, le=2**53)
    area: Area = key("The area of operations.")
    obstacles: Annotated[tuple[Obstacle, ...], Strict(False), FailFast()] = key(
        "Unknown to the planner until sensed.", default=()
    )
    ground: GroundSpec | None = key(
        "The true ground. Default: that of terrain files among the obstacles.", default=None
    )
    sources: Annotated[tuple[SourceSpec, ...], Strict(False)] | None = key(
        "Files that obstacles and ground were made of. Default: none.", default=None
    )
    mission: MissionSpec = key("From where to where.")
    aircraft: AircraftSpec = key("What flies.", default_factory=AircraftSpec)
    sensor: Sensor = key("What it senses with.", default_factory=Sensor)
    planner: PlannerSpec = key("What plans.", default_factory=PlannerSpec)
    guidance: GuidanceSpec = key("What steers along the plan.", default_factory=GuidanceSpec)
    navigation: Navigation = key("What it believes of its state.", default_factory=Navigation)
    conditions: Literal["ideal", "typical", "rough"] = key(
        "What kind of day it is: fills what is left out of navigation, aircraft.actuators, environment, uncertainty. "
        "typical: an ordinary day of a small aircraft; rough: the worst on which one would fly.",
        default="ideal",
    )
    uncertainty: UncertaintySpec | None = key(
        "By how much the flown aircraft differs from its model, 1 sigma. Default: that of the conditions.",
        default=None,
    )
    simulation: Simulation = key("How finely it is integrated.", default_factory=Simulation)
    environment: Environment = key("The air.", default_factory=Environment)
    trackability: TrackabilitySpec = key(
        "What a leg may be off before it counts as not trackable.", default_factory=TrackabilitySpec
    )

    @property
    def given(self) -> dict[str, Any]:
        """What the file has, by attribute."""
        return {
            name: getattr(self, name) for name in type(self).model_fields if name in self.model_fields_set
        }

    def updated(self, **sections: Any) -> ScenarioKeys:
        """The same with some sections replaced."""
        return self.model_copy(update=sections)
