"""The air and the ground of a scenario, and the files that obstacles were made of: frozen types, attribute = key."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, Strict, model_validator

from harness.scenario.sections import MAX_COORDINATE_M, Point, Section, Time, key
from harness.scenario.validation import KeyFault

if TYPE_CHECKING:
    from harness.world_files.height_field import HeightField

Note = Annotated[str, Field(min_length=1)]
Spacing = Annotated[float, Field(gt=0, le=MAX_COORDINATE_M)]

STEP_M = 0.1
"""Heights are kept to this, and coarser where they span more than 6.5 km."""


class GroundSpec(Section):
    """The true height of the ground on a grid, bilinear in between; wayproof writes it from terrain files."""

    corner_m: Point = key("South-western node: east, north.")
    spacing_m: Annotated[tuple[Spacing, Spacing], Strict(False)] = key("From node to node: east, north.")
    rows: int = key("Nodes from south to north.", ge=1, le=100_000)
    columns: int = key("Nodes from west to east.", ge=1, le=100_000)
    lowest_m: float = key("Height of the number 0, above mean sea level.", ge=-12_000, le=9000)
    step_m: float = key("Height from a number to the next.", STEP_M, gt=0, le=10)
    heights: str = key(
        "Heights: base64 of zlib of 16-bit little-endian numbers, row by row from the south, each the difference to "
        "its neighbour in the west; the number 65535 is a height that is not known.",
        min_length=1,
    )

    @model_validator(mode="after")
    def _can_be_unpacked(self) -> GroundSpec:
        self.field()
        return self

    def field(self) -> HeightField:
        """The heights.

        Raises:
            ValueError: the text does not hold them.
        """
        from harness.world_files.height_field import HeightField, unpacked

        heights_m = unpacked(self.heights, self.rows, self.columns, self.lowest_m, self.step_m)
        return HeightField(self.corner_m, self.spacing_m, heights_m)

    @classmethod
    def of(cls, field: HeightField) -> GroundSpec:
        """The section that holds a height field, to a tenth of a metre."""
        import numpy as np

        from harness.world_files.height_field import packed

        lowest_m = float(np.floor(np.nanmin(field.heights_m)))
        step_m = max(STEP_M, float(np.nanmax(field.heights_m) - lowest_m) / 60_000)
        rows, columns = field.heights_m.shape
        return cls.model_construct(
            corner_m=field.corner_m,
            spacing_m=field.spacing_m,
            rows=rows,
            columns=columns,
            lowest_m=lowest_m,
            step_m=step_m,
            heights=packed(field.heights_m, lowest_m, step_m),
        )


class SourceSpec(Section):
    """A file that obstacles or ground were made of; wayproof writes it, and does not read it again."""

    path: str = key("The file, as the scenario named it.", min_length=1, max_length=1000)
    kind: str = key("Its kind.", min_length=1, max_length=40)
    sha256: str = key("SHA-256 of its bytes.", pattern="^[0-9a-f]{64}$")
    polygons: int = key("How many obstacles were made of it.", ge=0)
    notes: Annotated[tuple[Note, ...], Strict(False)] = key(
        "What was assumed or passed over. Default: nothing.", default=()
    )


WindSpeed = Annotated[float, Field(ge=0, le=200)]
Direction = Annotated[float, Field(ge=0, le=360)]
Change = Annotated[tuple[Time, WindSpeed, Direction], Strict(False)]


class Wind(Section):
    """Wind, the same everywhere at one height and time; steady unless changes are given."""

    speed_mps: float = key("Wind speed; must be below 0.9 of the airspeed.", 0.0, ge=0, le=200)
    from_deg: float = key("Direction it blows from.", 270.0, ge=0, le=360)
    measured_at_m: float | None = key(
        "Height over ground of these speeds; above and below, the wind has the logarithmic profile of MIL-F-8785C. "
        "Default: the wind is the same at all heights.",
        None,
        ge=1,
        le=300,
    )
    changes: Annotated[tuple[Change, ...], Strict(False)] = key(
        "Later winds: time in s, speed in m/s, direction in degrees, each; the wind goes over linearly from one to the "
        "next, and stays after the last.",
        (),
        max_length=10_000,
    )

    @model_validator(mode="after")
    def _times_rise(self) -> Wind:
        times = [0.0, *(time_s for time_s, _, _ in self.changes)]
        for index, (before, after) in enumerate(itertools.pairwise(times)):
            if not before < after:
                raise KeyFault(
                    ("changes", index), f"is at {after:g} s; must be later than {before:g} s, the one before"
                )
        return self

    @property
    def fastest_mps(self) -> float:
        """Largest speed at any time, at the height at which they are measured."""
        return max(self.speed_mps, *(speed for _, speed, _ in self.changes), 0.0)


class VerticalGustsSpec(Section):
    """Discrete vertical gusts on top of the wind: upwards and downwards in turn, 1 - cosine each."""

    speed_mps: float = key("Speed of a gust at its strongest.", gt=0, le=50)
    duration_s: float = key("How long one lasts (its length over the airspeed).", gt=0, le=1e4)
    every_s: float = key("Time from the beginning of one to that of the next.", gt=0, le=1e7)
    start_s: float = key("When the first begins.", 60.0, ge=0, le=1e7)

    @model_validator(mode="after")
    def _one_after_the_other(self) -> VerticalGustsSpec:
        if self.duration_s > self.every_s:
            raise KeyFault(
                ("duration_s",), f"is {self.duration_s:g}; must be at most every_s {self.every_s:g}"
            )
        return self


class Turbulence(Section):
    """Continuous gusts on top of the wind."""

    model: Literal["tustin", "milspec"] = key(
        "Dryden gusts: Tustin's discretisation, or MIL-F-8785C as JSBSim has it; over true ground they are one.",
        "tustin",
    )
    intensity: Literal["none", "light", "moderate", "severe"] = key("How strong.", "moderate")


class Environment(Section):
    """The air."""

    wind: Wind | None = key("Wind. Default: that of the conditions; calm for ideal.", None)
    vertical_gusts: VerticalGustsSpec | None = key(
        "Vertical gusts. Default: those of the conditions; none for ideal.", default=None
    )
    turbulence: Turbulence | None = key(
        "Continuous gusts. Default: those of the conditions; smooth air for ideal.", default=None
    )

    @property
    def gusts(self) -> str | None:
        """Intensity of the turbulence; None in smooth air."""
        intensity = self.turbulence.intensity if self.turbulence else "none"
        return None if intensity == "none" else intensity
