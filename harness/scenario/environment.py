"""The air and the ground of a scenario, and the files that obstacles were made of: frozen types, attribute = key."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, Strict, model_validator

from harness.scenario.sections import MAX_COORDINATE_M, Point, Section, Time
from harness.scenario.validation import KeyFault

if TYPE_CHECKING:
    from harness.world_files.height_field import HeightField

Spacing = Annotated[float, Field(gt=0, le=MAX_COORDINATE_M)]

HEIGHT_STEP_M = 0.1  # heights of the ground are rounded to this, or coarser where they span more than 6.5 km


class GroundSpec(Section):
    """The true height of the ground on a grid, bilinear in between; wayproof writes it from terrain files."""

    corner_m: Point
    """South-western node, or with a lattice the place that it counts from: east, north."""
    spacing_m: Annotated[tuple[Spacing, Spacing], Strict(False)]
    """From node to node: east, north; with a lattice the least between two columns and between two rows."""
    rows: Annotated[int, Field(ge=1, le=100_000)]
    """Nodes from south to north."""
    columns: Annotated[int, Field(ge=1, le=100_000)]
    """Nodes from west to east."""
    lowest_m: Annotated[float, Field(ge=-12_000, le=9000)]
    """Height of the number 0, above mean sea level."""
    step_m: Annotated[float, Field(gt=0, le=10)] = HEIGHT_STEP_M
    """Height from a number to the next."""
    lattice: Annotated[tuple[float, ...], Strict(False), Field(min_length=8, max_length=162)] | None = None
    """Column and row of a place: for each k x k coefficients, by powers of east and north. Default: upright."""
    scale_m: Spacing = 1.0
    """Length that east and north are divided by for the lattice."""
    heights: Annotated[str, Field(min_length=1)]
    """Heights: base64 of zlib of 16-bit little-endian steps from the west, row by row from the south; 65535: none."""

    @model_validator(mode="after")
    def _can_be_unpacked(self) -> GroundSpec:
        self.field()
        return self

    def field(self) -> HeightField:
        """Unpacks the heights; raises a ValueError if the text does not hold them, or the lattice is none."""
        from harness.world_files.height_field import HeightField, unpacked

        heights_m = unpacked(self.heights, self.rows, self.columns, self.lowest_m, self.step_m)
        if self.lattice is None:
            return HeightField(self.corner_m, self.spacing_m, heights_m)
        side = math.isqrt(len(self.lattice) // 2)
        lattice = np.array(self.lattice).reshape(2, side, side)
        np.linalg.inv(lattice[:, [1, 0], [0, 1]])
        return HeightField(self.corner_m, self.spacing_m, heights_m, lattice, self.scale_m)

    @classmethod
    def of(cls, field: HeightField) -> GroundSpec:
        """The section that holds a height field, to a tenth of a metre, or to 1 / 60,000 of what its heights span."""
        from harness.world_files.height_field import packed

        keys = {name: getattr(field, name) for name in ("corner_m", "spacing_m", "scale_m")}
        keys["rows"], keys["columns"] = field.heights_m.shape
        keys["lowest_m"] = low_m = float(np.floor(np.nanmin(field.heights_m)))
        keys["step_m"] = step_m = max(HEIGHT_STEP_M, float(np.nanmax(field.heights_m) - low_m) / 60_000)
        lattice = None if field.lattice is None else tuple(field.lattice.ravel().tolist())
        return cls.model_construct(**keys, lattice=lattice, heights=packed(field.heights_m, low_m, step_m))


class SourceSpec(Section):
    """A file that obstacles or ground were made of; wayproof writes it, and does not read it again."""

    path: Annotated[str, Field(min_length=1, max_length=1000)]
    """The file, as the scenario named it."""
    kind: Annotated[str, Field(min_length=1, max_length=40)]
    """Its kind."""
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    """SHA-256 of its bytes."""
    polygons: Annotated[int, Field(ge=0)]
    """How many obstacles were made of it."""
    altitude_m: float | None = None
    """Altitude they are cut at; the scenario flies at no other. Default: they are the same at all."""
    in_layers: bool = False
    """It was looked at in layers along a path of several altitudes: none of its obstacles stand in the scenario."""
    notes: Annotated[tuple[Annotated[str, Field(min_length=1)], ...], Strict(False)] = ()
    """What was assumed or passed over. Default: nothing."""


WindSpeed = Annotated[float, Field(ge=0, le=200)]
Direction = Annotated[float, Field(ge=0, le=360)]
Change = Annotated[tuple[Time, WindSpeed, Direction], Strict(False)]


class Wind(Section):
    """Wind, the same everywhere at one height and time; steady unless changes are given."""

    speed_mps: WindSpeed = 0.0
    """Wind speed; must be below 0.9 of the airspeed. Default: that of the conditions, its height and changes too."""
    from_deg: Direction = 270.0
    """Direction it blows from. Default: that of the conditions, 270 for ideal."""
    measured_at_m: Annotated[float | None, Field(ge=1, le=300)] = None
    """Height over ground of these speeds, for the profile of MIL-F-8785C. Default: the same at all heights."""
    changes: Annotated[tuple[Change, ...], Strict(False), Field(max_length=10_000)] = ()
    """Later winds: time in s, speed in m/s, direction in degrees, each; linear in between, and the last one stays."""

    @model_validator(mode="after")
    def _check_times(self) -> Wind:
        times = (0.0, *(time_s for time_s, _, _ in self.changes))
        for index, (before, time_s) in enumerate(itertools.pairwise(times)):
            if not before < time_s:
                text = f"is at {time_s:g} s; must be later than {before:g} s, the one before"
                raise KeyFault(("changes", index), text)
        return self

    @property
    def fastest_mps(self) -> float:
        """Largest speed at any time, at the height at which they are measured."""
        return max(self.speed_mps, *(speed for _, speed, _ in self.changes), 0.0)

    @property
    def text(self) -> str:
        """Speed, direction and height of measurement in words; empty where it never blows."""
        height = f" at {self.measured_at_m:g} m" if self.measured_at_m else ""
        blows = f"wind {self.speed_mps:.3g} m/s from {self.from_deg:.0f} deg{height}"
        return f"{blows}{', changing' if self.changes else ''}" if self.fastest_mps else ""


class VerticalGustsSpec(Section):
    """Discrete vertical gusts on top of the wind: upwards and downwards in turn, 1 - cosine each."""

    speed_mps: Annotated[float, Field(gt=0, le=50)]
    """Speed of a gust at its strongest."""
    duration_s: Annotated[float, Field(gt=0, le=1e4)]
    """How long one lasts (its length over the airspeed)."""
    every_s: Annotated[float, Field(gt=0, le=1e7)]
    """Time from the beginning of one to that of the next."""
    start_s: Annotated[float, Field(ge=0, le=1e7)] = 60.0
    """When the first begins."""

    @model_validator(mode="after")
    def _check_spacing(self) -> VerticalGustsSpec:
        if self.duration_s > self.every_s:
            raise KeyFault(("duration_s",), f"is {self.duration_s:g}; must be at most every_s {self.every_s:g}")
        return self


class Turbulence(Section):
    """Continuous gusts on top of the wind."""

    model: Literal["tustin", "milspec"] = "milspec"
    """Gusts as JSBSim has them: those of MIL-F-8785C, or Dryden's by Tustin's rule, which add a mean wind where the
    airspeed is low (`aircraft/README.md`). Over true ground they are one."""
    intensity: Literal["none", "light", "moderate", "severe"] = "moderate"
    """How strong. Default: that of the conditions, moderate for ideal."""


class Environment(Section):
    """The air."""

    wind: Wind | None = None
    """Wind. Default: that of the conditions; calm for ideal."""
    vertical_gusts: VerticalGustsSpec | None = None
    """Vertical gusts. Default: those of the conditions; none for ideal."""
    turbulence: Turbulence | None = None
    """Continuous gusts. Default: those of the conditions; smooth air for ideal."""

    @property
    def gusts(self) -> str | None:
        """Intensity of the turbulence; None in smooth air."""
        intensity = self.turbulence.intensity if self.turbulence else "none"
        return None if intensity == "none" else intensity
