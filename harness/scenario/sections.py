"""Sections of a scenario file, attribute = key: metres in the local ENU plane, degrees clockwise from north."""

from __future__ import annotations

import ast
import inspect
import itertools
from functools import cache
from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, field_validator, model_validator

from harness.scenario.validation import KeyFault

MAX_COORDINATE_M, ALTITUDES_M = 1e6, (5, 20_000)  # largest coordinate or length; altitudes of a mission
SHIELDED: Final = "+shield"  # ending of the name of a planner that is flown with the shield
DERIVED: Final[Any] = None  # default of a key that follows from others: `resolving.resolve` fills it in


class Section(BaseModel):
    """A mapping of the file; the docstring below a key is its description in the JSON Schema."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)

    def filled(self, **defaults: Any) -> Self:
        """Returns a copy with those of the keys filled in that the file leaves out."""
        return self.model_copy(update={k: value for k, value in defaults.items() if getattr(self, k) is None})

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: Any, handler: Any) -> Any:
        """The JSON Schema, with what each key means."""
        schema = handler(core_schema)
        meanings = {name: text for each in reversed(cls.__mro__) for name, text in _docstrings(each).items()}
        for name, own in handler.resolve_ref_schema(schema).get("properties", {}).items():
            own.pop("title", None)
            own.setdefault("description", meanings.get(name) or meanings.get(f"{name}_"))
            if own.get("default", 0) is None or isinstance(own.get("default"), dict):
                del own["default"]
        return schema


@cache
def _docstrings(section: type) -> dict[str, str]:
    """The docstrings below the attributes of a section, by attribute; none of one that has no source text."""
    try:
        (body,) = ast.parse(inspect.getsource(section)).body
    except (OSError, TypeError):
        return {}
    return {
        ast.unparse(above.target): " ".join(str(ast.literal_eval(below.value)).split())
        for above, below in itertools.pairwise(getattr(body, "body", ()))
        if isinstance(above, ast.AnnAssign) and isinstance(below, ast.Expr)
    }


Coordinate = Annotated[float, Field(ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M)]
Point = Annotated[tuple[Coordinate, Coordinate], Strict(False)]
Bounds = Annotated[tuple[Coordinate, Coordinate, Coordinate, Coordinate], Strict(False)]
Length = Annotated[float, Field(gt=0, le=MAX_COORDINATE_M)]
Speed = Annotated[float, Field(ge=-1000, le=1000)]
Velocity = Annotated[tuple[Speed, Speed], Strict(False)]
Time = Annotated[float, Field(ge=0, le=1e7)]
Share = Annotated[float, Field(ge=0, le=1)]
Latitude = Annotated[float, Field(ge=-85, le=85)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
PitchLimits = tuple[Annotated[float, Field(ge=-90, lt=0)], Annotated[float, Field(gt=0, le=90)]]


def given(key: str) -> dict[str, Any]:
    """The JSON Schema of a mapping that has a key, and not as null."""
    return {"required": [key], "properties": {key: {"not": {"type": "null"}}}}


def in_order(span: tuple[float, float]) -> tuple[float, float]:
    """Returns a range as it is; a ValueError says that its ends stand the wrong way round."""
    if span[0] > span[1]:
        raise ValueError(f"is {list(span)}; must be [least, most]")
    return span


def _lasting(span: tuple[float, float]) -> tuple[float, float]:
    if not span[0] < span[1]:
        raise ValueError(f"is [{span[0]:g}, {span[1]:g}]; must be [from, to] with from < to")
    return span


Interval = Annotated[tuple[Time, Time], Strict(False), AfterValidator(_lasting)]


class Geodetic(Section):
    """A place on the WGS84 ellipsoid."""

    latitude_deg: Latitude
    """Geodetic latitude."""
    longitude_deg: Longitude
    """Longitude."""


class Origin(Geodetic):
    """Where ENU (0, 0) lies on the WGS84 ellipsoid."""

    latitude_deg: Latitude = 47.0
    longitude_deg: Longitude = 8.0


class Area(Section):
    """The area of operations, known to the planner."""

    bounds_m: Bounds
    """xmin, ymin, xmax, ymax of the area; the aircraft must not leave it."""
    origin: Origin = Origin()
    """Where ENU (0, 0) lies."""

    @field_validator("bounds_m")
    @classmethod
    def _span_an_area(cls, bounds_m: Bounds) -> Bounds:
        xmin, ymin, xmax, ymax = bounds_m
        if not (xmin < xmax and ymin < ymax):
            wanted = "[xmin, ymin, xmax, ymax] with xmin < xmax and ymin < ymax"
            raise ValueError(f"is {list(bounds_m)}; must be {wanted}")
        return bounds_m


class MissionSpec(Section):
    """From where to where."""

    model_config = ConfigDict(
        json_schema_extra={"allOf": [{"oneOf": [given(e), given(f"{e}_m")]} for e in ("start", "goal")]}
    )

    start: Geodetic | None = None
    """Start by latitude and longitude, in place of start_m."""
    start_m: Point = DERIVED
    """Start: east, north. Default: where start lies."""
    course_deg: Annotated[float, Field(ge=0, le=360)] = DERIVED
    """Course over the ground at the start. Default: towards the goal."""
    goal: Geodetic | None = None
    """Goal by latitude and longitude, in place of goal_m."""
    goal_m: Point = DERIVED
    """Goal: east, north. Default: where goal lies."""
    goal_radius_m: Length = DERIVED
    """Reached = the aircraft is inside this circle. Default: the planned turn radius, rounded up to 10 m."""
    altitude_m: Annotated[float, Field(ge=ALTITUDES_M[0], le=ALTITUDES_M[1])] = 300.0
    """Above mean sea level, held throughout."""
    time_limit_s: Annotated[float, Field(gt=0, le=1e7)] = DERIVED
    """Simulated, at most. Default: ten times the straight line at airspeed less wind and 60 s, in whole minutes."""

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
    """Servos of the surfaces and the throttle, all alike; 60 degrees of a servo's arm are full throttle.

    Keys that are left out: those of the conditions.
    """

    lag_s: Annotated[float, Field(ge=0, le=10)] = 0.0
    """Time constant of the lag of a surface behind its command."""
    rate_limit_degps: Annotated[float | None, Field(gt=0, le=100_000)] = None
    """Fastest motion of a surface. Default: that of the conditions; no limit for ideal."""
    deadband_deg: Annotated[float, Field(ge=0, le=90)] = 0.0
    """Width of the band about the trim in which a command moves nothing."""


class AutopilotSpec(Section):
    """What the autopilot may do, where that is other than the aircraft's card has it."""

    bank_limit_deg: Annotated[float | None, Field(ge=5, le=70)] = None
    """Largest bank that guidance may command. Default: that of the aircraft's card."""
    roll_rate_limit_degps: Annotated[float | None, Field(gt=0, le=720)] = None
    """Fastest roll that is commanded. Default: that of the aircraft's card."""
    roll_time_constant_s: Annotated[float | None, Field(ge=0.05, le=5)] = None
    """Time constant of roll behind its command. Default: that of the aircraft's card."""
    pitch_limits_deg: Annotated[PitchLimits, Strict(False)] = (-30.0, 30.0)
    """Least and largest pitch that is commanded."""
    least_airspeed_mps: Annotated[float | None, Field(gt=0, le=1000)] = None
    """Below this true airspeed height goes before speed. Default: 0.97 of the lowest of level flight."""
    state_latency_s: Annotated[float, Field(ge=0, le=2)] = DERIVED
    """Age of the attitude, airspeed and height that the autopilot flies by. Default: navigation.latency_s."""


MOST_SHARE: Final = 0.5  # largest deviation that is a share of a figure of the model, drawn or given
MOST_SHIFT_M: Final = 10.0  # largest shift of the centre of gravity from that of the model
Deviation = Annotated[float, Field(ge=-MOST_SHARE, le=MOST_SHARE)]


class DeviationSpec(Section):
    """By how much the flown aircraft is other than its model; guidance and autopilot stay tuned for the model."""

    mass: Deviation = DERIVED
    """Mass and inertias, as a share of the empty weight. Default: that of the conditions, 0 for ideal."""
    thrust: Deviation = DERIVED
    """Thrust, as a share. Default: that of the conditions, 0 for ideal."""
    drag: Deviation = DERIVED
    """Drag, as a share. Default: that of the conditions, 0 for ideal."""
    lift_slope: Deviation = DERIVED
    """Change of the lift with the angle of attack, as a share. Default: that of the conditions, 0 for ideal."""
    elevator: Deviation = DERIVED
    """Effect of the elevator, as a share. Default: that of the conditions, 0 for ideal."""
    aileron: Deviation = DERIVED
    """Effect of the ailerons, as a share. Default: that of the conditions, 0 for ideal."""
    rudder: Deviation = DERIVED
    """Effect of the rudder, as a share. Default: that of the conditions, 0 for ideal."""
    centre_of_gravity_m: Annotated[float, Field(ge=-MOST_SHIFT_M, le=MOST_SHIFT_M)] = DERIVED
    """How far the empty aircraft's centre of gravity is moved aft. Default: that of the conditions, 0 for ideal."""


Sigma = Annotated[float, Field(ge=0, le=MOST_SHARE)]


class UncertaintySpec(DeviationSpec):
    """1 sigma of each deviation of the flown aircraft, at least 0; they are drawn from the seed."""

    mass: Sigma = DERIVED
    thrust: Sigma = DERIVED
    drag: Sigma = DERIVED
    lift_slope: Sigma = DERIVED
    elevator: Sigma = DERIVED
    aileron: Sigma = DERIVED
    rudder: Sigma = DERIVED
    centre_of_gravity_m: Annotated[float, Field(ge=0, le=MOST_SHIFT_M)] = DERIVED


class AircraftSpec(Section):
    """What flies, and how fast."""

    model: Annotated[str, Field(min_length=1, max_length=1000)] = "aerosonde"
    """A name that `wayproof list aircraft` prints, or a folder."""
    airspeed_mps: Annotated[float, Field(gt=0, le=1000)] = DERIVED
    """True airspeed, held throughout; must lie in the aircraft's range. Default: the aircraft's cruising speed."""
    actuators: ActuatorsSpec | None = None
    """Servos behind the autopilot. Default: those of the aircraft, else of the conditions, or none."""
    autopilot: AutopilotSpec | None = None
    """What the autopilot may do. Default: as the aircraft's card has it."""
    deviation: DeviationSpec | None = None
    """How the flown aircraft differs from its model. Default: drawn with the uncertainty, else not at all."""


class Sensor(Section):
    """A planar range sensor: each of its beams returns the distance to the nearest obstacle edge within it."""

    beam_deg: Annotated[float, Field(ge=0, le=120)] = DERIVED
    """Width of each beam; 0: pencil rays. Default: field_of_view_deg / rays: beams touch, nothing fits between."""
    least_width_m: Length = DERIVED
    """Width of the narrowest obstacle. It counts where beams do not touch: free is seen only as far as nothing so wide
    can hide between two of them. Default: planner.clearance_m."""
    range_m: Length = DERIVED
    """Largest distance a beam sees. Default: ten times the planned turn radius, rounded up to 100 m."""
    field_of_view_deg: Annotated[float, Field(gt=0, le=360)] = 360.0
    """Centred on the nose."""
    rays: Annotated[int, Field(ge=3, le=100_000)] = 720
    """Beams, their axes spread evenly over the field of view."""
    rate_hz: Annotated[float, Field(ge=0.01, le=1200)] = 2.0
    """Scans per simulated second; must divide simulation.rate_hz."""
    range_noise_m: Annotated[float, Field(ge=0, le=MAX_COORDINATE_M)] = 0.0
    """1 sigma of additive Gaussian noise on every range."""
    dropout: Share = 0.0
    """Probability that a beam returns nothing."""
    false_return: Share = 0.0
    """Probability that a beam returns a random range."""
    latency_s: Annotated[float, Field(ge=0, le=60)] = 0.0
    """A scan becomes available this much later."""


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

    kind: str = "rolling_window"
    """A name that `wayproof list planners` prints."""
    clearance_m: Annotated[float, Field(ge=0, le=MAX_COORDINATE_M)] = DERIVED
    """Wanted distance from obstacles; 0.02 turn radii are kept anyway. Default: the turn radius, rounded up to 10 m."""
    compute_latency_s: Annotated[float, Field(ge=0, le=60)] = 0.0
    """A plan takes effect this much after the scan it used."""
    shield: Literal["none", "loiter"] = DERIVED
    """loiter: a path is flown only as far as a turn was seen free. Default: loiter for rolling_window, else none."""

    @model_validator(mode="before")
    @classmethod
    def _shield_of_kind(cls, data: Any) -> Any:
        """`kind: NAME+shield` as `kind: NAME, shield: loiter`."""
        if not isinstance(data, dict) or not str(data.get("kind", "")).endswith(SHIELDED):
            return data
        if data.get("shield", "loiter") != "loiter":
            text = f"shield is {data['shield']}, and kind {data['kind']}"
            raise ValueError(f"{text}; must be loiter or left out, or kind without {SHIELDED}")
        return {**data, "kind": data["kind"].removesuffix(SHIELDED), "shield": "loiter"}

    @property
    def label(self) -> str:
        """The kind, and whether it has another shield than usual: what tells flights of one kind apart."""
        suffixes = {"none": "-bare"} if self.kind == "rolling_window" else {"loiter": SHIELDED}
        return self.kind + suffixes.get(self.shield, "")


class GuidanceSpec(PartSpec):
    """Which guidance law flies the plan; the law's own keys stand beside these."""

    kind: str = "preview"
    """A name that `wayproof list guidance` prints."""
    follow: Literal["path", "waypoints"] = "path"
    """path: the law follows the plan's lines and arcs; waypoints: straight legs between the corners of the plan."""
    acceptance_radius_m: Annotated[float | None, Field(gt=0, le=100_000)] = None
    """A waypoint counts as reached from here, with follow: waypoints. Default: by the rule of the law's autopilot."""
