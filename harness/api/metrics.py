"""`run.metrics`: the content of `metrics.json`, each key an attribute.

`wayproof list metrics` says what each figure means, `harness.analysis.metrics` how it is defined.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

from harness.analysis.registry import METRICS

OPTIONAL: Final = frozenset(metric.path.partition(".")[0] for metric in METRICS if not metric.derived) | {
    *("shield", "findings", "contact", "contacts", "breaches", "check", "height_above_ground_m")
}
"""Figures that are None where a run does not have them: a run without a given path has no `check`."""

NEEDED: Final = (
    "outcome",
    "reason",
    "flown_length_m",
    "cross_track_m",
    "trackable",
    "trackability",
    "digest",
)
"""Figures of every run."""


class Figures:
    """A mapping of `metrics.json`, read only: a key is an attribute too, and a nested mapping is one of these.

    run.metrics.cross_track_m.p95, run.metrics.check.corners[0].kept
    """

    def __init__(self, content: Mapping[str, Any]) -> None:
        object.__setattr__(self, "_content", content)

    def __getitem__(self, name: str) -> Any:
        return _viewed(self._content[name])

    def __getattr__(self, name: str) -> Any:
        content: Mapping[str, Any] = object.__getattribute__(self, "_content")
        if name not in content:
            raise AttributeError(f"no figure {name!r}; there are {', '.join(content)}")
        return _viewed(content[name])

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("figures of a run cannot be changed; to_dict() gives a copy that is yours")

    def __reduce__(self) -> tuple[type[Figures], tuple[Mapping[str, Any]]]:
        return type(self), (self._content,)

    def __iter__(self) -> Iterator[str]:
        return iter(self._content)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._content]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Figures) and self._content == other._content

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        """Its first figures, shortened."""
        plain = {name: value for name, value in self._content.items() if not isinstance(value, dict | list)}
        told = [
            f"{name}={value:.4g}" if isinstance(value, float) else f"{name}={value!r:.40}"
            for name, value in plain.items()
        ]
        return f"{type(self).__name__}({', '.join(told[:5])}{', ...' if len(self._content) > 5 else ''})"

    def keys(self) -> list[str]:
        """Names of the figures."""
        return [*self._content]

    def to_dict(self) -> dict[str, Any]:
        """The content of `metrics.json`, key by key; yours to change."""
        return copy.deepcopy(dict(self._content))


class Metrics(Figures):
    """All figures of one run; one of `OPTIONAL` that the run does not have is None."""

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> Metrics:
        """The metrics in the content of a `metrics.json`.

        Raises:
            KeyError: a figure that every run has is missing.
        """
        for name in NEEDED:
            content[name]
        return cls(json.loads(json.dumps(content)))

    def __getattr__(self, name: str) -> Any:
        if name in OPTIONAL and name not in object.__getattribute__(self, "_content"):
            return None
        return super().__getattr__(name)


def _viewed(value: Any) -> Any:
    if isinstance(value, dict):
        return Figures(value)
    return tuple(map(_viewed, value)) if isinstance(value, list) else value
