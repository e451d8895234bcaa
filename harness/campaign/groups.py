"""Groups of runs by a varied key: its values, quantiles of drawn numbers, or quarters of the compass for directions."""

from __future__ import annotations

import itertools
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from harness.campaign.table import IntArray

MAX_NUMBERS: Final = 8
"""A key with more different numbers than this is taken as drawn at random."""

BINS: Final = 4
"""Numbers drawn at random are grouped into this many quantiles, directions into as many sectors."""

MAX_NAMES: Final = 12
"""At most this many names have a group of their own; the rarest of more share one."""

NONE: Final = "not set"

DIRECTIONS: Final = ("from_deg", "course_deg", "heading_deg")
"""Ends of the paths of keys that are directions: 359 degrees is beside 0."""

SECTORS: Final = tuple(
    f"{name}, {low:g} to {low + 90:g}" for name, low in zip("NESW", (-45, 45, 135, 225), strict=True)
)


@dataclass(frozen=True)
class Axis:
    """The values of a key, in groups.

    Attributes:
        key: its path.
        labels: of the groups, in order.
        edges: where the groups are quantiles, their limits from the least value to the largest; the limit
            between two belongs to the upper one. Else empty.
        numeric: whether the labels are numbers in order, which directions are not.
    """

    key: str
    labels: tuple[str, ...]
    edges: tuple[float, ...] = ()
    numeric: bool = False


def is_direction(key: str) -> bool:
    """Whether a key is a direction."""
    return key.endswith(DIRECTIONS)


def grouped(key: str, values: Sequence[Any], drawn: bool = False) -> tuple[Axis, IntArray]:
    """The groups of a key's values, and each value's group.

    Numbers stand in rising order, names as they first appear; values that are missing come last.

    Args:
        key: its path.
        values: one a run; None where there is none.
        drawn: they were drawn at random: numbers are grouped where there are more than `BINS`.
    """
    given = [value for value in values if value is not None]
    if not _are_numbers(given):
        labels, numeric = _names(given), False
    elif len(set(given)) > (BINS if drawn else MAX_NUMBERS):
        return _sectors(key, values) if is_direction(key) else _quantiles(key, values)
    else:
        different, numeric = sorted(set(given)), not is_direction(key)
        labels = dict(zip(different, _numbers(different), strict=True))
    texts = [NONE if value is None else labels[_hashable(value)] for value in values]
    order = tuple(dict.fromkeys([*labels.values(), *(NONE for text in texts if text == NONE)]))
    places = {text: place for place, text in enumerate(order)}
    return Axis(key, order, numeric=numeric), np.array([places[text] for text in texts], dtype=np.int64)


def _are_numbers(given: Sequence[Any]) -> bool:
    return bool(given) and all(
        isinstance(value, int | float) and not isinstance(value, bool) for value in given
    )


def _numbers(values: Sequence[float], digits: int = 6) -> list[str]:
    """Different numbers with as many digits as tell them apart."""
    for count in range(digits, 18):
        texts = [f"{value:.{count}g}" for value in values]
        if len(set(texts)) == len(texts):
            break
    return texts


def _names(given: Sequence[Any]) -> dict[Any, str]:
    """A label for each value that is not a number."""
    counts = Counter(map(_hashable, given))
    common = counts if len(counts) <= MAX_NAMES else dict(counts.most_common(MAX_NAMES - 1))
    others = f"{len(counts) - len(common)} others"
    first = {value: _text(value) for value in counts if value in common}
    return first | {value: others for value in counts if value not in common}


def _quantiles(key: str, values: Sequence[Any]) -> tuple[Axis, IntArray]:
    numbers = _floats(values)
    edges = np.unique(np.quantile(numbers[~np.isnan(numbers)], np.linspace(0.0, 1.0, BINS + 1)))
    labels = tuple(f"{low} to {high}" for low, high in itertools.pairwise(_numbers(edges.tolist(), 4)))
    index = np.searchsorted(edges[1:-1], numbers, side="right")
    labels, index = _with_missing(labels, index, numbers)
    return Axis(key, labels, tuple(edges.tolist()), numeric=True), index


def _sectors(key: str, values: Sequence[Any]) -> tuple[Axis, IntArray]:
    """Quarters of the compass, each about one of its points."""
    numbers = _floats(values)
    index = np.floor(np.nan_to_num((numbers + 45.0) % 360.0) / 90.0)
    labels, index = _with_missing(SECTORS, index, numbers)
    return Axis(key, labels), index


def _floats(values: Sequence[Any]) -> Any:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _with_missing(labels: tuple[str, ...], index: Any, numbers: Any) -> tuple[tuple[str, ...], IntArray]:
    """The groups with one more for values that are missing, where any is."""
    missing = np.isnan(numbers)
    found: IntArray = np.where(missing, len(labels), index).astype(np.int64)
    return (*labels, NONE) if missing.any() else labels, found


def _hashable(value: Any) -> Any:
    return json.dumps(value, sort_keys=True) if isinstance(value, list | dict) else value


def _text(value: Any) -> str:
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else str(value)
