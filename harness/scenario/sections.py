"""The sections of a scenario file as frozen types: attribute = key.

Units are SI and stand in every name. Positions are metres in the local ENU plane, x = east, y = north;
courses and wind directions are degrees clockwise from north.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, Strict, field_validator, model_validator

from harness.scenario.validation import KeyFault

MAX_COORDINATE_M: Final = 1e6
ALTITUDES_M: Final = (5, 20_000)


def key(
    doc: str, *, unit: str | None = None, default: Any = ..., derived: str | None = None, **bounds: Any
) -> Any:
    """One key of the format.

    Args:
        doc: what it means, a sentence for the JSON Schema.
        unit: its unit.
        default: its default; none makes the key required.
        derived: instead of a default, how it follows from other keys (filled in by `Scenario`).
        **bounds: `default_factory`, `gt`, `ge`, `le`, `pattern` and the like, as pydantic's `Field` has them.
    """

    def describe(schema: dict[str, Any]) -> None:
        schema.pop("title", None)
        if unit:
            schema["unit"] = unit
        if derived:
            del schema["default"]

    if derived:
        doc, default = f"{doc} Default: {derived}.", None
    if "default_factory" in bounds:
        return Field(description=doc, json_schema_extra=describe, **bounds)
    return Field(default, description=doc, json_schema_extra=describe, **bounds)


class Section(BaseModel):
    """A mapping of the file: frozen, no unknown key, no conversion of types, finite numbers only."""

    model_config = ConfigDict(
        frozen=True, strict=True, extra="forbid", allow_inf_nan=False, protected_namespaces=()
    )


Coordinate = Annotated[float, Field(ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M)]
Point = Annotated[tuple[Coordinate, Coordinate], Strict(False)]
Bounds = Annotated[tuple[Coordinate, Coordinate, Coordinate, Coordinate], Strict(False)]
Speed = Annotated[float, Field(ge=-1000, le=1000)]
Velocity = Annotated[tuple[Speed, Speed], Strict(False)]
Time = Annotated[float, Field(ge=0, le=1e7)]
Interval = Annotated[tuple[Time, Time], Strict(False)]


class Origin(Section):
    """Where ENU (0, 0) lies on the WGS84 ellipsoid."""

    latitude_deg: float = key("Geodetic latitude.", unit="deg", default=47.0, ge=-85, le=85)
    longitude_deg: float = key("Longitude.", unit="deg", default=8.0, ge=-180, le=180)


class Area(Section):
    """The area of operations, known to the planner."""

    bounds_m: Bounds = key("xmin, ymin, xmax, ymax of the area; the aircraft must not leave it.", unit="m")
    origin: Origin = key("Where ENU (0, 0) lies.", default_factory=Origin)

    @field_validator("bounds_m")
    @classmethod
    def _span_an_area(cls, bounds_m: Bounds) -> Bounds:
        xmin, ymin, xmax, ymax = bounds_m
        if not (xmin < xmax and ymin < ymax):
            raise ValueError(
                f"is {list(bounds_m)}; must be [xmin, ymin, xmax, ymax] with xmin < xmax and ymin < ymax"
            )
        return bounds_m


class Geodetic(Section):
    """A place on the WGS84 ellipsoid."""

    latitude_deg: float = key("Geodetic latitude.", unit="deg", ge=-85, le=85)
    longitude_deg: float = key("Longitude.", unit="deg", ge=-180, le=180)


class MissionSpec(Section):
    """From where to where."""

    model_config = ConfigDict(
        json_schema_extra={
            "allOf": [
                {"oneOf": [{"required": [end]}, {"required": [f"{end}_m"]}]} for end in ("start", "goal")
            ]
        }
    )

    start: Geodetic | None = key("Start by latitude and longitude, in place of start_m.", default=None)
    start_m: Point = key("Start: east, north.", unit="m", derived="where start lies")
    course_deg: float = key(
        "Course over the ground at the start.", unit="deg", derived="towards the goal", ge=0, le=360
    )
    goal: Geodetic | None = key("Goal by latitude and longitude, in place of goal_m.", default=None)
    goal_m: Point = key("Goal: east, north.", unit="m", derived="where goal lies")
    goal_radius_m: float = key(
        "Reached = the aircraft is inside this circle.",
        unit="m",
        derived="the planned turn radius, rounded up to 10 m",
        gt=0,
        le=MAX_COORDINATE_M,
    )
    altitude_m: float = key(
        "Above mean sea level, held throughout.",
        unit="m",
        default=300.0,
        ge=ALTITUDES_M[0],
        le=ALTITUDES_M[1],
    )
    time_limit_s: float = key(
        "Simulated time after which the flight ends.",
        unit="s",
        derived="ten times the straight line at airspeed less wind and one minute, rounded up to a minute",
        gt=0,
        le=1e7,
    )

    @model_validator(mode="after")
    def _has_each_end_once(self) -> MissionSpec:
        for name in ("start", "goal"):
            given, metres = getattr(self, name), getattr(self, f"{name}_m")
            if given is not None and metres is not None:
                raise KeyFault((name,), f"is given beside {name}_m; must be one of them")
            if given is None and metres is None:
                raise KeyFault((f"{name}_m",), f"is missing; it is required, or {name} in degrees")
        return self


class ActuatorsSpec(Section):
    """Servos of the surfaces and the throttle, all alike; 60 degrees of a servo's arm are full throttle."""

    lag_s: float = key(
        "Time constant of the lag of a surface behind its command.", unit="s", default=0.0, ge=0, le=10
    )
    rate_limit_degps: float | None = key(
        "Fastest motion of a surface. Default: no limit.", unit="deg/s", default=None, gt=0, le=100_000
    )
    deadband_deg: float = key(
        "Width of the band about the trim in which a command moves nothing.",
        unit="deg",
        default=0.0,
        ge=0,
        le=90,
    )


PitchLimit = Annotated[float, Field(ge=-90, le=90)]


class AutopilotSpec(Section):
    """What the autopilot may do, where that is other than the aircraft's card has it."""

    bank_limit_deg: float | None = key(
        "Largest bank that guidance may command. Default: that of the aircraft's card.",
        unit="deg",
        default=None,
        ge=5,
        le=70,
    )
    roll_rate_limit_degps: float | None = key(
        "Fastest roll that is commanded. Default: that of the aircraft's card.",
        unit="deg/s",
        default=None,
        gt=0,
        le=720,
    )
    roll_time_constant_s: float | None = key(
        "Time constant of roll behind its command. Default: that of the aircraft's card.",
        unit="s",
        default=None,
        ge=0.05,
        le=5,
    )
    pitch_limits_deg: Annotated[tuple[PitchLimit, PitchLimit], Strict(False)] = key(
        "Least and largest pitch that is commanded.", unit="deg", default=(-30.0, 30.0)
    )
    least_airspeed_mps: float | None = key(
        "Below this true airspeed height goes before speed. Default: 0.97 of the lowest of level flight.",
        unit="m/s",
        default=None,
        gt=0,
        le=1000,
    )
    state_latency_s: float = key(
        "Age of attitude, airspeed and height that the autopilot works with; it and guidance are tuned for it.",
        unit="s",
        derived="navigation.latency_s",
        ge=0,
        le=2,
    )

    @model_validator(mode="after")
    def _pitch_in_order(self) -> AutopilotSpec:
        least, most = self.pitch_limits_deg
        if not -90.0 <= least < 0.0 < most <= 90.0:
            raise KeyFault(
                ("pitch_limits_deg",),
                f"is [{least:g}, {most:g}]; must be a negative and a positive angle to 90 degrees",
            )
        return self


SHARES: Final = {
    "mass": "Mass and inertias, as a share of the empty weight",
    "thrust": "Thrust, as a share",
    "drag": "Drag, as a share",
    "lift_slope": "Change of the lift with the angle of attack, as a share",
    "elevator": "Effect of the elevator, as a share",
    "aileron": "Effect of the ailerons, as a share",
    "rudder": "Effect of the rudder, as a share",
}
"""What of an aircraft may be other than its model has it; beside it the centre of gravity, in m."""


def _share(name: str, what: str, derived: str, least: float) -> Any:
    return key(f"{SHARES[name]}{what}.", unit="1", derived=derived, ge=least, le=0.5)


class DeviationSpec(Section):
    """By how much the flown aircraft is other than its model; guidance and autopilot stay tuned for the model."""

    mass: float = _share("mass", "", "drawn", -0.5)
    thrust: float = _share("thrust", "", "drawn", -0.5)
    drag: float = _share("drag", "", "drawn", -0.5)
    lift_slope: float = _share("lift_slope", "", "drawn", -0.5)
    elevator: float = _share("elevator", "", "drawn", -0.5)
    aileron: float = _share("aileron", "", "drawn", -0.5)
    rudder: float = _share("rudder", "", "drawn", -0.5)
    centre_of_gravity_m: float = key(
        "How far the centre of gravity lies behind that of the model.",
        unit="m",
        derived="drawn",
        ge=-10,
        le=10,
    )


class UncertaintySpec(Section):
    """1 sigma of each deviation of the flown aircraft, which is drawn from the seed; see aircraft.deviation."""

    mass: float = _share("mass", ", 1 sigma", "that of the conditions, 0 for ideal", 0)
    thrust: float = _share("thrust", ", 1 sigma", "that of the conditions, 0 for ideal", 0)
    drag: float = _share("drag", ", 1 sigma", "that of the conditions, 0 for ideal", 0)
    lift_slope: float = _share("lift_slope", ", 1 sigma", "that of the conditions, 0 for ideal", 0)
    elevator: float = _share("elevator", ", 1 sigma", "that of the conditions, 0 for ideal", 0)
    aileron: float = _share("aileron", ", 1 sigma", "that of the conditions, 0 for ideal", 0)
    rudder: float = _share("rudder", ", 1 sigma", "that of the conditions, 0 for ideal", 0)
    centre_of_gravity_m: float = key(
        "Place of the centre of gravity, fore and aft, 1 sigma.",
        unit="m",
        derived="that of the conditions, 0 for ideal",
        ge=0,
        le=3,
    )


class AircraftSpec(Section):
    """What flies, and how fast."""

    model: str = key(
        "A name that `wayproof list aircraft` prints, or a folder.",
        default="aerosonde",
        min_length=1,
        max_length=1000,
    )
    airspeed_mps: float = key(
        "True airspeed, held throughout; must lie in the aircraft's range.",
        unit="m/s",
        derived="the aircraft's cruising speed",
        gt=0,
        le=1000,
    )
    actuators: ActuatorsSpec | None = key(
        "Servos behind the autopilot. Default: those of the aircraft, else of the conditions, or none.",
        default=None,
    )
    autopilot: AutopilotSpec | None = key(
        "What the autopilot may do. Default: as the aircraft's card has it.", default=None
    )
    deviation: DeviationSpec | None = key(
        "How the flown aircraft differs from its model. Default: drawn with the uncertainty, else not at all.",
        default=None,
    )


class Sensor(Section):
    """A planar range sensor: each of its beams returns the distance to the nearest obstacle edge within it."""

    beam_deg: float = key(
        "Width of each beam. Beams that touch leave no room for anything between two; 0: pencil rays.",
        unit="deg",
        derived="field_of_view_deg / rays, so that beams touch",
        ge=0,
        le=120,
    )
    least_width_m: float = key(
        "Width of the narrowest obstacle that there is. It counts where beams do not touch: space is taken to be seen "
        "free only as far as nothing so wide can hide between two of them.",
        unit="m",
        derived="planner.clearance_m",
        gt=0,
        le=MAX_COORDINATE_M,
    )
    range_m: float = key(
        "Largest distance a beam sees.",
        unit="m",
        derived="ten times the planned turn radius, rounded up to 100 m",
        gt=0,
        le=MAX_COORDINATE_M,
    )
    field_of_view_deg: float = key("Centred on the nose.", unit="deg", default=360.0, gt=0, le=360)
    rays: int = key(
        "Beams, their axes spread evenly over the field of view.",
        unit="1",
        default=720,
        ge=3,
        le=100_000,
    )
    rate_hz: float = key(
        "Scans per simulated second; must divide simulation.rate_hz.",
        unit="Hz",
        default=2.0,
        ge=0.01,
        le=1200,
    )
    range_noise_m: float = key(
        "1 sigma of additive Gaussian noise on every range.", unit="m", default=0.0, ge=0, le=MAX_COORDINATE_M
    )
    dropout: float = key("Probability that a beam returns nothing.", unit="1", default=0.0, ge=0, le=1)
    false_return: float = key(
        "Probability that a beam returns a random range.", unit="1", default=0.0, ge=0, le=1
    )
    latency_s: float = key("A scan becomes available this much later.", unit="s", default=0.0, ge=0, le=60)


class GuidanceSpec(Section):
    """Which guidance law flies the plan; the law's own keys stand beside these."""

    # The own keys depend on the kind: `Scenario` holds them against the law's config.
    model_config = ConfigDict(extra="allow")

    kind: str = key("A name that `wayproof list guidance` prints.", default="preview")
    follow: Literal["path", "waypoints"] = key(
        "path: the law follows the plan's lines and arcs; waypoints: straight legs between the corners of the plan, as "
        "a mission on an autopilot.",
        default="path",
    )
    acceptance_radius_m: float | None = key(
        "A waypoint counts as reached from here, with follow: waypoints. Default: by the rule of the law's autopilot.",
        unit="m",
        default=None,
        gt=0,
        le=100_000,
    )

    @property
    def own(self) -> dict[str, Any]:
        """The law's own keys."""
        return dict(self.__pydantic_extra__ or {})
