"""Guidance laws by name: the built-in ones and those of other distributions.

Another distribution adds a law by an entry point in the group `wayproof.guidance` that names a `GuidanceKind`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import Any

from aircraft.guidance.bearing import BearingConfig, BearingLaw
from aircraft.guidance.interface import GuidanceLaw, GuidanceLimits
from aircraft.guidance.l1 import L1Config, L1Law
from aircraft.guidance.npfg import NpfgConfig, NpfgLaw
from aircraft.guidance.preview import PreviewConfig, PreviewLaw
from aircraft.guidance.pure_pursuit import PurePursuitConfig, PurePursuitLaw
from aircraft.guidance.vector_field import VectorFieldConfig, VectorFieldLaw

GROUP = "wayproof.guidance"
DEFAULT_KIND = "preview"


@dataclass(frozen=True)
class GuidanceKind:
    """A guidance law that scenarios may name.

    Attributes:
        kind: the name, as in `guidance.kind` of a scenario.
        summary: one line for `wayproof list guidance`.
        config: frozen dataclass of the law's own keys. Each field has a default and the metadata `doc` (a sentence),
            `unit`, and `minimum` / `maximum` or `above` where there is such a bound. A default of None is derived:
            `config.resolved(limits)` returns the config with no None left and raises ValueError, with a sentence,
            where keys contradict each other.
        make: the law for one flight, from a resolved config and what may be asked of the aircraft.
    """

    kind: str
    summary: str
    config: type[Any]
    make: Callable[[Any, GuidanceLimits], GuidanceLaw]

    def law(self, limits: GuidanceLimits, **keys: Any) -> GuidanceLaw:
        """The law for one flight, its own keys given or at their defaults.

        Raises:
            ValueError: keys contradict each other.
        """
        return self.make(self.config(**keys).resolved(limits), limits)


BUILT_IN = tuple(
    GuidanceKind(kind, summary, config, law)
    for kind, config, law, summary in (
        ("preview", PreviewConfig, PreviewLaw,
         "path curvature ahead of the roll lag, and a second-order correction of the cross-track error"),
        ("npfg", NpfgConfig, NpfgLaw,
         "PX4's (Stastny, Siegwart): a look-ahead angle to the path, the wind triangle, curvature fed forward"),
        ("l1", L1Config, L1Law,
         "ArduPilot's (Park, Deyst, How): a point on the leg ahead; lines as legs, arcs as loiter circles"),
        ("vector_field", VectorFieldConfig, VectorFieldLaw,
         "Beard and McLain: a field of courses about lines and orbits, and course hold"),
        ("pure_pursuit", PurePursuitConfig, PurePursuitLaw,
         "Coulter: the arc to the point of the path at a look-ahead distance"),
        ("bearing", BearingConfig, BearingLaw,
         "simple autopilots': bank in proportion to the angle between course and the bearing to a point"),
    )
)  # fmt: skip


_registered: dict[str, GuidanceKind] = {}


def register(kind: GuidanceKind) -> None:
    """Lets this process, and no other, know a law by its name, as an entry point does for every process.

    One that was registered under the same name before is replaced.

    Raises:
        ValueError: a built-in law, or one of another distribution, has the name.
    """
    if kind.kind in installed_kinds():
        raise ValueError(f"there is a guidance law called {kind.kind} already; give this one another name")
    _registered[kind.kind] = kind


def guidance_kinds() -> dict[str, GuidanceKind]:
    """All guidance laws by name: the installed ones, and those that this process has registered."""
    return {**installed_kinds(), **_registered}


class PluginError(ImportError):
    """A guidance law of another distribution cannot be loaded; the message says which, why, and what to do."""


def installed_kinds() -> dict[str, GuidanceKind]:
    """The guidance laws that every process finds, by name, built-in ones first.

    Raises:
        PluginError: one of another distribution cannot be loaded.
    """
    kinds = {kind.kind: kind for kind in BUILT_IN}
    for point in _outside(entry_points, tuple(sys.path)):
        outside = _loaded(point)
        kinds.setdefault(outside.kind, outside)
    return kinds


def distribution_of(kind: str) -> str | None:
    """Name and version of the other distribution that a law comes from; None for a built-in one."""
    if kind in (built_in.kind for built_in in BUILT_IN):
        return None
    for point in _outside(entry_points, tuple(sys.path)):
        if _loaded(point).kind == kind and point.dist is not None:
            return f"{point.dist.name} {point.dist.version}"
    return None


@cache
def _outside(find: Callable[..., EntryPoints], path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Entry points of other distributions; to look for them takes as long as all else of reading a scenario."""
    return tuple(find(group=GROUP))


def _loaded(point: EntryPoint) -> GuidanceKind:
    """What an entry point of another distribution names.

    Raises:
        PluginError: it names something else, or cannot be loaded.
    """
    owner = f"{point.dist.name} {point.dist.version}" if point.dist is not None else "another distribution"
    told = f"the guidance law of entry point {point.name!r} ({point.value}) of {owner}"
    try:
        outside = point.load()
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise PluginError(
            f"{told} cannot be loaded: {reason}; mend or uninstall that distribution"
        ) from error
    if not isinstance(outside, GuidanceKind):
        raise PluginError(f"{told} is no GuidanceKind; mend or uninstall that distribution")
    return outside
