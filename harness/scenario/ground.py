"""The ground of a scenario and the files that obstacles were made of, as frozen types: attribute = key."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field, Strict, model_validator

from harness.scenario.sections import MAX_COORDINATE_M, Point, Section, key

if TYPE_CHECKING:
    from harness.world_files.height_field import HeightField

Note = Annotated[str, Field(min_length=1)]
Spacing = Annotated[float, Field(gt=0, le=MAX_COORDINATE_M)]

STEP_M = 0.1
"""Heights are kept to this, and coarser where they span more than 6.5 km."""


class GroundSpec(Section):
    """The true height of the ground on a grid, bilinear in between; wayproof writes it from terrain files."""

    corner_m: Point = key("South-western node: east, north.", unit="m")
    spacing_m: Annotated[tuple[Spacing, Spacing], Strict(False)] = key(
        "From node to node: east, north.", unit="m"
    )
    rows: int = key("Nodes from south to north.", unit="1", ge=1, le=100_000)
    columns: int = key("Nodes from west to east.", unit="1", ge=1, le=100_000)
    lowest_m: float = key("Height of the number 0, above mean sea level.", unit="m", ge=-12_000, le=9000)
    step_m: float = key("Height from a number to the next.", unit="m", default=STEP_M, gt=0, le=10)
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
    polygons: int = key("How many obstacles were made of it.", unit="1", ge=0)
    notes: Annotated[tuple[Note, ...], Strict(False)] = key(
        "What was assumed or passed over. Default: nothing.", default=()
    )
