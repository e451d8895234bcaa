"""Columns of `results.parquet` for the keys that a campaign varies: what they hold, and their cells."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from harness.strict_yaml import Scalar


def kind_of(values: Sequence[Any]) -> str:
    """What a column of these values holds, nulls aside."""
    kinds = {type(value) for value in values if value is not None}
    for name, of in (("bool", {bool}), ("int", {int}), ("number", {int, float}), ("text", {str})):
        if kinds <= of:
            return name
    return "json"


def cell_of(value: Any, kind: str) -> Scalar:
    """A value as its column has it."""
    if kind == "json":
        return json.dumps(value)
    return float(value) if kind == "number" and value is not None else value
