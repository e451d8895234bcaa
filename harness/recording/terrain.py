"""The ground in a recording: a shaded mesh at its true heights.

Frame: local ENU plane, metres.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from harness.flight.record import FloatArray
from harness.recording import blueprint as look
from harness.world_files.height_field import HeightField

MOST_NODES: Final = 160_000
"""Nodes of the drawn mesh: a recording stays small, and a screen shows no more."""
SUN: Final = (-0.5, 0.5, 0.7071)
"""Towards the light: from the north-west and 45 degrees high, as maps are shaded."""
LOW, HIGH = np.array((58.0, 74.0, 62.0)), np.array((150.0, 140.0, 126.0))
"""Colours of the lowest and the highest ground in full light."""
SHADE: Final = 0.35
"""Share of the colour that is left where no light falls."""


def log_ground(rec: rr.RecordingStream, field: HeightField) -> None:
    """Logs the ground, every so many nodes of a fine one; where its height is not known there is a hole."""
    rows, columns = field.heights_m.shape
    step = max(int(np.ceil(np.sqrt(rows * columns / MOST_NODES))), 1)
    heights = field.heights_m[::step, ::step]
    if min(heights.shape) < 2:
        return
    right, up = (step * each for each in field.spacing_m)
    east, north = np.meshgrid(
        field.corner_m[0] + right * np.arange(heights.shape[1]),
        field.corner_m[1] + up * np.arange(heights.shape[0]),
    )
    rec.log(
        f"{look.WORLD}/ground",
        rr.Mesh3D(
            vertex_positions=np.column_stack((east.ravel(), north.ravel(), np.nan_to_num(heights).ravel())),
            vertex_colors=shaded(heights, right, up).reshape(-1, 3),
            triangle_indices=triangles(np.isfinite(heights)),
        ),
        static=True,
    )


def shaded(heights: FloatArray, right_m: float, up_m: float) -> NDArray[np.uint8]:
    """(rows, columns, 3) colours by height, lit from the north-west (hillshade: Horn, Proc. IEEE 69, 1981)."""
    known = np.where(np.isfinite(heights), heights, np.nanmin(heights))
    slope_north, slope_east = np.gradient(known, up_m, right_m)
    size = np.sqrt(1.0 + slope_east**2 + slope_north**2)
    light = np.clip((-SUN[0] * slope_east - SUN[1] * slope_north + SUN[2]) / size, 0.0, 1.0)
    low, high = float(known.min()), float(known.max())
    share = (known - low) / max(high - low, 1.0)
    colour = LOW + share[..., None] * (HIGH - LOW)
    lit: NDArray[np.uint8] = np.clip(
        colour * (SHADE + (1.0 - SHADE) * light / SUN[2])[..., None], 0, 255
    ).astype(np.uint8)
    return lit


def triangles(known: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(k, 3) indices of two triangles a cell whose four nodes are known, counter-clockwise from above."""
    columns = known.shape[1]
    whole = known[:-1, :-1] & known[:-1, 1:] & known[1:, :-1] & known[1:, 1:]
    row, column = np.nonzero(whole)
    low = row * columns + column
    high = low + columns
    found: NDArray[np.int64] = np.concatenate(
        (np.column_stack((low, low + 1, high + 1)), np.column_stack((low, high + 1, high)))
    )
    return found
