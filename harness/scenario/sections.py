"""The sections of a scenario file as frozen types: attribute = key.

Units are SI and stand in every name. Positions are metres in the local ENU plane, x = east, y = north;
courses and wind directions are degrees clockwise from north.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, Strict, field_validator, model_validator

from harness.scenario.validation import KeyFault

MAX_COORDINATE_M: Final = 1e6
ALTITUDES_M: Final = (5, 20_000)
SHIELDED: Final = "+shield"
"""What a planner's name ends with that is flown with the shield."""

_UNITS: Final = {
    "m": "m", "mps": "m/s", "s": "s", "hz": "Hz", "deg": "deg", "degps": "deg/s", "1pkm2": "1/km2", "cell": "m"
}  # fmt: skip
"""Unit of a key by the last part of its name."""


def key(doc: str, default: Any = ..., *, derived: str | None = None, **bounds: Any) -> Any:
    """One key of the format; its unit is told by its name.

    Args:
        doc: what it means, a sentence for the JSON Schema.
        default: its default; none makes the key required.
        derived: instead of a default, how it follows from other keys (filled in by `resolving.resolve`).
        **bounds: `default_factory`, `gt`, `ge`, `le`, `pattern` and the like, as pydantic's `Field` has them.
    """

    def describe(schema: dict[str, Any]) -> None:
        schema.pop("title", None)
        if derived:
            del schema["default"]

    if derived:
        doc, default = f"{doc} Default: {derived}.", None
    if "default_factory" not in bounds:
        bounds["default"] = default
    return Field(description=doc, json_schema_extra=describe, **bounds)


class Section(BaseModel):
    """A mapping of the file: frozen, no unknown key, no conversion of types, finite numbers only."""

    model_config = ConfigDict(
        frozen=True, strict=True, extra="forbid", allow_inf_nan=False, protected_namespaces=()
    )

    def filled(self, **defaults: Any) -> Self:
        """The same with those keys filled in that the file leaves out."""
        missing = {name: value for name, value in defaults.items() if getattr(self, name) is None}
        return self.model_copy(update=missing)

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: Any, handler: Any) -> Any:
        """The JSON Schema, with the unit of every number."""
        schema = handler(core_schema)
        for name, own in handler.resolve_ref_schema(schema).get("properties", {}).items():
            kinds = {each.get("type") for each in own.get("anyOf", [own])}
            unit = _UNITS.get(name.rpartition("_")[2], "1" if kinds & {"number", "integer"} else None)
            if unit and not kinds & {None, "string", "object"}:
                own["unit"] = unit
        return schema


Coordinate = Annotated[float, Field(ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M)]
Point = Annotated[tuple[Coordinate, Coordinate], Strict(False)]
Bounds = Annotated[tuple[Coordinate, Coordinate, Coordinate, Coordinate], Strict(False)]
Length = Annotated[float, Field(gt=0, le=MAX_COORDINATE_M)]
Speed = Annotated[float, Field(ge=-1000, le=1000)]
Velocity = Annotated[tuple[Speed, Speed], Strict(False)]
Time = Annotated[float, Field(ge=0, le=1e7)]
Interval = Annotated[tuple[Time, Time], Strict(False)]
Share = Annotated[float, Field(ge=0, le=1)]
Latitude = Annotated[float, Field(ge=-85, le=85)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
PitchLimit = Annotated[float, Field(ge=-90, le=90)]


class Origin(Section):
    """Where ENU (0, 0) lies on the WGS84 ellipsoid."""

    latitude_deg: Latitude = key("Geodetic latitude.", 47.0)
    longitude_deg: Longitude = key("Longitude.", 8.0)


class Area(Section):
    """The area of operations, known to the planner."""

    bounds_m: Bounds = key("xmin, ymin, xmax, ymax of the area; the aircraft must not leave it.")
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

    latitude_deg: Latitude = key("Geodetic latitude.")
    longitude_deg: Longitude = key("Longitude.")


class MissionSpec(Section):
    """From where to where."""

    model_config = ConfigDict(
        json_schema_extra={
            "allOf": [{"oneOf": [{"required": [e]}, {"required": [f"{e}_m"]}]} for e in ("start", "goal")]
        }
    )

    start: Geodetic | None = key("Start by latitude and longitude, in place of start_m.", None)
    start_m: Point = key("Start: east, north.", derived="where start lies")
    course_deg: float = key("Course over the ground at the start.", derived="towards the goal", ge=0, le=360)
    goal: Geodetic | None = key("Goal by latitude and longitude, in place of goal_m.", None)
    goal_m: Point = key("Goal: east, north.", derived="where goal lies")
    goal_radius_m: Length = key(
        "Reached = the aircraft is inside this circle.", derived="the planned turn radius, rounded up to 10 m"
    )
    altitude_m: float = key(
        "Above mean sea level, held throughout.", 300.0, ge=ALTITUDES_M[0], le=ALTITUDES_M[1]
    )
    time_limit_s: float = key(
        "Simulated time after which the flight ends.",
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

    lag_s: float = key("Time constant of the lag of a surface behind its command.", 0.0, ge=0, le=10)
    rate_limit_degps: float | None = key(
        "Fastest motion of a surface. Default: no limit.", None, gt=0, le=100_000
    )
    deadband_deg: float = key(
        "Width of the band about the trim in which a command moves nothing.", 0.0, ge=0, le=90
    )


class AutopilotSpec(Section):
    """What the autopilot may do, where that is other than the aircraft's card has it."""

    bank_limit_deg: float | None = key(
        "Largest bank that guidance may command. Default: that of the aircraft's card.", None, ge=5, le=70
    )
    roll_rate_limit_degps: float | None = key(
        "Fastest roll that is commanded. Default: that of the aircraft's card.", None, gt=0, le=720
    )
    roll_time_constant_s: float | None = key(
        "Time constant of roll behind its command. Default: that of the aircraft's card.", None, ge=0.05, le=5
    )
    pitch_limits_deg: Annotated[tuple[PitchLimit, PitchLimit], Strict(False)] = key(
        "Least and largest pitch that is commanded.", (-30.0, 30.0)
    )
    least_airspeed_mps: float | None = key(
        "Below this true airspeed height goes before speed. Default: 0.97 of the lowest of level flight.",
        None,
        gt=0,
        le=1000,
    )
    state_latency_s: float = key(
        "Age of attitude, airspeed and height that the autopilot works with; it and guidance are tuned for it.",
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


MOST_SHARE: Final = 0.5
"""A deviation that is a share is no larger, drawn or given."""
MOST_SHIFT_M: Final = 10.0
"""The centre of gravity lies no further from that of the model."""


def _deviation(what: str, most: float = MOST_SHARE) -> Any:
    return key(f"{what}.", derived="that of the conditions, 0 for ideal", ge=-most, le=most)


class DeviationSpec(Section):
    """By how much the flown aircraft is other than its model; guidance and autopilot stay tuned for the model."""

    mass: float = _deviation("Mass and inertias, as a share of the empty weight")
    thrust: float = _deviation("Thrust, as a share")
    drag: float = _deviation("Drag, as a share")
    lift_slope: float = _deviation("Change of the lift with the angle of attack, as a share")
    elevator: float = _deviation("Effect of the elevator, as a share")
    aileron: float = _deviation("Effect of the ailerons, as a share")
    rudder: float = _deviation("Effect of the rudder, as a share")
    centre_of_gravity_m: float = _deviation(
        "How far the centre of gravity lies behind that of the model", MOST_SHIFT_M
    )


class UncertaintySpec(DeviationSpec):
    """1 sigma of each deviation of the flown aircraft, at least 0; they are drawn from the seed."""

    @model_validator(mode="after")
    def _none_below_zero(self) -> UncertaintySpec:
        for name, value in self:
            if value is not None and value < 0.0:
                raise KeyFault((name,), f"is {value:g}; must be at least 0")
        return self


class AircraftSpec(Section):
    """What flies, and how fast."""

    model: str = key(
        "A name that `wayproof list aircraft` prints, or a folder.",
        "aerosonde",
        min_length=1,
        max_length=1000,
    )
    airspeed_mps: float = key(
        "True airspeed, held throughout; must lie in the aircraft's range.",
        derived="the aircraft's cruising speed",
        gt=0,
        le=1000,
    )
    actuators: ActuatorsSpec | None = key(
        "Servos behind the autopilot. Default: those of the aircraft, else of the conditions, or none.", None
    )
    autopilot: AutopilotSpec | None = key(
        "What the autopilot may do. Default: as the aircraft's card has it.", None
    )
    deviation: DeviationSpec | None = key(
        "How the flown aircraft differs from its model. Default: drawn with the uncertainty, else not at all.",
        None,
    )


class Sensor(Section):
    """A planar range sensor: each of its beams returns the distance to the nearest obstacle edge within it."""

    beam_deg: float = key(
        "Width of each beam. Beams that touch leave no room for anything between two; 0: pencil rays.",
        derived="field_of_view_deg / rays, so that beams touch",
        ge=0,
        le=120,
    )
    least_width_m: Length = key(
        "Width of the narrowest obstacle that there is. It counts where beams do not touch: space is taken to be seen "
        "free only as far as nothing so wide can hide between two of them.",
        derived="planner.clearance_m",
    )
    range_m: Length = key(
        "Largest distance a beam sees.", derived="ten times the planned turn radius, rounded up to 100 m"
    )
    field_of_view_deg: float = key("Centred on the nose.", 360.0, gt=0, le=360)
    rays: int = key("Beams, their axes spread evenly over the field of view.", 720, ge=3, le=100_000)
    rate_hz: float = key("Scans per simulated second; must divide simulation.rate_hz.", 2.0, ge=0.01, le=1200)
    range_noise_m: float = key(
        "1 sigma of additive Gaussian noise on every range.", 0.0, ge=0, le=MAX_COORDINATE_M
    )
    dropout: Share = key("Probability that a beam returns nothing.", 0.0)
    false_return: Share = key("Probability that a beam returns a random range.", 0.0)
    latency_s: float = key("A scan becomes available this much later.", 0.0, ge=0, le=60)


class PartSpec(Section):
    """Which planner or guidance law flies; the own keys of its kind stand beside those that all kinds share."""

    # The own keys are held against the config of the kind by `parts`.
    model_config = ConfigDict(extra="allow")

    kind: str

    @property
    def own(self) -> dict[str, Any]:
        """The own keys of the kind."""
        return dict(self.__pydantic_extra__ or {})


class PlannerSpec(PartSpec):
    """Which planner, and what it has to keep; the planner's own keys stand beside these."""

    kind: str = key("A name that `wayproof list planners` prints.", "rolling_window")
    clearance_m: float = key(
        "Wanted distance from every obstacle edge; the boundary must only not be crossed. Planners keep a fiftieth of "
        "the turn radius at the least.",
        derived="the planned turn radius, rounded up to 10 m",
        ge=0,
        le=MAX_COORDINATE_M,
    )
    compute_latency_s: float = key("A plan takes effect this much after the scan it used.", 0.0, ge=0, le=60)
    shield: Literal["none", "loiter"] = key(
        "loiter: a path is flown only as far as a turn from there has been seen to be free; none: as the planner gives "
        "it. A kind with +shield at its end means loiter.",
        derived="loiter for rolling_window, none for every other kind",
    )

    @model_validator(mode="before")
    @classmethod
    def _shield_of_kind(cls, data: Any) -> Any:
        """`kind: NAME+shield` as `kind: NAME, shield: loiter`."""
        if not isinstance(data, dict) or not str(data.get("kind", "")).endswith(SHIELDED):
            return data
        if data.get("shield", "loiter") != "loiter":
            raise ValueError(f"shield is {data['shield']}, and kind {data['kind']}")
        return {**data, "kind": data["kind"].removesuffix(SHIELDED), "shield": "loiter"}

    @property
    def label(self) -> str:
        """The kind, and whether it has another shield than usual: what tells flights of one kind apart."""
        told = {"none": "-bare"} if self.kind == "rolling_window" else {"loiter": SHIELDED}
        return self.kind + told.get(self.shield, "")


class GuidanceSpec(PartSpec):
    """Which guidance law flies the plan; the law's own keys stand beside these."""

    kind: str = key("A name that `wayproof list guidance` prints.", "preview")
    follow: Literal["path", "waypoints"] = key(
        "path: the law follows the plan's lines and arcs; waypoints: straight legs between the corners of the plan, as "
        "a mission on an autopilot.",
        "path",
    )
    acceptance_radius_m: float | None = key(
        "A waypoint counts as reached from here, with follow: waypoints. Default: by the rule of the law's autopilot.",
        None,
        gt=0,
        le=100_000,
    )
