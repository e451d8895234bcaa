"""How much of the failures each varied quantity explains."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from harness.campaign.groups import grouped

SECTIONS: Final = ("environment", "navigation", "uncertainty", "sensor", "aircraft")
"""Sections of a scenario whose numbers may differ between days without being varied by name: conditions draw them."""


@dataclass(frozen=True)
class Explained:
    """One varied quantity.

    Attributes:
        key: its key path.
        share: of the variance of failing or not, from 0 to 1: what is due to the group that the quantity falls in.
        worst: the group with the largest share of failures.
        failed: how many failed in that group.
        runs: how many were in it.
    """

    key: str
    share: float
    worst: str
    failed: int
    runs: int


def explained(failed: NDArray[np.bool_], quantities: Mapping[str, Sequence[Any]]) -> tuple[Explained, ...]:
    """The quantities that explain most of the failures first; nothing where none or all failed.

    The share is epsilon squared (Kelley, Proceedings of the National Academy of Sciences 21, 1935): the correlation
    ratio of failing over the quantity's groups, less what groups of a quantity without influence would show.

    Args:
        failed: (n,) whether each day failed.
        quantities: by key path, a value a day.
    """
    if failed.all() or not failed.any():
        return ()
    found = [_of(key, values, failed) for key, values in quantities.items()]
    return tuple(sorted((each for each in found if each), key=lambda each: -each.share))


def _of(key: str, values: Sequence[Any], failed: NDArray[np.bool_]) -> Explained | None:
    axis, group = grouped(key, values, drawn=True)
    sizes = np.bincount(group, minlength=len(axis.labels))
    sums = np.bincount(group, failed, minlength=len(axis.labels))
    used = sizes > 0
    count, groups = len(failed), int(used.sum())
    if groups < 2 or count <= groups:
        return None
    rates, overall = sums[used] / sizes[used], failed.mean()
    between = float((sizes[used] * (rates - overall) ** 2).sum())
    total = float(count * overall * (1.0 - overall))
    within = (total - between) / (count - groups)
    worst = int(np.flatnonzero(used)[rates.argmax()])
    return Explained(
        key,
        max(0.0, (between - (groups - 1) * within) / total),
        axis.labels[worst],
        int(sums[worst]),
        int(sizes[worst]),
    )


def differing(days: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """The numbers and names of some days' scenarios that are not the same on all, by key path.

    Args:
        days: each the plain content of a scenario.
    """
    flat = [
        {f"{name}.{key}": value for name in SECTIONS for key, value in _leaves(day.get(name))} for day in days
    ]
    keys = dict.fromkeys(key for each in flat for key in each)
    columns = {key: [each.get(key) for each in flat] for key in keys}
    return {
        key: values for key, values in columns.items() if len({json.dumps(value) for value in values}) > 1
    }


def _leaves(content: Any, prefix: str = "") -> list[tuple[str, Any]]:
    if not isinstance(content, Mapping):
        return [] if content is None or isinstance(content, list | tuple) else [(prefix[:-1], content)]
    return [leaf for key, value in content.items() for leaf in _leaves(value, f"{prefix}{key}.")]
