"""Cases of a parametrised test that take longer than the quick tests may."""

from collections.abc import Iterable
from typing import Any

import pytest


def longer(cases: Iterable[Any]) -> list[Any]:
    """The cases, marked as flights: `pytest -m flights` runs them. A tuple is one case of several parameters."""
    return [pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.flights) for case in cases]
