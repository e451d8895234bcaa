"""Columns of Arrow tables from arrays, without pandas.

`pyarrow.array` imports pandas, where it is installed, to ask whether it was given an object of pandas. That takes
longer than writing a flight's tables, so values are handed over as buffers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

if TYPE_CHECKING:
    import pyarrow as pa


def numbers(values: ArrayLike, dtype: DTypeLike = np.float64) -> pa.Array:
    """A column of numbers; not a copy of an array that is contiguous and of this type."""
    import pyarrow as pa

    array: NDArray[Any] = np.ascontiguousarray(values, dtype)
    return pa.Array.from_buffers(pa.from_numpy_dtype(array.dtype), len(array), [None, pa.py_buffer(array)])


def truths(values: ArrayLike) -> pa.Array:
    """A column of true and false."""
    import pyarrow as pa

    array = np.asarray(values, np.bool_)
    bits = np.packbits(array, bitorder="little")
    return pa.Array.from_buffers(pa.bool_(), len(array), [None, pa.py_buffer(bits)])


def texts(values: Sequence[str]) -> pa.Array:
    """A column of texts."""
    import pyarrow as pa

    coded = [value.encode() for value in values]
    ends = np.cumsum([0, *(len(each) for each in coded)], dtype=np.int32)
    return pa.StringArray.from_buffers(len(coded), pa.py_buffer(ends), pa.py_buffer(b"".join(coded)))


def lists(rows: Sequence[NDArray[np.float64]], width: int) -> pa.Array:
    """A column of lists of rows: of each entry (n, width) numbers."""
    import pyarrow as pa

    flat = np.concatenate([np.zeros((0, width)), *rows]).ravel()
    ends = np.cumsum([0, *(len(each) for each in rows)])
    values = pa.FixedSizeListArray.from_arrays(numbers(flat), width)
    return pa.ListArray.from_arrays(numbers(ends, np.int32), values)
