"""Groups of runs by a varied key: its values, or quantiles of them where a number was drawn at random."""

from __future__ import annotations

import itertools
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from harness.campaign.table import IntArray

MOST_NUMBERS: Final = 8
"""A key with more different numbers is taken as drawn at random."""

BINS: Final = 4
MOST_NAMES: Final = 12
"""Most names with a group of their own; the rarest of more share one."""

NONE: Final = "not set"


@dataclass(frozen=True)
class Axis:
    """The values of a key, in groups.

    Attributes:
        key: its path.
        labels: of the groups, in order.
        edges: where the groups are quantiles, their limits from the least value to the largest; the limit
            between two belongs to the upper one. Else empty.
        numeric: whether the labels are numbers in order.
    """

    key: str
    labels: tuple[str, ...]
    edges: tuple[float, ...] = ()
    numeric: bool = False


def grouped(key: str, values: Sequence[Any], drawn: bool = False) -> tuple[Axis, IntArray]:
    """The groups of a key's values, and each value's group.

    Numbers stand in rising order, names as they first appear; values that are missing come last.

    Args:
        key: its path.
        values: one a run; None where there is none.
        drawn: they were drawn at random: numbers are grouped by quantiles where there are more than of these.
    """
    given = [value for value in values if value is not None]
    numeric = bool(given) and all(
        isinstance(value, int | float) and not isinstance(value, bool) for value in given
    )
    if numeric:
        if len(set(given)) > (BINS if drawn else MOST_NUMBERS):
            return _binned(key, values)
        labels = dict(zip(sorted(set(given)), _numbers(sorted(set(given))), strict=True))
    else:
        labels = _names(given)
    texts = [NONE if value is None else labels[_hashable(value)] for value in values]
    order = tuple(dict.fromkeys([*labels.values(), *(text for text in texts if text == NONE)]))
    return Axis(key, order, numeric=numeric), _indices(order, texts)


def _numbers(values: Sequence[float], digits: int = 6) -> list[str]:
    """Different numbers with as many digits as tell them apart."""
    for count in range(digits, 18):
        texts = [f"{value:.{count}g}" for value in values]
        if len(set(texts)) == len(texts):
            return texts
    raise ValueError(f"not all different: {values}")


def _names(given: Sequence[Any]) -> dict[Any, str]:
    """A label for each value that is not a number."""
    counts = Counter(map(_hashable, given))
    every = list(counts)
    if len(every) <= MOST_NAMES:
        return {value: _text(value) for value in every}
    kept = {value for value, _ in counts.most_common(MOST_NAMES - 1)}
    others = f"{len(every) - len(kept)} others"
    first = [value for value in every if value in kept]
    return {value: _text(value) for value in first} | {value: others for value in every if value not in kept}


def _binned(key: str, values: Sequence[Any]) -> tuple[Axis, IntArray]:
    numbers = np.array([np.nan if value is None else value for value in values], dtype=np.float64)
    missing = np.isnan(numbers)
    edges = np.unique(np.quantile(numbers[~missing], np.linspace(0.0, 1.0, BINS + 1)))
    labels = tuple(f"{low} to {high}" for low, high in itertools.pairwise(_numbers(edges.tolist(), 4)))
    index = np.searchsorted(edges[1:-1], numbers, side="right")
    if missing.any():
        index[missing] = len(labels)
        labels = (*labels, NONE)
    return Axis(key, labels, tuple(edges.tolist()), numeric=True), index.astype(np.int64)


def _indices(order: Sequence[str], texts: Sequence[str]) -> IntArray:
    places = {text: place for place, text in enumerate(order)}
    return np.array([places[text] for text in texts], dtype=np.int64)


def _hashable(value: Any) -> Any:
    return json.dumps(value, sort_keys=True) if isinstance(value, list | dict) else value


def _text(value: Any) -> str:
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else str(value)
