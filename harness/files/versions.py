"""Versions of Python and of the distributions that a flight depends on."""

from __future__ import annotations

import platform
from collections.abc import Iterable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Final

FLOWN_WITH: Final = ("wayproof", "jsbsim", "numba", "numpy", "scipy", "shapely")
"""Distributions that a flight's bits depend on, besides Python; with others a campaign cannot be resumed."""


def versions(distributions: Iterable[str] = FLOWN_WITH) -> dict[str, str | None]:
    """Returns the versions of Python and of distributions by name; None for one that is not installed."""
    return {"python": platform.python_version(), **{name: _version(name) for name in distributions}}


@cache
def _version(distribution: str) -> str | None:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return None
