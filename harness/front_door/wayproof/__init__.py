"""Flies a path planner's waypoints with a JSBSim aircraft, closed loop, and says where they could be tracked.

    import wayproof

    run = wayproof.fly("aerosonde_forest")
    run.outcome, run.metrics.cross_track_m.p95, run.track.to_pandas()

The names are those of the package `harness`, which holds all of the simulation. Each is imported when it is first used.
"""

from __future__ import annotations

from wayproof.environments import register_environments

TYPE_CHECKING = False  # as of `typing`, which takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

    from harness import *  # noqa: F403

register_environments()


def __getattr__(name: str) -> Any:
    """A name of `harness`, or the list of them."""
    from wayproof.rooms import own_packages

    if name == "__all__" or (not name.startswith("_") and name in own_packages().__all__):
        globals()[name] = found = getattr(own_packages(), name)
        return found
    raise AttributeError(f"module 'wayproof' has no attribute {name!r}")


def __dir__() -> list[str]:
    from wayproof.rooms import own_packages

    return sorted(own_packages().__all__)
