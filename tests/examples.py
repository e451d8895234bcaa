"""How many random examples a property test tries."""

from typing import Final

from hypothesis import settings

ALL: Final = "all"
"""`pytest --hypothesis-profile all` tries more."""

TIMES: Final = 7  # so many times as many


def examples(some: int) -> int:
    """So many examples, or `TIMES` as many where that was asked for."""
    return some * (TIMES if settings.get_current_profile_name() == ALL else 1)
