"""`run.metrics`: the content of `metrics.json`, each key an attribute.

`wayproof list metrics` says what each figure means, `harness.analysis.metrics` how it is defined.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final, NoReturn

from harness.analysis.registry import METRICS

OPTIONAL: Final = frozenset(metric.path.partition(".")[0] for metric in METRICS if not metric.derived) | {
    *("shield", "findings", "contact", "contacts", "breaches", "check", "height_above_ground_m")
}
"""Figures that are None where a run does not have them: a run without a given path has no `check`."""


class Figures(dict[str, Any]):
    """A mapping of `metrics.json`, read only: `run.metrics.cross_track_m.p95`, `run.metrics.check.corners[0].kept`."""

    def __init__(self, content: Mapping[str, Any]) -> None:
        super().__init__({name: _as_figures(value) for name, value in content.items()})

    def __getattr__(self, name: str) -> Any:
        if name not in self:
            raise AttributeError(f"no figure {name!r}; there are {', '.join(self)}")
        return self[name]

    def __setattr__(self, *_change: object, **_changes: object) -> NoReturn:
        raise AttributeError("figures of a run cannot be changed; to_dict() gives a copy that is yours")

    __setitem__ = __delitem__ = __ior__ = __setattr__
    update = pop = popitem = setdefault = clear = __setattr__

    def __reduce__(self) -> tuple[type[Figures], tuple[dict[str, Any]]]:
        return type(self), (dict(self),)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]

    def __repr__(self) -> str:
        figures = [
            f"{name}={value:.4g}" if isinstance(value, float) else f"{name}={value!r:.40}"
            for name, value in self.items()
            if not isinstance(value, dict | tuple)
        ]
        return f"{type(self).__name__}({', '.join(figures[:5])}{', ...' if len(self) > 5 else ''})"

    def to_dict(self) -> dict[str, Any]:
        """The content of `metrics.json`, key by key; yours to change."""
        return dict(json.loads(json.dumps(self)))


class Metrics(Figures):
    """All figures of one run; one of `OPTIONAL` that the run does not have is None."""

    def __getattr__(self, name: str) -> Any:
        return None if name in OPTIONAL and name not in self else super().__getattr__(name)


def _as_figures(value: Any) -> Any:
    if isinstance(value, dict):
        return Figures(value)
    return tuple(map(_as_figures, value)) if isinstance(value, list | tuple) else value
