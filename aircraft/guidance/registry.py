"""The guidance laws that come with wayproof, as scenarios name them.

Another distribution adds a law by an entry point in the group `wayproof.guidance` that names a `GuidanceKind`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from aircraft.guidance.bearing import BearingConfig, BearingLaw
from aircraft.guidance.interface import GuidanceLaw, GuidanceLimits
from aircraft.guidance.l1 import L1Config, L1Law
from aircraft.guidance.npfg import NpfgConfig, NpfgLaw
from aircraft.guidance.preview import PreviewConfig, PreviewLaw
from aircraft.guidance.pure_pursuit import PurePursuitConfig, PurePursuitLaw
from aircraft.guidance.vector_field import VectorFieldConfig, VectorFieldLaw

DEFAULT_KIND = "preview"  # law of a flight that names none


@dataclass(frozen=True)
class GuidanceKind:
    """A guidance law that scenarios may name."""

    kind: str  # as in `guidance.kind` of a scenario
    summary: str  # one line for `wayproof list guidance`
    config: type[Any]
    """Frozen dataclass of the law's own keys, each a `key` with a default. One of None is derived: `resolved(limits)`
    gives the config with no None left, and raises ValueError, with a sentence, where keys contradict each other."""
    make: Callable[[Any, GuidanceLimits], GuidanceLaw]
    """The law for one flight, from a resolved config and what may be asked of the aircraft."""

    def law(self, limits: GuidanceLimits, **keys: Any) -> GuidanceLaw:
        """The law for one flight, its own keys given or at their defaults; ValueError if they contradict each other."""
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
