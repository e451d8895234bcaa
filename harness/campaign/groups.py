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
        edges: where the groups are quantiles, their limits from the least value to the largest; the limit
            between two belongs to the upper one. Else empty.
    """

    key: str
    labels: tuple[str, ...]
    edges: tuple[float, ...] = ()


def is_direction(key: str) -> bool:
    """Whether a key is a direction."""
    return key.endswith(DIRECTIONS)


def are_numbers(values: Sequence[Any]) -> bool:
    """Whether values are numbers, but for those that are missing."""
    given = [value for value in values if value is not None]
    return bool(given) and all(
        isinstance(value, int | float) and not isinstance(value, bool) for value in given
    )


def grouped(key: str, values: Sequence[Any], drawn: bool = False) -> tuple[Axis, IntArray]:
    """The groups of a key's values, and each value's group.

    Numbers stand in rising order, names as they first appear; values that are missing come last.

    `drawn`: they were drawn at random: numbers are grouped where there are more than `BINS`.
    """
    if are_numbers(values):
        different = sorted({value for value in values if value is not None})
        if len(different) > (BINS if drawn else MAX_NUMBERS):
            return _binned(key, values)
        names: dict[Any, str] = dict(zip(different, _told_apart(different), strict=True))
    else:
        names = _names([_hashable(value) for value in values if value is not None])
    labels = [*dict.fromkeys(names.values()), *([NONE] if None in values else [])]
    texts = [NONE if value is None else names[_hashable(value)] for value in values]
    return Axis(key, tuple(labels)), np.array([labels.index(text) for text in texts], dtype=np.int64)


def _names(given: Sequence[Any]) -> dict[Any, str]:
    """A label for each value that is not a number."""
    counts = Counter(given)
    common = counts if len(counts) <= MAX_NAMES else dict(counts.most_common(MAX_NAMES - 1))
    others = f"{len(counts) - len(common)} others"
    first = {value: _text(value) for value in counts if value in common}
    return first | {value: others for value in counts if value not in common}


def _binned(key: str, values: Sequence[Any]) -> tuple[Axis, IntArray]:
    """Quantiles of numbers, or quarters of the compass, each about one of its points."""
    numbers = np.array([np.nan if value is None else value for value in values], dtype=np.float64)
    missing = np.isnan(numbers)
    if is_direction(key):
        labels, edges = SECTORS, ()
        index = np.floor(np.nan_to_num((numbers + 45.0) % 360.0) / 90.0)
    else:
        limits = np.unique(np.quantile(numbers[~missing], np.linspace(0.0, 1.0, BINS + 1)))
        edges = tuple(limits.tolist())
        labels = tuple(f"{low} to {high}" for low, high in itertools.pairwise(_told_apart(edges, 4)))
        index = np.searchsorted(limits[1:-1], numbers, side="right")
    group: IntArray = np.where(missing, len(labels), index).astype(np.int64)
    return Axis(key, (*labels, NONE) if missing.any() else labels, edges), group


def _told_apart(values: Sequence[float], digits: int = 6) -> list[str]:
    """Different numbers with as many digits as tell them apart."""
    for count in range(digits, 18):
        texts = [f"{value:.{count}g}" for value in values]
        if len(set(texts)) == len(texts):
            break
    return texts


def _hashable(value: Any) -> Any:
    return json.dumps(value, sort_keys=True) if isinstance(value, list | dict) else value


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
