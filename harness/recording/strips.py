"""Polylines as rerun keeps them. rerun itself would turn them one by one: a tenth of what a recording costs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr
from rerun.encodings import Vec2DBatch, Vec3DBatch

from harness.flight.record import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa


def strips_2d(polylines: Sequence[FloatArray]) -> pa.ListArray:
    """(n,) strips of polylines (k, 2), each of a length of its own."""
    return _strips(polylines, 2, Vec2DBatch, rr.components.LineStrip2D)


def strips_3d(polylines: Sequence[FloatArray]) -> pa.ListArray:
    """(n,) strips of polylines (k, 3), each of a length of its own."""
    return _strips(polylines, 3, Vec3DBatch, rr.components.LineStrip3D)


def _strips(polylines: Sequence[FloatArray], axes: int, points: Any, strip: Any) -> pa.ListArray:
    import pyarrow as pa

    ends = np.cumsum([0, *map(len, polylines)], dtype=np.int32)
    joined = np.concatenate([np.zeros((0, axes)), *polylines])
    return pa.ListArray.from_arrays(ends, points(joined).as_arrow_array(), type=strip.arrow_type())
